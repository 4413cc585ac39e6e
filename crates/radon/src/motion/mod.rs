//! Known motion: one volume, and projections of it in several states.

pub(crate) mod moving;
pub(crate) mod warp;
pub(crate) mod warps;
