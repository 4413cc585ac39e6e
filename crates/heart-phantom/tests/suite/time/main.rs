//! What views see of time: from where, how exactly, and with how much memory.

mod brute;
mod random;
mod turning;
