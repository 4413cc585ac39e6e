//! Solids of revolution: exact chords, exact measures, coverage voxels and meshes from a meridian.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//! Rotation of a meridian r(x) >= 0 (cm, x along the axis from base to apex) about the axis makes a solid. For a line with unit
//! direction d the distance R from the axis and the axial coordinate x are
//!
#![doc = include_str!("../img/equations.html")]
//!
//! in the coordinates (w, q) of the line: each crossing of a cone `r = r0 + m (x - x0)` is the root of a quadratic in t. The chord
//! (cm) is the signed sum of the lengths of the line in the convex solids under the parts of the meridian with concave r. V is the
//! volume (cm^3), S the surface (cm^2). The coverage of a voxel is the fraction of its volume inside the solid.
//!
//! # Conventions
//! Centimetres and radians. Body frame: x along the axis; lab frame: [`Pose`]. The centre of bin, row or voxel k of n is at
//! `(k - (n-1)/2) * pitch + offset`. Images are indexed `[row][bin]`, volumes `[z][y][x]`, the last index is the fastest. Results are
//! bitwise independent of the number of threads. Batch calls return counters of performed and skipped work.
//!
//! A ray along the surface is the limit of rays beside it, for any pose and view: along a plane face (a base, a step) the limit
//! from further up the axis, so that a ray in the plane of the base is inside the body and a ray in the plane of the other end is
//! outside; along a cone or a cylinder the limit from larger radii; along a side of a [`Sector`] the limit from larger azimuths. A
//! ray is along the surface if it is to within 1e-14 of the sizes of body, pose and rays.
//!
#![doc = include_str!("../img/pose.svg")]
//!
//! # Accuracy
//! Chords, distances and measures of a polyline are accurate to rounding (1e-12 for well-conditioned chords; a grazing chord is the
//! square root of a difference and has half the digits). A smooth meridian is a polyline within the given tolerance. The coverage
//! of a voxel crossed by one nearly flat part of the surface is computed from a plane and a correction, with an error estimate.
//! Other voxels, and all voxels at a fine tolerance, use exact areas of cross-sections, integrated between their singular points:
//! about five times the cost for three more digits. Voxels may have any shape. A voxel more than twice as long as wide is bisected
//! near the surface, down to a 128th of the solid: a grid costs as much as cubes with the shortest side of its voxels, plus one
//! test per bisection.
//!
//! # Limits
//! No scattering, no noise, attenuation by uniform media only, solids of revolution only, no files except meshes.
//!
//! # References
//! Plane through a box: Scardovelli and Zaleski, J. Comput. Phys. 164 (2000) 228, <https://doi.org/10.1006/jcph.2000.6567>.
//! The bodies of the heart phantom: Rohmer, Sitek and Gullberg 2006 (hal-03929238).

mod counters;
mod error;
mod images;
mod rays;
mod sample;
mod solid;
mod voxels;
mod wall;

pub use counters::{RayCounters, VoxelCounters};
pub use error::RevolveError;
pub use images::depth::DepthResponse;
pub use images::image::{Image, View};
pub use images::kernel::BinValue;
pub use images::plane::RayPlane;
pub use nalgebra;
pub use rays::assembly::{Assembly, RayPart, Shown};
pub use rays::capsule::Capsule;
pub use rays::cylinder::EllipticCylinder;
pub use rays::detector::{ParallelDetector, ParallelRays};
pub use rays::lines::{Lines, PointRaster};
pub use rays::organ::{Ellipsoid, Organ, OrganShape, Organs};
pub use rays::raster::Rays;
pub use rays::ray::{Hit, Ray, Span};
pub use sample::Sample;
pub use solid::body::Body;
pub use solid::curve::{Curve, CurvePoint};
pub use solid::measures::Measures;
pub use solid::meridian::Meridian;
pub use solid::mesh::Mesh;
pub use solid::pieces::Piece;
pub use solid::pose::Pose;
pub use voxels::coverage::Sampling;
pub use voxels::grid::VoxelGrid;
pub use voxels::mask::Mask;
pub use voxels::profile::Profile;
pub use voxels::regions::RegionVolumes;
pub use voxels::sweep::Sweep;
pub use voxels::weighted_body::WeightedBody;
pub use wall::nearest::NearestMaterial;
pub use wall::sector::Sector;
pub use wall::shell::Shell;
pub use wall::thickness::Thickness;
