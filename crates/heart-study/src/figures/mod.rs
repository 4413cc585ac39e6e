//! Figures of the study: every figure of Rohmer et al. 2006 (hal-03929238) as a PNG, from plain data.
//!
//! Each function draws in memory and returns a [`Picture`]; the font (DejaVu Sans, with its licence) is included.
//!
//! | figure of the paper | function |
//! | --- | --- |
//! | 8, shapes by pressure | [`shapes()`] |
//! | 9, forces on the moving membrane | [`force_frames`] |
//! | 10, norm by iteration; Newton's residuals | [`histories`] |
//! | 11, the wall's mesh | [`wall_meshes`] |
//! | 12, the body, reference and dilated | [`bodies()`] |
//! | 13, the pose | [`poses`] |
//! | 14, projections | [`projection`], [`images()`] |
//! | 15 to 17, reconstructions | [`slice()`], [`images()`], [`isosurface()`] |
//! | 18, the circle | [`circle()`] |
//!
//! For any study: [`sections()`] through a volume with orientation marks, [`curves()`] and
//! [`polar_maps()`] as SVG, [`map()`] of any samples.
//!
//! Lengths are in cm, angles in radians; the inner membrane is vermilion and the outer one blue
//! (palette of Okabe and Ito). Results are bitwise independent of the number of threads; the functions may run concurrently.

mod bodies;
mod canvas;
mod circle;
mod convergence;
mod curves;
mod forces;
mod images;
mod isosurface;
mod marks;
mod picture;
mod polar;
mod raster;
mod render;
mod sections;
mod shapes;
mod style;
mod surface;
mod volume;
mod wall;
mod wall_mesh;

pub(crate) use bodies::{bodies, poses};
pub(crate) use circle::{CircleStudy, circle};
pub(crate) use convergence::histories;
pub(crate) use curves::SIZE as CURVES_SIZE;
pub(crate) use curves::curves;
pub(crate) use forces::{ForceFrame, force_frames};
pub(crate) use images::{images, projection, slice};
pub(crate) use isosurface::{IsoView, isosurface};
pub(crate) use picture::Picture;
pub(crate) use polar::polar_maps;
pub(crate) use render::View;
pub(crate) use sections::{Cut, map, sections, window};
pub(crate) use shapes::{Shape, shapes};
pub(crate) use volume::{Volume, edges};
pub(crate) use wall_mesh::{WallState, wall_meshes};

#[cfg(test)]
#[path = "../../tests/figures/mod.rs"]
mod tests;
