//! Solids of revolution: exact chords, exact measures, coverage voxels and meshes from a meridian.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//! A meridian r(x) >= 0 (cm, x along the axis from base to apex) turned about the axis bounds a solid. Of a line with unit
//! direction d the distance R from the axis and the axial coordinate x are
//!
#![doc = include_str!("../img/equations.html")]
//!
//! in coordinates (w, q) of its own: on a cone `r = r0 + m (x - x0)` each crossing is the root of a quadratic in t. The chord
//! (cm) is the signed sum, over stretches of the meridian with concave r, of the line's length in the convex solid under each.
//! V is the volume (cm^3), S the surface (cm^2). A voxel's coverage is the fraction of
//! its volume inside the solid.
//!
//! # Conventions
//! Centimetres and radians. Body frame: x along the axis; lab frame: [`Pose`]. Bin, row and voxel k of n have their centres at
//! `(k - (n-1)/2) * pitch + offset`. Images are indexed `[row][bin]`, volumes `[z][y][x]`, the last fastest. Results are the
//! same, bit for bit, for any number of threads. Batch calls return counters of what they did and skipped.
//!
//! A ray along the surface counts as one just beside it, for any pose and view: along a plane face (a base, a step) as one
//! further up the axis, so that a ray in the plane of the base sees the base and one in that of a face at the other end
//! nothing; along a cone or a cylinder as one farther from the axis; along a side of a [`Sector`] as one at a larger azimuth.
//! Along the surface is what is so to 1e-14 of the sizes of body, pose and rays.
//!
#![doc = include_str!("../img/pose.svg")]
//!
//! # Accuracy
//! Chords, distances and measures of a polyline are right to rounding (1e-12 where the chord is well-conditioned; a grazing
//! chord is the root of a difference and has half the digits). A smooth meridian is a polyline within the tolerance that was
//! asked for. A voxel that one gentle patch of surface crosses has its coverage from a plane and what the surface differs
//! from it, with an estimate of the error; any other, and any at a fine tolerance, from the exact areas of its sections
//! across the axis, integrated between the places where they are not smooth: some five times the work for three more digits.
//! Voxels may be of any shape. One more than twice as long as wide is halved where the surface is near, down to a 128th of the
//! solid: all of a grid costs what cubes of its voxels' shortest side would, and a look more for each time an edge is halved.
//!
//! # What it is not
//! No scattering or noise; no attenuation but by uniform media; no solids but those of revolution; no files but meshes.
//!
//! # References
//! Plane through a box: Scardovelli and Zaleski, J. Comput. Phys. 164 (2000) 228, <https://doi.org/10.1006/jcph.2000.6567>.
//! The bodies of the heart phantom: Rohmer, Sitek and Gullberg 2006 (hal-03929238).

mod counters;
mod error;
mod rays;
mod sample;
mod solid;
mod voxels;
mod wall;

pub use counters::{RayCounters, VoxelCounters};
pub use error::RevolveError;
pub use nalgebra;
pub use rays::attenuation::{Attenuator, Medium};
pub use rays::capsule::Capsule;
pub use rays::cylinder::EllipticCylinder;
pub use rays::detector::{ParallelDetector, ParallelRays};
pub use rays::organ::{Ellipsoid, Organ, OrganShape, Organs};
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
pub use voxels::moment::Moment;
pub use voxels::profile::Profile;
pub use voxels::regions::RegionVolumes;
pub use voxels::sweep::Sweep;
pub use wall::nearest::NearestMaterial;
pub use wall::sector::Sector;
pub use wall::shell::Shell;
pub use wall::thickness::Thickness;
