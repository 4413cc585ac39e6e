//! Filtering of detector rows: pad, real FFT, response, inverse FFT (up-sampled or not).

use std::f64::consts::PI;
use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;

use crate::error::RadonError;
use crate::fbp::options::{EdgePolicy, FbpOptions};
use crate::filter::{padded_len, ramp_response};
use crate::sample::Sample;

/// Filters one row at a time; each row's result depends on that row alone, so skipping others changes no bit.
pub(crate) struct RowFilter<T: Sample> {
    n_bins: usize,
    upsampling: usize,
    ramp: bool,
    edge: EdgePolicy,
    forward: Arc<dyn RealToComplex<T>>,
    inverse: Arc<dyn ComplexToReal<T>>,
    response: Vec<T>,
    /// Gains of the bins beyond an end under [`EdgePolicy::Fade`].
    fade: Vec<T>,
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

/// Slices whose rows are filtered before they are written side by side.
pub(crate) const TOGETHER: usize = 16;

impl<T: Sample> RowFilter<T> {
    pub(crate) fn new(n_bins: usize, options: &FbpOptions) -> Result<Self, RadonError> {
        // Twice the row makes the convolution linear; a row that is extended at both ends needs room for that too.
        let len = padded_len(match options.edge {
            EdgePolicy::Zero => 2 * n_bins,
            EdgePolicy::Repeat | EdgePolicy::Fade => 4 * n_bins,
        });
        let upsampling = options.interpolation.upsampling();
        let mut planner = RealFftPlanner::<T>::new();
        let mut response = ramp_response(&options.window, options.cutoff, len)?;
        if !options.ramp {
            response.fill(1.0);
        }
        if upsampling > 1 {
            // The Nyquist term stands for two in the longer spectrum.
            response[len / 2] /= 2.0;
        }
        // As long as a row, which leaves the filter room at the far side of the circle.
        let fade = match options.edge {
            EdgePolicy::Fade => (1..=n_bins)
                .map(|k| T::of(0.5 + 0.5 * (PI * k as f64 / (n_bins + 1) as f64).cos()))
                .collect(),
            _ => Vec::new(),
        };
        Ok(Self {
            n_bins,
            fade,
            upsampling,
            ramp: options.ramp,
            edge: options.edge,
            forward: planner.plan_fft_forward(len),
            inverse: planner.plan_fft_inverse(len * upsampling),
            response: response.iter().map(|&r| T::of(r / len as f64)).collect(),
        })
    }

    /// Samples of a filtered row.
    pub(crate) fn out_len(&self) -> usize {
        self.n_bins * self.upsampling
    }

    /// Bytes of one thread's work arrays.
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

    /// The filtered rows times the pitch (without a ramp the rows themselves) and `scale`, `out_len()` samples each, held in the
    /// scratch; no row stands for zeros.
    pub(crate) fn filter<'a>(
        &self,
        rows: impl Iterator<Item = Option<&'a [T]>>,
        scale: T,
        scratch: &'a mut RowScratch<T>,
    ) -> impl Iterator<Item = &'a [T]> {
        let mut filtered = std::mem::take(&mut scratch.filtered);
        let mut n_rows = 0;
        for (out, row) in filtered.chunks_exact_mut(self.out_len()).zip(rows) {
            n_rows += 1;
            match row {
                None => out.fill(T::ZERO),
                Some(row) => {
                    let filtered = match self.ramp || self.upsampling > 1 {
                        true => self.filter_row(row, scratch),
                        false => row,
                    };
                    for (out, &q) in out.iter_mut().zip(filtered) {
                        *out = q * scale;
                    }
                }
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
            EdgePolicy::Repeat => {
                let middle = n + (row.len() - n) / 2;
                row[n..middle].fill(input[n - 1]);
                row[middle..].fill(input[0]);
            }
            EdgePolicy::Fade => {
                // The right end fades behind the row, the left end in front of it, which is the far end of the circle.
                let (behind, front) = row[n..].split_at_mut(self.fade.len());
                for (value, &gain) in behind.iter_mut().zip(&self.fade) {
                    *value = input[n - 1] * gain;
                }
                front.fill(T::ZERO);
                for (value, &gain) in front.iter_mut().rev().zip(&self.fade) {
                    *value = input[0] * gain;
                }
            }
        }
        // The transforms fail only on wrong lengths, which the planner's own vectors rule out, or on a complex value at
        // zero frequency or Nyquist, which are set real here.
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
