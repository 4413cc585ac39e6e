//! Time in projections: angles, accuracy and memory.

mod bounded;
mod brute;
mod order;
mod random;
mod times;
mod truth;
mod turning;
