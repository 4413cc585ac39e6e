//! Pictures of the study: every figure of Rohmer et al. 2006 (hal-03929238) as a PNG, from plain data.

mod bodies;
mod canvas;
mod check;
mod circle;
mod convergence;
mod error;
mod forces;
mod images;
mod isosurface;
mod marks;
mod page;
mod picture;
mod profile;
mod raster;
mod render;
mod shapes;
mod style;
mod surface;
mod wall;
mod wall_mesh;

pub use bodies::{bodies, poses};
pub use circle::{CircleStudy, circle};
pub use convergence::{History, histories};
pub use error::FigureError;
pub use forces::{ForceFrame, force_frames};
pub use images::{Plane, Projection, Volume, projections, slice, slices};
pub use isosurface::{IsoView, isosurface};
pub use page::{Illustration, Page, Section, Table};
pub use picture::Picture;
pub use render::View;
pub use shapes::{Shape, shapes};
pub use wall_mesh::{WallState, wall_meshes};
