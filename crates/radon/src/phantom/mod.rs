//! Analytic objects: sums of shapes with exact images and exact sinograms, the oracle for everything else.

mod gaussian;
mod phantom2;
mod phantom3;
mod polygon;
mod round;
mod shape2;
mod shape3;
mod shepp_logan;

use crate::error::{RadonError, positive, within};

pub use phantom2::Phantom2;
pub use phantom3::Phantom3;
pub use shape2::Shape2;
pub use shape3::Shape3;

/// What a sinogram sample is of an object: a line integral or its mean over the bin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BinSampling {
    /// The integral along the ray through the bin's centre.
    #[default]
    Centre,
    /// The mean of the line integrals over the whole bin, as a detector measures it.
    Mean,
}

/// Positions and sizes of shapes go up to here, and sizes down to one over it: products of six of them are numbers.
const LARGEST: f64 = 1e50;

fn place(what: &'static str, given: f64) -> Result<(), RadonError> {
    within(what, given, -LARGEST, LARGEST)
}

fn size(what: &'static str, given: f64) -> Result<(), RadonError> {
    within(what, positive(what, given)?, 1.0 / LARGEST, LARGEST)
}
