//! Known motion: one volume, and projections of it in several states.

mod moving;
mod warp;
mod warps;

pub use moving::{MotionState, MovingOperator};
pub use warp::{Displacements, Warp};
pub use warps::Warps;
