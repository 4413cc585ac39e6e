//! Ray sums of one slice: neighbouring bins side by side, which at the same step meet neighbouring pixels.

use std::ops::Range;

use crate::sample::Sample;
use crate::simd::InstructionSet;
use crate::simd::pairs::BoxRay;
use crate::simd::vector::{RUN, Vector, WINDOW};

/// The rays of a view through one image.
#[derive(Debug)]
pub struct Bins<'a, T> {
    /// A row of pixels for each step. Position 1 is the first pixel; zeros are before it, behind the last one, and for `WINDOW`
    /// samples behind the last row.
    pub(crate) image: &'a [T],
    /// Distance between the rows.
    pub(crate) stride: usize,
    /// Pixels of a row, margins aside.
    pub(crate) n: usize,
    /// The ray of bin 0.
    pub(crate) ray: BoxRay<T>,
    /// Distance between the rays of neighbouring bins.
    pub(crate) per_bin: f64,
}

impl<T: Sample> Bins<'_, T> {
    /// Position of a ray at a step, moved to where zeros are read if it is beyond the image.
    #[inline(always)]
    pub(crate) fn position(&self, offset: f64, shift: f64) -> f64 {
        let t = offset + shift;
        let t = if t > 0.0 { t } else { 0.0 };
        let most = (self.n + 1) as f64;
        if t < most { t } else { most }
    }

    /// Positions of the first and the last ray of a run at the first and the last step: all others lie between.
    #[inline(always)]
    fn corners(&self, offset: &[f64; RUN], steps: &Range<usize>) -> [f64; 4] {
        let at = |l: usize, m: usize| offset[l] + m as f64 * self.ray.per_step;
        let (first, last) = (steps.start, steps.end - 1);
        [
            at(0, first),
            at(0, last),
            at(RUN - 1, first),
            at(RUN - 1, last),
        ]
    }

    /// Whether no position of a run has to be moved.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn inside(&self, offset: &[f64; RUN], steps: &Range<usize>) -> bool {
        // Half a pixel less: the positions between the corners are rounded too.
        let (least, most) = (0.5, self.n as f64 + 0.5);
        let corners = self.corners(offset, steps);
        corners.iter().all(|t| (least..most).contains(t))
    }

    /// Whether the pixels of a run of bins, two of each, are within `WINDOW` of the least of them.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(crate) fn narrow(&self) -> bool {
        self.per_bin.abs() * ((RUN - 1) as f64) < (WINDOW - 3) as f64
    }
}

