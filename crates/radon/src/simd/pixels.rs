//! The transpose of the ray sums of one slice: neighbouring pixels side by side, with the few bins that intersect them at a step.

use super::InstructionSet;
use super::fixed::{FixedWeights, REST, whole};
use super::pairs::{LinearRay, Snap};
use super::vector::RUN;

/// Zeros before and after the rays of a view: more than the rays that intersect the pixels of a run.
const MARGIN: usize = 48;
/// Margin of the search for the first bin of a pixel, for the rounding of its position.
const EARLY: f64 = 1e-4;

/// The rays of a view in the order of their positions.
#[derive(Debug, Default)]
pub(crate) struct SortedBins {
    /// Values, and positions at step 0 modulo 32 pixels, `MARGIN` zeros on either side.
    rays: Vec<f32>,
    fixed: Vec<i32>,
    weights: FixedWeights,
    /// The first bin that may reach position 0 in step 0, and the number of bins per pixel.
    start: f64,
    per_pixel: f64,
    /// For each step, the index of the first bin relative to step 0, and the displacement of all positions.
    steps: Vec<(i64, i32)>,
    /// Bins for 0, 1, ... pixels.
    lanes: [i32; RUN],
    /// Bins that may intersect one pixel.
    most: i32,
    /// Whether positions fall from bin to bin.
    falling: bool,
}

impl SortedBins {
    /// Returns the first of the bins that may intersect a pixel, in the original order and counted from the first by position, and the step
    /// to the next.
    #[inline(always)]
    fn first_candidate(&self) -> (i32, i32) {
        if self.falling {
            (self.most - 1, -1)
        } else {
            (0, 1)
        }
    }

    /// Replaces the view by one with bins at `first + bin * per_bin` and their values, if fixed point represents it: not if more than a
    /// window of bins may intersect a run of pixels, nor if they are too far away or apart.
    pub(crate) fn fill(
        &mut self,
        ray: LinearRay<f32>,
        first: f64,
        per_bin: f64,
        n_steps: usize,
        values: impl ExactSizeIterator<Item = f32>,
    ) -> bool {
        // 7 / 0.7 + 3 bins intersect half a run, 15 / 0.7 + 3 a whole one: less than 16 and 32. Positions are modulo 32 pixels: the bins
        // about a pixel must not be farther away.
        const WIDTHS: std::ops::Range<f64> = 0.7..30.0;
        let width = per_bin.abs();
        let n = values.len();
        let farthest = first.abs() + width * n as f64 + n_steps as f64;
        let fits = WIDTHS.contains(&width) && farthest <= f64::from(1 << 22);
        if ray.snap != Snap::FINE || !fits {
            return false;
        }
        let offset = |bin: usize| ray.snap.of(first + bin as f64 * per_bin);
        self.rays.clear();
        self.rays.resize(n + 2 * MARGIN, 0.0);
        self.fixed.clear();
        self.fixed.resize(n + 2 * MARGIN, 0);
        self.falling = per_bin < 0.0;
        for (bin, value) in values.enumerate() {
            let at = MARGIN + if self.falling { n - 1 - bin } else { bin };
            self.rays[at] = value;
            self.fixed[at] = whole(offset(bin)) as i32;
        }
        let least = offset(if self.falling { n - 1 } else { 0 });
        let per_pixel = 1.0 / width;
        self.weights = FixedWeights::new(ray.length);
        self.start = -(1.0 + least) * per_pixel - EARLY;
        self.per_pixel = per_pixel;
        self.steps.clear();
        self.steps.extend((0..n_steps).map(|step| {
            let shift = ray.shift(step as f64);
            (whole(shift * per_pixel), whole(shift) as i32)
        }));
        self.lanes = std::array::from_fn(|l| whole(l as f64 * per_pixel) as i32);
        self.most = (2.0 * per_pixel + 2.0 * EARLY) as i32 + 1;
        true
    }
}

/// Adds the views to a run of pixels from `first` in every step: view by view and bin by bin, with the weights and the order of
/// [`scatter`](super::scatter). Only for AVX2 and AVX-512: with other sets the method for stacks is as fast.
pub(crate) fn add_sorted(
    set: InstructionSet,
    views: &[SortedBins],
    first: usize,
    sums: &mut [[f32; RUN]],
) {
    for sorted in views {
        // SAFETY: a projector contains a set only after `is_available`.
        unsafe {
            match set {
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx512 => x86::add_view_avx512(sorted, first, sums),
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx2 => x86::add_view_avx2(sorted, first, sums),
                #[expect(clippy::unreachable, reason = "no slices are few for other sets")]
                _ => unreachable!("{set:?}"),
            }
        }
    }
}

