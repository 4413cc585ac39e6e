//! Filtering of detector rows: pad, real FFT, response, inverse FFT (up-sampled or not).

use std::sync::Arc;

use realfft::{ComplexToReal, RealToComplex};
use rustfft::num_complex::Complex;

use crate::error::RadonError;
use crate::fbp::options::{EdgePolicy, FbpOptions};
use crate::filter::{padded_len, ramp_response};
use crate::iterative::check_samples;
use crate::sample::Sample;

/// A row filter. The result of a row depends only on that row, so skipping others leaves it bitwise identical.
#[derive(Clone)]
pub(crate) struct RowFilter<T: Sample> {
    n_bins: usize,
    upsampling: usize,
    ramp: bool,
    edge: EdgePolicy,
    forward: Arc<dyn RealToComplex<T>>,
    inverse: Arc<dyn ComplexToReal<T>>,
    response: Vec<T>,
}

/// Work arrays of one thread.
pub(crate) struct RowScratch<T: Sample> {
    row: Vec<T>,
    spectrum: Vec<Complex<T>>,
    fine_spectrum: Vec<Complex<T>>,
    fine: Vec<T>,
    fft: Vec<Complex<T>>,
    /// Filtered rows of `TOGETHER` slices.
    filtered: Vec<T>,
}

/// Slices whose rows are filtered before they are interleaved.
pub(crate) const TOGETHER: usize = 16;

impl<T: Sample> RowFilter<T> {
    pub(crate) fn new(n_bins: usize, options: &FbpOptions) -> Result<Self, RadonError> {
        // Twice the row makes the convolution linear; a row that is extended at both ends needs room for the extension, too.
        let len = padded_len(match options.edge {
            EdgePolicy::Zero => 2 * n_bins,
            EdgePolicy::Ellipse => 4 * n_bins,
        })?;
        let upsampling = options.interpolation.upsampling();
        let (forward, inverse) = T::real(len, len * upsampling);
        let mut response = ramp_response(&options.window, options.cutoff, len)?;
        if !options.ramp {
            response.fill(1.0);
        }
        if upsampling > 1 {
            // The Nyquist term counts twice in the longer spectrum.
            response[len / 2] /= 2.0;
        }
        let response = response.iter().map(|&r| T::of(r / len as f64));
        let response: Vec<T> = response.collect();
        check_samples("the response of the filter", &response)?;
        Ok(Self {
            n_bins,
            upsampling,
            ramp: options.ramp,
            edge: options.edge,
            forward,
            inverse,
            response,
        })
    }

    /// Returns the number of samples of a filtered row.
    pub(crate) fn out_len(&self) -> usize {
        self.n_bins * self.upsampling
    }

    /// Returns the bytes of one thread's work arrays.
    pub(crate) fn scratch_bytes(&self) -> usize {
        let spectrum = self.forward.complex_len()
            + if self.upsampling > 1 {
                self.inverse.complex_len()
            } else {
                0
            };
        let fft = self
            .forward
            .get_scratch_len()
            .max(self.inverse.get_scratch_len());
        let rows = self.forward.len() + self.inverse.len() + TOGETHER * self.out_len();
        (rows + 2 * (spectrum + fft)) * size_of::<T>()
    }

    pub(crate) fn scratch(&self) -> RowScratch<T> {
        RowScratch {
            row: self.forward.make_input_vec(),
            spectrum: self.forward.make_output_vec(),
            fine_spectrum: if self.upsampling > 1 {
                self.inverse.make_input_vec()
            } else {
                Vec::new()
            },
            fine: self.inverse.make_output_vec(),
            fft: vec![
                Complex::default();
                self.forward
                    .get_scratch_len()
                    .max(self.inverse.get_scratch_len())
            ],
            filtered: vec![T::ZERO; TOGETHER * self.out_len()],
        }
    }

    /// Returns the filtered rows times the pitch (without a ramp the rows themselves) and `scale`, `out_len()` samples each;
    /// rows of zeros are not transformed.
    pub(crate) fn filter<'a>(
        &self,
        rows: impl Iterator<Item = &'a [T]>,
        scale: T,
        scratch: &'a mut RowScratch<T>,
    ) -> impl Iterator<Item = &'a [T]> {
        let mut filtered = std::mem::take(&mut scratch.filtered);
        let mut n_rows = 0;
        for (out, row) in filtered.chunks_exact_mut(self.out_len()).zip(rows) {
            n_rows += 1;
            if row.iter().all(|&p| p == T::ZERO) {
                out.fill(T::ZERO);
                continue;
            }
            let filtered = match self.ramp || self.upsampling > 1 {
                true => self.filter_row(row, scratch),
                false => row,
            };
            for (out, &q) in out.iter_mut().zip(filtered) {
                *out = q * scale;
            }
        }
        scratch.filtered = filtered;
        scratch.filtered.chunks_exact(self.out_len()).take(n_rows)
    }

    fn filter_row<'a>(&self, input: &[T], scratch: &'a mut RowScratch<T>) -> &'a [T] {
        let RowScratch {
            row,
            spectrum,
            fine_spectrum,
            fine,
            fft,
            ..
        } = scratch;
        let n = self.n_bins;
        row[..n].copy_from_slice(input);
        match self.edge {
            EdgePolicy::Zero => row[n..].fill(T::ZERO),
            EdgePolicy::Ellipse => {
                row[n..].fill(T::ZERO);
                let (behind, front) = row[n..].split_at_mut(n);
                extend_by_ellipse(input.iter().rev(), behind.iter_mut());
                extend_by_ellipse(input.iter(), front.iter_mut().rev().take(n));
            }
        }
        // The transforms fail only on wrong lengths, which the planner's own vectors exclude, or on a complex value at zero frequency or
        // Nyquist, which are set real here.
        let done = self.forward.process_with_scratch(row, spectrum, fft);
        debug_assert!(done.is_ok());
        for (value, &gain) in spectrum.iter_mut().zip(&self.response) {
            value.re *= gain;
            value.im *= gain;
        }
        spectrum[0].im = T::ZERO;
        let source = if self.upsampling > 1 {
            fine_spectrum[..spectrum.len()].copy_from_slice(spectrum);
            fine_spectrum[spectrum.len()..].fill(Complex::default());
            fine_spectrum
        } else {
            let last = spectrum.len() - 1;
            spectrum[last].im = T::ZERO;
            spectrum
        };
        let done = self.inverse.process_with_scratch(source, fine, fft);
        debug_assert!(done.is_ok());
        &fine[..self.out_len()]
    }
}

