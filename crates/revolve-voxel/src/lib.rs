//! Solids of revolution: exact chords, exact measures, coverage voxels, meshes.
//!
//! Under construction; see the items below.

mod body;
mod chains;
mod chord;
mod counters;
mod coverage;
mod detector;
mod distance;
mod error;
mod field;
mod grid;
mod mask;
mod measures;
mod meridian;
mod mesh;
mod pieces;
mod plane_clip;
mod pose;
mod ray;
mod regions;
mod sample;
mod self_crossing;
mod shadow;

pub use body::Body;
pub use counters::{RayCounters, VoxelCounters};
pub use coverage::Sampling;
pub use detector::{ParallelDetector, ParallelRays};
pub use error::Error;
pub use grid::VoxelGrid;
pub use mask::Mask;
pub use measures::Measures;
pub use meridian::Meridian;
pub use mesh::Mesh;
pub use nalgebra;
pub use pieces::Piece;
pub use pose::Pose;
pub use ray::{Hit, Ray, Span};
pub use regions::RegionVolumes;
pub use sample::Sample;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct ReadmeDoctests;
