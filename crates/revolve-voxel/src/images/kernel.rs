//! Weights of the bins for content at one position.

use std::ops::Range;
use std::sync::OnceLock;

use crate::images::rule::gauss;

/// Standard deviations at which a Gaussian ends; the fraction beyond is 1.2e-7 per axis.
pub(super) const REACH: f64 = 5.3;
/// Positions per standard deviation at which weights are tabulated: the cubic between them is exact to 1e-6 of the peak.
const STEPS: f64 = 16.0;
/// Most positions per bin.
const MOST_STEPS: f64 = 128.0;
/// Most bins on either side of a tabulated one: the larger of a number and a multiple of the bins of the detector.
const MOST_REACH: [f64; 2] = [1024.0, 4.0];
/// Bins narrower than this in standard deviations have the average of their centre, to 4e-8 of the peak. Differences of the normal
/// distribution would lose digits.
const THIN: f64 = 1e-3;
/// Steps per standard deviation of the table of the normal distribution.
const FINE: usize = 32;

/// The definition of a sample of the blurred image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BinValue {
    /// Its average over the area of the bin.
    Average,
    /// Its value at the centre of the bin.
    Centre,
}

/// The bins, or rows, along one axis of a detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub(super) n: usize,
    pub(super) pitch: f64,
    pub(super) value: BinValue,
}

impl Axis {
    /// Returns those of the bins and of the rows.
    pub(super) fn both(counts: [usize; 2], pitch: [f64; 2], value: BinValue) -> [Self; 2] {
        [0, 1].map(|k| Self {
            n: counts[k],
            pitch: pitch[k],
            value,
        })
    }

    /// Returns the lower edge of a bin; that of bin n is the end of the detector.
    pub(super) fn edge(&self, bin: usize) -> f64 {
        (bin as f64 - 0.5 * self.n as f64) * self.pitch
    }

    /// Returns the position of x in units of bins: bin k reaches from k to k + 1.
    #[inline(always)]
    fn place(&self, x: f64) -> f64 {
        x / self.pitch + 0.5 * self.n as f64
    }

    /// Returns the weight per cm of the bin that begins `from` after the content, in units of bins.
    fn weight(&self, from: f64, sigma: f64) -> f64 {
        if sigma == 0.0 {
            return f64::from(u8::from(-1.0 < from && from <= 0.0)) / self.pitch;
        }
        let z = |x: f64| x * self.pitch / sigma;
        match self.value {
            BinValue::Average if self.pitch >= THIN * sigma => {
                let normal = Normal::get();
                (normal.up_to(z(from + 1.0)) - normal.up_to(z(from))) / self.pitch
            }
            BinValue::Average | BinValue::Centre => {
                (-0.5 * z(from + 0.5).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt())
            }
        }
    }
}

/// Weights of the bins around content of one standard deviation, as a function of its position in a bin: cubic interpolation between
/// positions a fraction of the standard deviation apart, or computed for each position where that would need too many positions or bins.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Weights {
    axis: Axis,
    sigma: f64,
    /// Bins on either side of the content's own.
    reach: usize,
    /// Positions per bin; 0 without a table.
    steps: usize,
    /// `[position][bin]` from one position before a bin to two after it.
    table: Vec<f64>,
}

impl Weights {
    pub(super) fn new(axis: Axis, sigma: f64) -> Self {
        let [reach, steps] = Self::sizes(axis, sigma);
        let mut made = Self {
            axis,
            sigma,
            reach,
            steps,
            table: Vec::new(),
        };
        if steps > 0 {
            for k in 0..steps + 3 {
                let at = (k as f64 - 1.0) / steps as f64;
                let weight = |bin: usize| axis.weight(bin as f64 - reach as f64 - at, sigma);
                made.table.extend((0..=2 * reach).map(weight));
            }
        }
        made
    }

    /// Returns the bins on either side and the positions per bin.
    fn sizes(axis: Axis, sigma: f64) -> [usize; 2] {
        let reach = (REACH * sigma / axis.pitch).ceil();
        let steps = (STEPS * axis.pitch / sigma).ceil();
        let most = MOST_REACH[0].max(MOST_REACH[1] * axis.n as f64);
        let is_tabulated = steps <= MOST_STEPS && reach <= most;
        let steps = if is_tabulated { steps.max(1.0) } else { 0.0 };
        // Indices of bins are exact numbers up to 2^53.
        [reach.min(2f64.powi(53)) as usize, steps as usize]
    }

    /// Returns the bytes of the table.
    pub(super) fn bytes(axis: Axis, sigma: f64) -> usize {
        match Self::sizes(axis, sigma) {
            [_, 0] => 0,
            [reach, steps] => size_of::<f64>() * (steps + 3) * (2 * reach + 1),
        }
    }

