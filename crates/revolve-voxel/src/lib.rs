//! Under construction.
mod mask;
pub use mask::Mask;
