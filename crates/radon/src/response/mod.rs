//! The response of a camera: the width of a point's image against its depth, and the blur by it.

mod kernel;
mod nodes;

pub(crate) use kernel::lattice_gaussian;
pub(crate) use nodes::Nodes;
