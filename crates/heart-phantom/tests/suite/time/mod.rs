//! What views see of time: from where, how exactly, and with how much memory.

mod bounded;
mod brute;
mod order;
mod random;
mod times;
mod truth;
mod turning;
