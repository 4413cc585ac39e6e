//! Compton scatter in SPECT (parallel-hole cameras): photon histories with forced detection.
//!
#![doc = include_str!("../README.md")]

mod angles;
mod camera;
mod compton;
mod error;
mod history;
mod medium;
mod options;
mod random;
mod scatter;
mod smoothing;
mod spectrum;
mod sums;
mod voxels;

pub use camera::{Camera, Response, View};
pub use compton::Compton;
pub use error::ScatterError;
pub use medium::{Emission, Medium, Piece, Source};
pub use options::{ScatterOptions, ScatterReport};
pub use random::Random;
pub use scatter::Scatter;
pub use spectrum::{Spectrum, water_attenuation};
pub use voxels::{PointSource, VoxelMedium, VoxelSource};