/// Continues a row beyond one end by an ellipse: `inward` contains its samples from that end, `outward` as many beyond it.
///
/// The square of an ellipse's chords is a parabola. For an ellipse about the middle of the row, at the distance x from there,
///
/// ```text
/// p(x)^2 = q - c x^2,
/// ```
///
/// q and c are those of the line through the squares of the row's last eighth, as a function of x^2. If they do not fall to zero within a
/// row's length (or rise towards the end), the curvature is increased (and the rise dropped) until they do.
fn extend_by_ellipse<'a, T: Sample>(
    inward: impl ExactSizeIterator<Item = &'a T>,
    outward: impl Iterator<Item = &'a mut T>,
) {
    let n = inward.len();
    let middle = (n - 1) as f64 / 2.0;
    let last: Vec<f64> = inward.take((n / 8).max(2)).map(|p| p.f64()).collect();
    let largest = last.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    if largest == 0.0 {
        return;
    }
    // Squares with their sign, so that noise about zero averages out; in units that do not overflow.
    let points = last.iter().enumerate().map(|(i, p)| {
        let p = p / largest;
        ((middle - i as f64).powi(2), p * p.abs())
    });
    let m = last.len() as f64;
    let [x, y] = points
        .clone()
        .fold([0.0; 2], |[x, y], p| [x + p.0 / m, y + p.1 / m]);
    let [xx, xy] = points.fold([0.0; 2], |[xx, xy], p| {
        [xx + (p.0 - x).powi(2), xy + (p.0 - x) * (p.1 - y)]
    });
    let fitted = if xx > 0.0 { -xy / xx } else { 0.0 };
    let end = y + fitted * (x - middle * middle);
    if end <= 0.0 {
        return;
    }
    let slope = (-2.0 * fitted * middle).min(0.0);
    let reach = (n + 1) as f64;
    let curvature = fitted.max((end / reach + slope) / reach);
    for (t, value) in (1..).zip(outward) {
        let t = f64::from(t);
        let square = end + t * (slope - t * curvature);
        *value = T::of(largest * square.max(0.0).sqrt());
    }
}

#[cfg(test)]
mod tests {
    use super::extend_by_ellipse;

    fn extended(row: &[f64], len: usize) -> Vec<f64> {
        let mut beyond = vec![0.0; len];
        extend_by_ellipse(row.iter().rev(), beyond.iter_mut());
        beyond
    }

    #[test]
    fn an_ellipse_about_the_middle_is_continued_exactly() {
        for (n, radius) in [(40, 31.7), (41, 55.0), (64, 90.0)] {
            let chord = |k: usize| {
                let x = k as f64 - (n - 1) as f64 / 2.0;
                0.3 * (radius * radius - x * x).max(0.0_f64).sqrt()
            };
            let row: Vec<f64> = (0..n).map(chord).collect();
            for (t, value) in extended(&row, n).into_iter().enumerate() {
                // Next to the ellipse's end the square root makes 1e-7 of the fit's 1e-14.
                assert!((value - chord(n + t)).abs() < 1e-5, "{n} {t}: {value}");
            }
        }
    }

    #[test]
    fn every_end_falls_smoothly_to_zero_within_a_row() {
        // Level, rising, falling fast, a parabola the wrong way round.
        let rows: [&dyn Fn(f64) -> f64; 4] = [&|_| 2.0, &|k| 1.0 + k, &|k| 9.0 - k, &|k| {
            1.0 + (k - 4.0).powi(2)
        }];
        for row in rows {
            let row: Vec<f64> = (0..9).map(|k| row(f64::from(k))).collect();
            let beyond = extended(&row, 9);
            let mut last = row[8] * 1.2; // the fit through the last two squares and not through the end itself
            for value in &beyond {
                assert!((0.0..=last).contains(value), "{row:?} {beyond:?}");
                last = *value;
            }
            // A level end is a quarter of an ellipse that is zero one bin beyond.
            assert!(beyond[8] < 0.5 * row[8]);
        }
        // No or negative signal at the end: zero beyond.
        assert_eq!(extended(&[3.0, 2.0, 0.0, 0.0], 4), [0.0; 4]);
        assert_eq!(extended(&[3.0, 2.0, -1.0, -1.0], 4), [0.0; 4]);
    }
}
