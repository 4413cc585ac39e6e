//! Objects that move in a known way: one volume, and views of it in several states.

mod moving;
mod warp;

pub use moving::{MovingOperator, State};
pub use warp::{Displaced, Warp};