    /// Returns the range of bins that content at `at` reaches.
    pub(super) fn bins(&self, at: f64) -> Range<usize> {
        let own = self.axis.place(at).floor();
        let clamp = |bin: f64| bin.clamp(0.0, self.axis.n as f64) as usize;
        let reach = self.reach as f64;
        clamp(own - reach)..clamp(own + reach + 1.0)
    }

    /// Adds `amount` times the weights of the bins for content at `at` to `sums`, which begin at bin `first`; bins beyond them are omitted.
    #[inline(always)]
    pub(super) fn add(&self, at: f64, amount: f64, first: usize, sums: &mut [f64]) {
        let place = self.axis.place(at);
        let own = place.floor();
        // Index of the bin before which the reach begins.
        let begin = (own as isize).saturating_sub(self.reach as isize);
        let width = 2 * self.reach + 1;
        let skip = (first as isize)
            .saturating_sub(begin)
            .clamp(0, width as isize) as usize;
        let start = (begin + skip as isize - first as isize).max(0) as usize;
        let Some(sums) = sums.get_mut(start..) else {
            return;
        };
        let n = sums.len().min(width - skip);
        let sums = &mut sums[..n];
        if self.steps == 0 {
            for (k, sum) in sums.iter_mut().enumerate() {
                let from = (begin + (skip + k) as isize) as f64 - place;
                *sum += amount * self.axis.weight(from, self.sigma);
            }
            return;
        }
        let position = (place - own) * self.steps as f64;
        let cell = (position as usize).min(self.steps - 1);
        let t = position - cell as f64;
        // Lagrange's cubic through the positions -1, 0, 1 and 2.
        let parts = [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            0.5 * (t + 1.0) * (t - 1.0) * (t - 2.0),
            -0.5 * (t + 1.0) * t * (t - 2.0),
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ]
        .map(|part| amount * part);
        let row = |k: usize| &self.table[(cell + k) * width + skip..][..n];
        let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
        for k in 0..n {
            sums[k] += parts[0] * a[k] + parts[1] * b[k] + parts[2] * c[k] + parts[3] * d[k];
        }
    }
}

/// The normal distribution by cubic interpolation in a table, to 3e-9.
struct Normal {
    /// Integral from 0, and density times the step.
    table: Vec<[f64; 2]>,
}

impl Normal {
    fn get() -> &'static Self {
        static NORMAL: OnceLock<Normal> = OnceLock::new();
        NORMAL.get_or_init(|| {
            let step = 1.0 / FINE as f64;
            let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
            let mut sum = 0.0;
            let entry = |k: usize| {
                let x = k as f64 * step;
                let entry = [sum, density(x) * step];
                let part = gauss(12)
                    .iter()
                    .map(|[y, w]| 0.5 * step * w * density(x + 0.5 * step * (1.0 + y)));
                sum += part.sum::<f64>();
                entry
            };
            Self {
                table: (0..=8 * FINE).map(entry).collect(),
            }
        })
    }

    /// Returns the integral of the density from 0 to x.
    #[inline(always)]
    fn up_to(&self, x: f64) -> f64 {
        let place = x.abs() * FINE as f64;
        let k = place as usize;
        let Some([[a, da], [b, db]]) = self.table.get(k..k + 2).and_then(|pair| pair.first_chunk())
        else {
            return 0.5f64.copysign(x);
        };
        let t = place - k as f64;
        let (rise, left) = (b - a, 1.0 - t);
        // Hermite's cubic.
        let value = a + rise * t * t * (3.0 - 2.0 * t) + t * left * (da * left - db * t);
        value.copysign(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One bin, and a response of up to 1e12 times its width.
    #[test]
    fn weights_of_a_wide_response_have_a_bounded_table() {
        for value in [BinValue::Average, BinValue::Centre] {
            for (pitch, sigma) in [(1e-3, 0.1), (1e-3, 76.4), (1e-6, 425.0), (1e-6, 1e6)] {
                let axis = Axis { n: 1, pitch, value };
                let weights = Weights::new(axis, sigma);
                let bytes = size_of::<f64>() * weights.table.len();
                assert_eq!(bytes, Weights::bytes(axis, sigma));
                assert!(bytes < 100_000, "{pitch} {sigma}: {bytes}");
                for z in [0.0f64, -1.3, 4.0, 5.0] {
                    let mut sums = [0.0];
                    weights.add(z * sigma, sigma, 0, &mut sums);
                    let exact = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
                    // The curvature over a bin, (pitch / sigma)^2 / 24, and the interpolation between positions.
                    assert!(
                        (sums[0] - exact).abs() < 4e-6,
                        "{sigma} {z}: {sums:?} {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_response_of_no_width_has_one_bin() {
        let (n, pitch, value) = (4, 0.5, BinValue::Average);
        let sharp = Weights::new(Axis { n, pitch, value }, 0.0);
        let mut sums = vec![0.0; 4];
        sharp.add(0.25, 3.0, 0, &mut sums);
        assert_eq!(sums, [0.0, 0.0, 6.0, 0.0]);
    }
}