/// The bins that may intersect `W` pixels at a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepBins<'a> {
    sorted: &'a SortedBins,
    /// Index of the first of them among the rays.
    at: usize,
    /// Offset of the first pixel's bins, in fixed point.
    rest: i32,
    /// Offset that makes fixed-point positions of rays relative to the first pixel.
    shift: i32,
}

/// Calls `add_step` for each step of a view at which bins may intersect `W` pixels of the run.
///
/// The window of rays of each step is within the rays.
#[inline(always)]
fn add_lanes<const W: usize>(
    sorted: &SortedBins,
    first: usize,
    sums: &mut [[f32; RUN]],
    add_step: impl Fn(StepBins<'_>, &mut [f32; W]),
) {
    // A window beyond all rays is empty.
    let end = sorted.rays.len() - MARGIN;
    for half in (0..RUN).step_by(W) {
        // The first pixel is at position 1.
        let position = first + half + 1;
        let bin_0 = position as f64 * sorted.per_pixel + sorted.start + (MARGIN + 1) as f64;
        let bin_0 = whole(bin_0);
        for (&(before, shift), sums) in sorted.steps.iter().zip(&mut *sums) {
            let bin = bin_0 - before;
            // Negative ones are beyond all rays.
            let at = (bin >> Snap::DIGITS) as usize;
            if at >= end {
                continue;
            }
            let step = StepBins {
                sorted,
                at,
                rest: bin as i32 & REST,
                shift: shift.wrapping_sub((position as i32) << Snap::DIGITS),
            };
            let (sums, _) = sums[half..].as_chunks_mut::<W>();
            // The last window ends within the margin after the rays.
            add_step(step, &mut sums[0]);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::*;
    use crate::simd::fixed::ONE;
    use crate::simd::x86::pick;

    /// # Safety
    /// The machine has AVX-512.
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    pub(super) unsafe fn add_view_avx512(
        sorted: &SortedBins,
        first: usize,
        sums: &mut [[f32; RUN]],
    ) {
        // SAFETY: the caller's promise, and that of `add_lanes`.
        add_lanes(sorted, first, sums, |step, sums| unsafe {
            add_avx512(step, sums)
        });
    }

    /// # Safety
    /// The machine has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn add_view_avx2(sorted: &SortedBins, first: usize, sums: &mut [[f32; RUN]]) {
        // SAFETY: the caller's promise, and that of `add_lanes`.
        add_lanes(sorted, first, sums, |step, sums| unsafe {
            add_avx2(step, sums)
        });
    }

    /// # Safety
    /// The machine has AVX-512, and the window of the step is within the rays.
    #[inline(always)]
    unsafe fn add_avx512(step: StepBins<'_>, sums: &mut [f32; RUN]) {
        let StepBins {
            sorted,
            at,
            rest,
            shift,
        } = step;
        debug_assert!(at + 32 <= sorted.rays.len());
        // SAFETY: the machine has the set, and there is room for a window of rays, as the caller promised.
        unsafe {
            let (rays, fixed) = (
                sorted.rays.as_ptr().add(at),
                sorted.fixed.as_ptr().add(at).cast(),
            );
            let (a, b) = (_mm512_loadu_ps(rays), _mm512_loadu_ps(rays.add(16)));
            let (c, d) = (_mm512_loadu_si512(fixed), _mm512_loadu_si512(fixed.add(1)));
            let bins = _mm512_loadu_si512(sorted.lanes.as_ptr().cast());
            let bins = _mm512_add_epi32(_mm512_set1_epi32(rest), bins);
            let bins = _mm512_srli_epi32::<{ Snap::DIGITS }>(bins);
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let pixels = _mm512_slli_epi32::<{ Snap::DIGITS }>(lanes);
            let shift = _mm512_sub_epi32(_mm512_set1_epi32(shift), pixels);
            let (slope, length) = (
                _mm512_set1_ps(sorted.weights.slope),
                _mm512_set1_ps(sorted.weights.length),
            );
            let (one, minus_one) = (
                _mm512_set1_epi32(ONE as i32),
                _mm512_set1_epi32(-(ONE as i32)),
            );
            let digits = _mm512_set1_epi32(REST);
            let mut sum = _mm512_loadu_ps(sums.as_ptr());
            let (k, by) = sorted.first_candidate();
            let (mut j, by) = (
                _mm512_add_epi32(bins, _mm512_set1_epi32(k)),
                _mm512_set1_epi32(by),
            );
            for _ in 0..sorted.most {
                let place = _mm512_add_epi32(_mm512_permutex2var_epi32(c, j, d), shift);
                let behind = _mm512_and_si512(place, digits);
                let far = _mm512_mul_ps(slope, _mm512_cvtepi32_ps(behind));
                let is_near = _mm512_cmplt_epu32_mask(place, one);
                let is_far = _mm512_cmpge_epu32_mask(place, minus_one);
                let weight = _mm512_maskz_mov_ps(is_far, far);
                let weight = _mm512_mask_sub_ps(weight, is_near, length, far);
                sum = _mm512_fmadd_ps(weight, _mm512_permutex2var_ps(a, j, b), sum);
                j = _mm512_add_epi32(j, by);
            }
            _mm512_storeu_ps(sums.as_mut_ptr(), sum);
        }
    }

    /// # Safety
    /// The machine has AVX2 and FMA, and the window of the step is within the rays.
    #[inline(always)]
    unsafe fn add_avx2(step: StepBins<'_>, sums: &mut [f32; RUN / 2]) {
        let StepBins {
            sorted,
            at,
            rest,
            shift,
        } = step;
        debug_assert!(at + 16 <= sorted.rays.len());
        // SAFETY: the machine has the set, and there is room for a window of rays, as the caller promised.
        unsafe {
            let (rays, fixed) = (
                sorted.rays.as_ptr().add(at),
                sorted.fixed.as_ptr().add(at).cast(),
            );
            let (a, b) = (_mm256_loadu_ps(rays), _mm256_loadu_ps(rays.add(8)));
            // Fixed-point positions pass through unchanged.
            let (c, d) = (_mm256_loadu_ps(fixed), _mm256_loadu_ps(fixed.add(8)));
            let bins = _mm256_loadu_si256(sorted.lanes.as_ptr().cast());
            let bins = _mm256_add_epi32(_mm256_set1_epi32(rest), bins);
            let bins = _mm256_srli_epi32::<{ Snap::DIGITS as i32 }>(bins);
            let pixels = _mm256_slli_epi32::<{ Snap::DIGITS as i32 }>(_mm256_setr_epi32(
                0, 1, 2, 3, 4, 5, 6, 7,
            ));
            let shift = _mm256_sub_epi32(_mm256_set1_epi32(shift), pixels);
            let (slope, length) = (
                _mm256_set1_ps(sorted.weights.slope),
                _mm256_set1_ps(sorted.weights.length),
            );
            let digits = _mm256_set1_epi32(REST);
            let mut sum = _mm256_loadu_ps(sums.as_ptr());
            let (k, by) = sorted.first_candidate();
            let (mut j, by) = (
                _mm256_add_epi32(bins, _mm256_set1_epi32(k)),
                _mm256_set1_epi32(by),
            );
            for _ in 0..sorted.most {
                let place = _mm256_add_epi32(_mm256_castps_si256(pick(c, d, j)), shift);
                let behind = _mm256_and_si256(place, digits);
                let far = _mm256_mul_ps(slope, _mm256_cvtepi32_ps(behind));
                let pixel = _mm256_srai_epi32::<{ Snap::DIGITS as i32 }>(place);
                let is_near = _mm256_cmpeq_epi32(pixel, _mm256_setzero_si256());
                let is_far = _mm256_cmpeq_epi32(pixel, _mm256_set1_epi32(-1));
                let far_or_none = _mm256_and_ps(_mm256_castsi256_ps(is_far), far);
                let near = _mm256_sub_ps(length, far);
                let weight = _mm256_blendv_ps(far_or_none, near, _mm256_castsi256_ps(is_near));
                sum = _mm256_fmadd_ps(weight, pick(a, b, j), sum);
                j = _mm256_add_epi32(j, by);
            }
            _mm256_storeu_ps(sums.as_mut_ptr(), sum);
        }
    }
}