/// Adds what the given steps contribute to the sums of bins 0, 1, ..., whose number is a multiple of `RUN`: each ray's first pixels
/// and its second ones apart and then together, as [`gather`](super::gather) does, with the same weights.
pub(crate) fn add_bins<T: Sample>(
    set: InstructionSet,
    bins: &Bins<'_, T>,
    steps: Range<usize>,
    sums: &mut [T],
) {
    // The last position is n + 1.
    assert!(steps.end * bins.stride + WINDOW <= bins.image.len() && bins.stride >= bins.n + 2);
    assert!(bins.n < 1 << 31);
    let (sums, rest) = sums.as_chunks_mut::<RUN>();
    assert!(rest.is_empty());
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a projector holds a set only after `is_available`; the image is large enough, as just seen.
        InstructionSet::Avx512 => unsafe { add_avx512(bins, steps, sums) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        InstructionSet::Avx2 => unsafe { add_avx2(bins, steps, sums) },
        #[cfg(target_arch = "aarch64")]
        // SAFETY: as above.
        InstructionSet::Neon => unsafe { add_runs::<T, T::Neon>(bins, steps, sums) },
        // SAFETY: needs nothing that the target lacks; as above.
        _ => unsafe { add_runs::<T, T::Baseline>(bins, steps, sums) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
unsafe fn add_avx512<T: Sample>(bins: &Bins<'_, T>, steps: Range<usize>, sums: &mut [[T; RUN]]) {
    // SAFETY: this function is compiled for the set; the rest is the caller's promise.
    unsafe { add_runs::<T, T::Avx512>(bins, steps, sums) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn add_avx2<T: Sample>(bins: &Bins<'_, T>, steps: Range<usize>, sums: &mut [[T; RUN]]) {
    // SAFETY: as above.
    unsafe { add_runs::<T, T::Avx2>(bins, steps, sums) }
}

/// # Safety
/// The machine has the instruction set of `V`, and the image is as large as `add_bins` asks.
#[inline(always)]
unsafe fn add_runs<T: Sample, V: Vector<T>>(
    bins: &Bins<'_, T>,
    steps: Range<usize>,
    sums: &mut [[T; RUN]],
) {
    for (run, sums) in sums.iter_mut().enumerate() {
        let offset: [f64; RUN] =
            std::array::from_fn(|l| bins.ray.offset + (run * RUN + l) as f64 * bins.per_bin);
        // A run whose rays all stay on one side of the image has nothing to add.
        let corners = bins.corners(&offset, &steps);
        let beyond = (bins.n + 1) as f64;
        if corners.iter().all(|&t| t < 0.0) || corners.iter().all(|&t| t > beyond) {
            continue;
        }
        // SAFETY: the caller's promise.
        let (near, far) = unsafe { V::sum_steps(bins, &offset, steps.clone()) };
        for l in 0..RUN {
            sums[l] += near[l] + far[l];
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(in crate::simd) mod avx512 {
    use std::arch::x86_64::*;

    use super::*;

    /// As [`Vector::sum_steps`]; no position needs to be held within the image if they are all `INSIDE`.
    #[inline(always)]
    pub(in crate::simd) unsafe fn sum_steps<const INSIDE: bool>(
        bins: &Bins<'_, f32>,
        offset: &[f64; RUN],
        steps: Range<usize>,
    ) -> ([f32; RUN], [f32; RUN]) {
        let ray = &bins.ray;
        let narrow = bins.narrow();
        let least = if bins.per_bin > 0.0 { 0 } else { RUN - 1 };
        // SAFETY: the machine has the set, and the image is large enough, as the caller promised: positions are at most n + 1,
        // from which on a row has WINDOW more samples behind it.
        unsafe {
            let low = _mm512_loadu_pd(offset.as_ptr());
            let high = _mm512_loadu_pd(offset[8..].as_ptr());
            let most = _mm512_set1_pd((bins.n + 1) as f64);
            let (whole, width) = (_mm512_set1_pd(ray.whole), _mm512_set1_pd(ray.per_width));
            let length = _mm512_set1_ps(ray.length);
            let lower_words =
                _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            let (mut near, mut far) = (_mm512_setzero_ps(), _mm512_setzero_ps());
            for m in steps {
                let shift = m as f64 * ray.per_step;
                let (j0, s0) = cross_8::<INSIDE>(low, shift, most, whole, width);
                let (j1, s1) = cross_8::<INSIDE>(high, shift, most, whole, width);
                let j = _mm512_permutex2var_epi32(j0, lower_words, j1);
                let share = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(s0), s1);
                let share = _mm512_max_ps(share, _mm512_setzero_ps());
                let share = _mm512_min_ps(share, _mm512_set1_ps(1.0));
                let w0 = _mm512_mul_ps(length, share);
                let w1 = _mm512_sub_ps(length, w0);
                let row = bins.image.as_ptr().add(m * bins.stride);
                let (p0, p1) = if narrow {
                    // The pixels of the whole run are in two registers.
                    let base: i32 = bins.position(offset[least], shift).to_int_unchecked();
                    let row = row.add(base as usize);
                    let (a, b) = (_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(16)));
                    let j = _mm512_sub_epi32(j, _mm512_set1_epi32(base));
                    let next = _mm512_add_epi32(j, _mm512_set1_epi32(1));
                    (
                        _mm512_permutex2var_ps(a, j, b),
                        _mm512_permutex2var_ps(a, next, b),
                    )
                } else {
                    (
                        _mm512_i32gather_ps::<4>(j, row),
                        _mm512_i32gather_ps::<4>(j, row.add(1)),
                    )
                };
                near = _mm512_fmadd_ps(w0, p0, near);
                far = _mm512_fmadd_ps(w1, p1, far);
            }
            let (mut sums, mut others) = ([0.0; RUN], [0.0; RUN]);
            _mm512_storeu_ps(sums.as_mut_ptr(), near);
            _mm512_storeu_ps(others.as_mut_ptr(), far);
            (sums, others)
        }
    }

    /// First pixels of 8 rays at a step, in the lower words, and their shares of it, not yet held within `[0, 1]`.
    #[inline(always)]
    unsafe fn cross_8<const INSIDE: bool>(
        offset: __m512d,
        shift: f64,
        most: __m512d,
        whole: __m512d,
        width: __m512d,
    ) -> (__m512i, __m256) {
        // A sum with this has the integer part of the other number, which is below 2^31, in its lower word.
        const SHIFTED: f64 = (1_u64 << 52) as f64;
        // SAFETY: the machine has the set, as the caller promised.
        unsafe {
            let t = _mm512_add_pd(offset, _mm512_set1_pd(shift));
            let t = match INSIDE {
                true => t,
                false => _mm512_min_pd(_mm512_max_pd(t, _mm512_setzero_pd()), most),
            };
            let first = _mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(t);
            let share = _mm512_sub_pd(whole, _mm512_mul_pd(_mm512_sub_pd(t, first), width));
            let word = _mm512_castpd_si512(_mm512_add_pd(first, _mm512_set1_pd(SHIFTED)));
            (word, _mm512_cvtpd_ps(share))
        }
    }
}
