//! Analytic objects: sums of shapes with exact images and exact sinograms, used as reference solutions.

mod gaussian;
pub(crate) mod phantom2;
pub(crate) mod phantom3;
mod polygon;
mod round;
pub(crate) mod shape2;
pub(crate) mod shape3;
mod shepp_logan;

use crate::error::{RadonError, finite, positive, within};

/// The definition of a sinogram sample: a line integral or a bin average.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BinSampling {
    /// The integral along the ray through the bin's centre.
    #[default]
    Centre,
    /// The average of the line integrals over the bin, as a detector measures it.
    Mean,
}

/// A sum of shapes, each times a value: [`Phantom2`](crate::Phantom2) of plane shapes, [`Phantom3`](crate::Phantom3) of solid ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Phantom<S> {
    objects: Vec<(f64, S)>,
}

impl<S> Phantom<S> {
    /// The sum of `value * shape` over the list; where shapes overlap their values add.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`] for a value.
    pub fn new(objects: impl IntoIterator<Item = (f64, S)>) -> Result<Self, RadonError> {
        let objects: Vec<_> = objects.into_iter().collect();
        for &(value, _) in &objects {
            finite("object value", value)?;
        }
        Ok(Self { objects })
    }

    fn sum(&self, of: impl Fn(&S) -> f64) -> f64 {
        let values = self.objects.iter();
        values.map(|(value, shape)| value * of(shape)).sum()
    }
}

/// Largest position or size of a shape, and the reciprocal of the smallest size: products of six of them are finite.
const LARGEST: f64 = 1e50;

fn place(what: &'static str, given: f64) -> Result<(), RadonError> {
    within(what, given, -LARGEST, LARGEST)
}

fn size(what: &'static str, given: f64) -> Result<(), RadonError> {
    within(what, positive(what, given)?, 1.0 / LARGEST, LARGEST)
}
