//! Solids of revolution from a meridian: exact chords, exact volumes and areas, partial-volume voxelisation and meshes.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//! A meridian r(x) >= 0 (cm, x along the axis from base to apex) is revolved about the axis. For a line with unit direction d, the
//! distance R of its point t from the axis and the axial coordinate x of this point are
//!
#![doc = include_str!("../img/equations.html")]
//!
//! where t is the coordinate along the line, and (w, q) is the position of the line in the plane perpendicular to d; |q| is the distance
//! between the line and the axis. Each crossing of a cone `r = r0 + m (x - x0)` is the root of a quadratic in t. The meridian is divided into
//! parts on which r is concave. Each part bounds a convex solid of revolution; the chord (cm) is the signed sum of the intersection lengths
//! with these solids. V is the volume (cm^3), S the surface area (cm^2).
//!
//! # Conventions
//! Lengths are in centimetres, angles in radians. Body frame: x along the axis; lab frame: [`Pose`]. The centre of bin, row or voxel k of
//! n is at `(k - (n-1)/2) * pitch + offset`. Images are indexed `[row][bin]`, volumes `[z][y][x]`; the last index is the fastest. Results
//! are bitwise identical for any number of threads. Batch calls return counters of performed and skipped work.
//!
//! The chord of a ray in the surface is a one-sided limit, for any pose and view. In a plane face (a base, a step) it is the limit from
//! larger x: a ray in the plane of the base is inside the body, a ray in the plane of the other end is outside. Along a cone or a
//! cylinder it is the limit from larger radii, in a side of a [`Sector`] that from larger azimuths. A ray is in the surface if its
//! distance is below 1e-14 of the largest coordinate of body, pose and rays.
//!
#![doc = include_str!("../img/pose.svg")]
//!
//! # Accuracy
//! Chords, distances, volumes and areas of a polyline are accurate to rounding error (1e-12 for well-conditioned chords; a grazing chord is
//! the square root of a difference and has half the digits). A smooth meridian is approximated by a polyline to the given tolerance; the
//! chords of the polyline then differ from those of the curve, near the silhouette by the square root of the tolerance
//! ([`Meridian::smooth`]).
//! The coverage of a voxel is the fraction of its volume inside the solid. If one nearly flat part of the surface crosses a voxel, its coverage
//! is computed from a plane and a correction, with an error estimate. In other voxels, and in all voxels at a fine
//! tolerance, exact areas of cross-sections are integrated over the intervals on which they are smooth; three more digits cost about five times as much. Voxels may have any
//! aspect ratio. Voxels with an aspect ratio above 2 are bisected near the surface; the cost is that of cubes with the shortest voxel edge.
//!
//! # Limits
//! No scatter, no noise, attenuation by uniform media only, no files except meshes; solids of revolution, elliptic cylinders and ellipsoids only.
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
pub use images::{
    depth::DepthResponse,
    image::{Image, View},
    kernel::BinValue,
};
pub use nalgebra;
pub use rays::{
    assembly::{Assembly, Shown},
    detector::ParallelDetector,
    lines::Lines,
    organ::{Organ, OrganShape, Organs},
    points::PointRaster,
    ray::{Hit, Ray, Span},
};
pub use sample::Sample;
pub use solid::{
    body::Body,
    curve::{Curve, CurvePoint},
    mass_properties::MassProperties,
    meridian::Meridian,
    mesh::Mesh,
    pieces::Piece,
    pose::Pose,
};
pub use voxels::{
    grid::VoxelGrid, mask::Mask, profile::Profile, regions::RegionVolumes, sweep::Sweep,
};
pub use wall::{sector::Sector, shell::Shell, thickness::Thickness, twist::WallTwist};
