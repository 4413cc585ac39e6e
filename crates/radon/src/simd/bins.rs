//! Ray sums of one slice: neighbouring bins side by side, which at the same step meet neighbouring pixels.

use std::ops::Range;

use crate::scalar::Scalar;
use crate::simd::pairs::BoxRay;
use crate::simd::vector::{RUN, Vector, WINDOW};

/// Zeros before and behind the pixels of a row: what the rays of a run that touches the image reach beyond it in a band of steps.
pub(crate) const MARGIN: usize = 64;

/// The rays of a view through one image.
#[derive(Debug)]
pub struct Bins<'a, T> {
    /// A row of pixels for each step, the first pixel behind `MARGIN` zeros; behind the last row `MARGIN + WINDOW` zeros.
    pub(crate) image: &'a [T],
    /// Distance between the rows: the pixels and the next row's margin, or more.
    pub(crate) stride: usize,
    /// Pixels of a row, margins aside.
    pub(crate) n: usize,
    /// Position of the ray of bin 0 at step 0, not snapped; position 1 is the first pixel.
    pub(crate) first: f64,
    /// What all rays have in common.
    pub(crate) ray: BoxRay<T>,
    /// Distance between the rays of neighbouring bins.
    pub(crate) per_bin: f64,
}

impl<T: Scalar> Bins<'_, T> {
    /// Samples of an image whose rows are `stride` apart.
    pub(crate) fn image_len(n_steps: usize, stride: usize) -> usize {
        n_steps * stride + MARGIN + WINDOW
    }

    /// Position of a bin's ray at step 0.
    #[inline(always)]
    pub(crate) fn offset(&self, bin: usize) -> f64 {
        self.ray.snap.of(self.first + bin as f64 * self.per_bin)
    }

    /// Samples of the row of a step from position 0 on.
    #[inline(always)]
    pub(crate) fn row(&self, m: usize) -> *const T {
        self.image[m * self.stride + (MARGIN - 1)..].as_ptr()
    }

    /// Position of a ray at a step, moved to where zeros are read if it is beyond the image.
    #[inline(always)]
    pub(crate) fn position(&self, offset: f64, shift: f64) -> f64 {
        let t = offset + shift;
        let t = if t > 0.0 { t } else { 0.0 };
        let most = (self.n + 1) as f64;
        if t < most { t } else { most }
    }

    /// Whether some ray of a run may meet the image: all positions are between those of its first and its last ray at the first
    /// and the last step.
    #[inline(always)]
    fn touches(&self, offset: &[f64; RUN], steps: &Range<usize>) -> bool {
        let (first, last) = (steps.start, steps.end - 1);
        let at = |l: usize, m: usize| offset[l] + self.ray.shift(m as f64);
        let corners = [
            at(0, first),
            at(0, last),
            at(RUN - 1, first),
            at(RUN - 1, last),
        ];
        let beyond = (self.n + 1) as f64;
        !corners.iter().all(|&t| t < 0.0) && !corners.iter().all(|&t| t > beyond)
    }
}

/// Adds steps to the sums of runs of rays at positions in floating point.
///
/// # Safety
/// The machine has the instruction set of `V`, and the image is as large as `add_bins` asks.
#[inline(always)]
pub(super) unsafe fn add_runs<T: Scalar, V: Vector<T>>(
    bins: &Bins<'_, T>,
    steps: Range<usize>,
    sums: &mut [[T; RUN]],
) {
    for (run, sums) in sums.iter_mut().enumerate() {
        let offset: [f64; RUN] = std::array::from_fn(|l| bins.offset(run * RUN + l));
        if !bins.touches(&offset, &steps) {
            continue;
        }
        // SAFETY: the caller's promise.
        let (near, far) = unsafe { sum_steps::<T, V>(bins, &offset, steps.clone()) };
        for l in 0..RUN {
            sums[l] += near[l] + far[l];
        }
    }
}

/// What the given steps contribute to the sums of a run of rays, their first pixels' part and their second ones'.
///
/// # Safety
/// As for `add_runs`.
#[inline(always)]
unsafe fn sum_steps<T: Scalar, V: Vector<T>>(
    bins: &Bins<'_, T>,
    offset: &[f64; RUN],
    steps: Range<usize>,
) -> ([T; RUN], [T; RUN]) {
    let (mut near, mut far) = ([T::ZERO; RUN], [T::ZERO; RUN]);
    for m in steps {
        let shift = bins.ray.shift(m as f64);
        let mut index = [0; RUN];
        let mut weights = ([T::ZERO; RUN], [T::ZERO; RUN]);
        for l in 0..RUN {
            let t = bins.position(offset[l], shift);
            // SAFETY: at most the pixels of a row and one, below 2^31.
            index[l] = unsafe { t.to_int_unchecked() };
            (weights.0[l], weights.1[l]) = bins.ray.weights(t - f64::from(index[l]));
        }
        // SAFETY: positions are at most n + 1, and a row has two more samples behind it.
        unsafe { add_pixels::<T, V>(bins.row(m), &index, &weights, &mut near, &mut far) };
    }
    (near, far)
}

/// Adds the weighted pixels at `index` and those behind them.
///
/// # Safety
/// The machine has the instruction set of `V`, and all those pixels are valid to read.
#[inline(always)]
pub(super) unsafe fn add_pixels<T: Scalar, V: Vector<T>>(
    row: *const T,
    index: &[i32; RUN],
    weights: &([T; RUN], [T; RUN]),
    near: &mut [T; RUN],
    far: &mut [T; RUN],
) {
    for start in (0..RUN).step_by(V::WIDTH) {
        // SAFETY: the caller's promise; all arrays are RUN long.
        unsafe {
            let index = &index[start..start + V::WIDTH];
            for (sums, weights, row) in [
                (&mut *near, &weights.0, row),
                (&mut *far, &weights.1, row.add(1)),
            ] {
                let at = sums.as_mut_ptr().add(start);
                V::load(weights.as_ptr().add(start))
                    .multiply_add(V::gather(row, index), V::load(at))
                    .store(at);
            }
        }
    }
}
