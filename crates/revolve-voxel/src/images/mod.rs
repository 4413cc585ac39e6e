//! Images of solids behind a detector response: blurred by a Gaussian of the depth and averaged over the bins.

mod corners;
pub(crate) mod depth;
pub(crate) mod image;
pub(crate) mod kernel;
mod outline;
mod plane;
pub(crate) mod rule;
mod sides;
