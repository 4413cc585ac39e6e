//! Counting noise of the detector.

use super::settings::{Counts, Noise};
use crate::error::{PhantomError, zeros};
use radon::{CountScale, poisson_counts_into};
use std::borrow::Cow;
use std::ops::Range;

impl Noise {
    /// Returns the expected counts per unit sample if the noise defines them; `all` returns all samples of the gate if needed.
    pub(crate) fn counts_per_unit<'a>(
        &self,
        all: impl FnOnce() -> Result<Cow<'a, [f32]>, PhantomError>,
    ) -> Result<Option<f64>, PhantomError> {
        Ok(match self.counts {
            Counts::Expected => None,
            Counts::PerUnit(counts) => Some(counts),
            Counts::Total(counts) => {
                let samples = all()?;
                if samples.iter().all(|&sample| sample == 0.0) {
                    return Err(PhantomError::NoCounts);
                }
                Some(short(CountScale::Total(counts).per_unit(&samples)?))
            }
        })
    }

    /// Draws counts and divides them by `per_unit` of each view: noisy samples in their original units. `view` is the index of the first view
    /// among all gates; `rows` are those of the samples among bins and rows of a view.
    pub(crate) fn count(
        &self,
        samples: &mut Vec<f32>,
        per_unit: &[f64],
        view: usize,
        (rows, [bins, n_rows]): (&Range<usize>, [usize; 2]),
    ) -> Result<(), PhantomError> {
        let mut counts: Vec<f32> = zeros("samples of the projections", samples.len())?;
        let len = (rows.len() * bins).max(1);
        let views = samples.chunks(len).zip(counts.chunks_mut(len));
        for (k, ((view_samples, view_counts), &per_unit)) in views.zip(per_unit).enumerate() {
            // Index of each sample among all, so that a single row has the same noise as in the whole.
            let first = ((view + k) * n_rows + rows.start) * bins;
            poisson_counts_into(view_samples, per_unit, self.seed, first as u64, view_counts)?;
            (view_counts.iter_mut()).for_each(|count| *count /= per_unit as f32);
        }
        *samples = counts;
        Ok(())
    }
}

/// Rounds to 16 significant bits. Gates that are projected together differ from single ones by the rounding of samples, which changes the sum by
/// about 1e-9: they have the same scale, and hence the same noise, unless it is that close to the middle of two such numbers.
fn short(scale: f64) -> f64 {
    let half = 1 << 36;
    f64::from_bits((scale.to_bits() + half) & !(2 * half - 1))
}
