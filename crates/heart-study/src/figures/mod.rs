//! Figures of the study: every figure of Rohmer et al. 2006 (hal-03929238) as a PNG, from plain data.
//!
//! Each function validates its input, draws in memory and returns a [`Picture`]. Functions only draw; the font (DejaVu Sans, with
//! its licence) is included.
//!
//! | figure of the paper | function |
//! | --- | --- |
//! | 8, shapes by pressure | [`shapes()`] |
//! | 9, forces on the moving membrane | [`force_frames`] |
//! | 10, norm by iteration; Newton's residuals | [`histories`] |
//! | 11, the wall's mesh | [`wall_meshes`] |
//! | 12, the body, reference and dilated | [`bodies()`] |
//! | 13, the pose | [`poses`] |
//! | 14, projections | [`projections`] |
//! | 15 to 17, reconstructions | [`slices`], [`isosurface()`] |
//! | 18, the circle | [`circle()`] |
//!
//! For any study: [`sections()`] through a volume with orientation marks, [`curves()`] and
//! [`polar_maps()`] as SVG, [`map()`] of any samples.
//!
//! [`Page`] writes `index.html`. Lengths are in cm, angles in radians; the inner membrane is vermilion and the outer one blue
//! (palette of Okabe and Ito). Results are bitwise independent of the number of threads; the functions may run concurrently.
//!
//! ```
//! use heart_study::figures::histories;
//! let newton = [18.0, 0.27, 6.6e-6, 3e-14];
//! let picture = histories("‖F‖", Some(1e-10), &[("Newton", &newton)])?;
//! assert_eq!(picture.pixel(0, 0), Some([255, 255, 255]));
//! # Ok::<(), heart_study::StudyError>(())
//! ```

mod bodies;
mod canvas;
mod check;
mod circle;
mod convergence;
mod curves;
mod forces;
mod images;
mod isosurface;
mod marks;
mod page;
mod picture;
mod polar;
mod raster;
mod render;
mod sections;
mod shapes;
mod style;
mod surface;
mod wall;
mod wall_mesh;

pub use bodies::{bodies, poses};
pub use circle::{CircleStudy, circle};
pub use convergence::histories;
pub(crate) use curves::SIZE as CURVES_SIZE;
pub use curves::curves;
pub use forces::{ForceFrame, force_frames};
pub use images::{Projection, Volume, projections, slices};
pub use isosurface::{IsoView, isosurface};
pub use page::Page;
pub(crate) use page::Table;
pub use picture::Picture;
pub use polar::polar_maps;
pub use render::View;
pub use sections::{Cut, map, sections};
pub use shapes::{Shape, shapes};
pub(crate) use surface::trilinear;
pub use wall_mesh::{WallState, wall_meshes};
