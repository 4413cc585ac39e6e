//! Time in projections: angles, accuracy and memory.

mod brute;
mod random;
mod turning;
