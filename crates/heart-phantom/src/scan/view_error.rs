//! Estimates of the errors of samples.

use super::levels::Interpolation;
use super::nodes::Nodes;
use revolve_voxel::RayCounters;
use std::collections::BTreeSet;

/// Number of samples that are skipped together if a shape is absent from them.
pub(super) const PIECE: usize = 64;
/// If the difference between two time rules consists of this many samples, it determines the error of the finer rule to a factor of two.
const FEW: f64 = 5.0;
/// The error of interpolation by a polynomial through all levels of volume, relative to the difference from that through every second one. Behind a
/// response it falls exponentially.
const POLYNOMIAL: f64 = 0.35;
/// Rounding of sums of `f32`, relative to the largest sample.
const ROUNDING: f64 = 5e-7;

/// Estimates of the errors of the samples of an acquisition. Tests use their sum as a bound in random scenes. The term `scatter` is statistical.
///
/// Each term is `max |sample - exact sample| / max |sample|`, both maxima over all samples of the views that it is given for, before noise. The exact
/// sample is the average over time and over the bin (with [`BinSample::Centres`](crate::BinSample::Centres), the value at its centre) of the
/// blurred, attenuated image.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ViewError {
    /// Quadrature over time, from the largest difference between the rule and that with half the nodes. For line integrals, whose order is 3/2,
    /// this difference is 1.8 times the error. The term is also at least the difference for rays through a sphere that has the volume of
    /// the cavity and moves with respiration, and twice their error, with respiration four times. Behind a response the error decreases
    /// exponentially with the number of nodes, and the term is 0.35 of the difference.
    pub time: f64,
    /// Response and averages over bins: from the largest difference between this resolution and a neighbouring one, over several views at
    /// end-systole and end-diastole, and from the corners of the meridian ([`View::corner_error`](revolve_voxel::View::corner_error)). Zero for line
    /// integrals, which are exact.
    pub bins: f64,
    /// Scatter: four times the largest standard error of the photon histories, and an estimate of the interpolation between nodes and
    /// between views. It is statistical: of bins with that standard error, 6 in 100 000 have a larger random error.
    pub scatter: f64,
    /// Omitted or interpolated weights, and rounding of sums in single precision.
    pub truncation: f64,
}

impl ViewError {
    /// The sum of all terms: the estimated largest error of a sample, relative to the largest one.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.time + self.bins + self.scatter + self.truncation
    }
}

impl serde::Serialize for ViewError {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = to.serialize_map(Some(5))?;
        for (term, value) in [
            ("time", self.time),
            ("bins", self.bins),
            ("scatter", self.scatter),
            ("truncation", self.truncation),
            ("total", self.total()),
        ] {
            map.serialize_entry(term, &value)?;
        }
        map.end()
    }
}

/// The errors of one view, absolute.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    /// Largest sample.
    pub(super) largest: f64,
    /// Largest difference from the time rule with half the points; sums of the squares and of the fourth powers of the differences.
    pub(super) time: f64,
    second: f64,
    fourth: f64,
    /// Largest line integral.
    pub(super) line: f64,
}

impl Errors {
    /// Adds the sums of both halves of the rule to `even`, and their differences to the errors.
    pub(super) fn add_halves(&mut self, even: &mut [f32], odd: &[f32]) {
        for (even, odd) in even.chunks_mut(PIECE).zip(odd.chunks(PIECE)) {
            // Far from the heart both are zero.
            if odd.iter().chain(&*even).all(|sample| *sample == 0.0) {
                continue;
            }
            for (even, odd) in even.iter_mut().zip(odd) {
                let difference = f64::from(odd - *even);
                let square = difference * difference;
                self.time = self.time.max(difference.abs());
                self.second += square;
                self.fourth += square * square;
                *even += odd;
            }
        }
    }

    /// Adds complete samples.
    pub(super) fn add_samples(&mut self, samples: &[f32]) {
        // The bits of finite magnitudes are ordered like these, and their maximum is found several at a time.
        let bits = samples.iter().map(|sample| sample.abs().to_bits());
        let largest = f32::from_bits(bits.max().unwrap_or(0));
        self.largest = self.largest.max(f64::from(largest));
    }

    fn join(self, other: &Self) -> Self {
        Self {
            largest: self.largest.max(other.largest),
            time: self.time.max(other.time),
            second: self.second + other.second,
            fourth: self.fourth + other.fourth,
            line: self.line.max(other.line),
        }
    }
}

/// Sums over views.
#[derive(Default)]
pub(crate) struct Total {
    pub(super) rays: RayCounters,
    errors: Errors,
    /// Lists of points, and the sum of their squared errors of the mean volume.
    plans: usize,
    volume: f64,
    /// The largest error for rays through a sphere.
    sphere: f64,
    averaged: bool,
    pub(super) gains: BTreeSet<u64>,
}

impl Total {
    pub(super) fn plan(&mut self, plan: &Nodes, sphere: f64) {
        self.plans += 1;
        self.volume += plan.volume_error.powi(2);
        self.sphere = self.sphere.max(sphere);
        self.averaged |= plan.nodes.len() > 1 || plan.nodes.iter().any(|n| n.weights[1] != 0.0);
        self.gains.extend(plan.gains().map(f64::to_bits));
    }

    pub(super) fn view(&mut self, errors: &Errors) {
        self.errors = self.errors.join(errors);
    }

    /// The error relative to the largest sample; the errors of images and of omitted weights are known beforehand.
    pub(super) fn view_error(
        &self,
        interpolation: Interpolation,
        [bins, tails]: [f64; 2],
    ) -> ViewError {
        let errors = &self.errors;
        if errors.largest == 0.0 {
            return ViewError::default();
        }
        let of = |error: f64| error / errors.largest;
        let volume = (self.volume / self.plans as f64).sqrt();
        // 1 if a single sample makes up the whole difference, 1 / n for n equal samples.
        let few = match errors.second > 0.0 {
            true => errors.fourth / errors.second.powi(2),
            false => 0.0,
        };
        ViewError {
            time: match (self.averaged, interpolation) {
                (true, Interpolation::Linear) => ((1.0 + FEW * few) * of(errors.time))
                    .max(volume)
                    .max(self.sphere),
                (true, Interpolation::Polynomial) => {
                    (POLYNOMIAL * (1.0 + FEW * few) * of(errors.time)).max(volume)
                }
                (false, _) => 0.0,
            },
            bins,
            scatter: 0.0,
            truncation: ROUNDING + tails * of(errors.line),
        }
    }
}
