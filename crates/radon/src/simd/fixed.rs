//! Ray sums of one slice with positions in fixed point, Q5.27: five integer bits, the position in a window of 32 pixels, and 27 fractional
//! bits, the weight.

use std::ops::Range;

use super::InstructionSet;
use super::pairs::{LinearRay, Snap};
use super::registers::Registers;
use super::vector::{Plain, RUN, Vector, WINDOW};
#[cfg(target_arch = "x86_64")]
use super::x86::{F32x8, F32x16};

/// Zeros before and after the pixels of a row: the reach of the rays of a run that touches the image, over a band of steps.
pub(crate) const MARGIN: usize = 64;

/// The rays of a view through one image.
#[derive(Debug)]
pub(crate) struct Bins<'a> {
    /// A row of pixels for each step, the first pixel after `MARGIN` zeros; after the last row `MARGIN + WINDOW` zeros.
    pub(crate) image: &'a [f32],
    /// Distance between the rows: at least the pixels and the next row's margin.
    pub(crate) stride: usize,
    /// Pixels of a row without margins.
    pub(crate) n: usize,
    /// Position of the ray of bin 0 at step 0, not snapped; position 1 is the first pixel.
    pub(crate) first: f64,
    /// Common parameters of all rays.
    pub(crate) ray: LinearRay<f32>,
    /// Distance between the rays of neighbouring bins.
    pub(crate) per_bin: f64,
}

impl Bins<'_> {
    /// Samples of an image whose rows are `stride` apart.
    pub(crate) fn image_len(n_steps: usize, stride: usize) -> usize {
        n_steps * stride + MARGIN + WINDOW
    }

    /// Whether fixed point represents the positions of `n` rays in `n_steps` steps, `n_band` of them at a time: runs must be narrower than
    /// a window and the margins, and within range.
    pub(crate) fn fit(
        ray: &LinearRay<f32>,
        first: f64,
        per_bin: f64,
        n: usize,
        [n_steps, n_band]: [usize; 2],
    ) -> bool {
        let wide = per_bin.abs() * (RUN - 1) as f64;
        let drift = ray.per_step.abs() * n_band as f64;
        let farthest = first.abs() + per_bin.abs() * n as f64 + n_steps as f64;
        ray.snap == Snap::FINE
            && wide < (WINDOW - 3) as f64
            && wide + drift < (MARGIN - 2) as f64
            && farthest < f64::from(1 << 23)
    }
}

/// One pixel.
pub(super) const ONE: i64 = 1 << Snap::DIGITS;
/// Mask of the fractional bits.
pub(super) const REST: i32 = ONE as i32 - 1;

/// A position in units of the last bit; exact if it is rounded to this unit and below 2^23 pixels.
#[inline(always)]
pub(super) fn whole(position: f64) -> i64 {
    (position * ONE as f64) as i64
}

/// The lengths of [`LinearRay::weights`] from positions in fixed point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FixedWeights {
    /// Path length of a step.
    pub(super) length: f32,
    /// Length per unit of the last bit: a power of two, which does not affect rounding.
    pub(super) slope: f32,
}

impl FixedWeights {
    pub(super) fn new(length: f32) -> Self {
        let slope = length / ONE as f32;
        Self { length, slope }
    }

    /// Returns the lengths within the first and the next pixel for a position; integer bits are ignored.
    #[inline(always)]
    pub(super) fn at(&self, position: i32) -> (f32, f32) {
        let far = self.slope * (position & REST) as f32;
        (self.length - far, far)
    }
}

/// Positions of a view's rays in units of the last bit.
#[derive(Debug, Default)]
pub(crate) struct FixedPositions {
    runs: Vec<FixedRun>,
    /// Displacement of all positions from step 0 to each step.
    shifts: Vec<i64>,
}

/// Rays side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedRun {
    /// Their positions at step 0, modulo 32 pixels.
    fixed: [i32; RUN],
    /// The smallest and the largest of them.
    least: i64,
    most: i64,
}

/// Steps that are accumulated in registers.
#[derive(Debug)]
pub(crate) struct Band<'a> {
    bins: &'a Bins<'a>,
    first: usize,
    shifts: &'a [i64],
    weights: FixedWeights,
}

impl Band<'_> {
    /// Returns the pixels at the band's step `i` from a smallest position, and the offset of positions relative to them.
    ///
    /// # Safety
    /// The rays stay within the margins of the row.
    #[inline(always)]
    unsafe fn window(&self, i: usize, least: i64, shift: i64) -> (*const f32, i32) {
        let first = (least + shift) >> Snap::DIGITS;
        let zero = (self.first + i) * self.bins.stride + (MARGIN - 1);
        let at = zero as i64 + first;
        debug_assert!(at >= 0 && at as usize + WINDOW <= self.bins.image.len());
        // SAFETY: the caller's promise.
        let row = unsafe { self.bins.image.as_ptr().offset(at as isize) };
        (row, (shift - (first << Snap::DIGITS)) as i32)
    }
}

impl FixedPositions {
    /// Computes the positions of `n_runs` runs in `n_steps` steps, which [`Bins::fit`] has checked.
    fn fill(&mut self, bins: &Bins<'_>, n_runs: usize, n_steps: usize) {
        let snap = bins.ray.snap;
        let run = |i: usize| {
            let position = |l: usize| bins.first + (i * RUN + l) as f64 * bins.per_bin;
            let at: [i64; RUN] = std::array::from_fn(|l| whole(snap.of(position(l))));
            FixedRun {
                fixed: at.map(|at| at as i32),
                least: at[0].min(at[RUN - 1]),
                most: at[0].max(at[RUN - 1]),
            }
        };
        self.runs.clear();
        self.runs.extend((0..n_runs).map(run));
        let shift = |m: usize| whole(bins.ray.shift(m as f64));
        self.shifts.clear();
        self.shifts.extend((0..n_steps).map(shift));
    }
}

/// Adds the image to the sums of bins 0, 1, ..., a multiple of `RUN`, `n_band` steps at a time. The first and the second pixels of each ray
/// are summed separately, then added, as in [`gather`](super::pairs::gather) and with the same weights.
pub(crate) fn add_bins(
    set: InstructionSet,
    bins: &Bins<'_>,
    n_steps: usize,
    n_band: usize,
    fixed: &mut FixedPositions,
    sums: &mut [f32],
) {
    assert!(Bins::image_len(n_steps, bins.stride) <= bins.image.len());
    assert!(bins.stride >= bins.n + MARGIN && bins.n < 1 << 31);
    let (sums, rest) = sums.as_chunks_mut::<RUN>();
    assert!(rest.is_empty());
    fixed.fill(bins, sums.len(), n_steps);
    for start in (0..n_steps).step_by(n_band) {
        let steps = start..(start + n_band).min(n_steps);
        // SAFETY: a projector contains a set only after `is_available`; the size of the image was checked above.
        unsafe { add_band(set, bins, fixed, steps, sums) };
    }
}

per_set!(fn add_band(bins: &Bins<'_>, fixed: &FixedPositions, steps: Range<usize>, sums: &mut [[f32; RUN]]) = add_runs for f32);

/// A register that accumulates rays at positions in fixed point.
pub(crate) trait AddFixed: Vector<f32> {
    /// Adds steps to the sums of runs of rays; rays must be within the margins.
    ///
    /// # Safety
    /// The machine has the instruction set, and the rays stay within the margins of their rows.
    #[inline(always)]
    unsafe fn add_fixed<const N: usize>(
        band: &Band<'_>,
        runs: &[FixedRun; N],
        sums: &mut [[f32; RUN]; N],
    ) {
        // SAFETY: the caller's promise.
        unsafe { add_plain::<Self, N>(band, runs, sums) }
    }
}
impl<const W: usize, const FUSED: bool> AddFixed for Plain<f32, W, FUSED> {}
#[cfg(target_arch = "x86_64")]
impl AddFixed for F32x8 {
    #[inline(always)]
    unsafe fn add_fixed<const N: usize>(
        band: &Band<'_>,
        runs: &[FixedRun; N],
        sums: &mut [[f32; RUN]; N],
    ) {
        // SAFETY: the caller's promise.
        unsafe { x86::add_avx2(band, runs, sums) }
    }
}
#[cfg(target_arch = "x86_64")]
impl AddFixed for F32x16 {
    #[inline(always)]
    unsafe fn add_fixed<const N: usize>(
        band: &Band<'_>,
        runs: &[FixedRun; N],
        sums: &mut [[f32; RUN]; N],
    ) {
        // SAFETY: the caller's promise.
        unsafe { x86::add_avx512(band, runs, sums) }
    }
}

/// # Safety
/// The machine has the instruction set of `V`, and the image has the size that `add_bins` requires.
#[inline(always)]
unsafe fn add_runs<V: AddFixed>(
    bins: &Bins<'_>,
    fixed: &FixedPositions,
    steps: Range<usize>,
    sums: &mut [[f32; RUN]],
) {
    let band = Band {
        bins,
        first: steps.start,
        shifts: &fixed.shifts[steps],
        weights: FixedWeights::new(bins.ray.length),
    };
    let ends = [band.shifts[0], band.shifts[band.shifts.len() - 1]];
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let beyond = (bins.n as i64 + 1) << Snap::DIGITS;
    // Runs that touch the image are consecutive.
    let touches = |run: &FixedRun| run.most + high >= 0 && run.least + low <= beyond;
    let Some(first) = fixed.runs.iter().position(touches) else {
        return;
    };
    let n = fixed.runs[first..]
        .iter()
        .take_while(|run| touches(run))
        .count();
    let (runs, sums) = (&fixed.runs[first..first + n], &mut sums[first..first + n]);
    let (runs, odd_runs) = runs.as_chunks::<2>();
    let (sums, odd_sums) = sums.as_chunks_mut::<2>();
    for (runs, sums) in runs.iter().zip(sums) {
        // SAFETY: the caller's promise; the runs touch the image, so they stay within the margins.
        unsafe { V::add_fixed(&band, runs, sums) };
    }
    for (run, sums) in odd_runs.iter().zip(odd_sums) {
        // SAFETY: as above.
        unsafe { V::add_fixed(&band, std::array::from_ref(run), std::array::from_mut(sums)) };
    }
}

/// The version without intrinsics.
///
/// # Safety
/// As for [`AddFixed::add_fixed`].
#[inline(always)]
unsafe fn add_plain<V: Vector<f32>, const N: usize>(
    band: &Band<'_>,
    runs: &[FixedRun; N],
    sums: &mut [[f32; RUN]; N],
) {
    for (run, sums) in runs.iter().zip(sums) {
        let (mut near, mut far) = ([0.0; RUN], [0.0; RUN]);
        for (i, &shift) in band.shifts.iter().enumerate() {
            // SAFETY: the rays stay within the margins of their rows.
            unsafe {
                let (row, shift) = band.window(i, run.least, shift);
                let mut index = [0; RUN];
                let mut weights = ([0.0; RUN], [0.0; RUN]);
                for l in 0..RUN {
                    let t = run.fixed[l].wrapping_add(shift);
                    index[l] = (t as u32 >> Snap::DIGITS) as i32;
                    (weights.0[l], weights.1[l]) = band.weights.at(t);
                }
                add_pixels::<V>(row, &index, &weights, &mut near, &mut far);
            }
        }
        for l in 0..RUN {
            sums[l] += near[l] + far[l];
        }
    }
}

/// Adds the weighted pixels at `index` and the following ones.
///
/// # Safety
/// The machine has the instruction set of `V`, and all those pixels are valid to read.
#[inline(always)]
unsafe fn add_pixels<V: Vector<f32>>(
    row: *const f32,
    index: &[i32; RUN],
    weights: &([f32; RUN], [f32; RUN]),
    near: &mut [f32; RUN],
    far: &mut [f32; RUN],
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

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::*;
    use crate::simd::x86::pick;

    /// # Safety
    /// The machine has AVX-512; the rest as for [`AddFixed::add_fixed`].
    #[inline(always)]
    pub(super) unsafe fn add_avx512<const N: usize>(
        band: &Band<'_>,
        runs: &[FixedRun; N],
        sums: &mut [[f32; RUN]; N],
    ) {
        // SAFETY: the machine has the set, and each row holds the window, as the caller promised; all arrays are RUN long.
        unsafe {
            let length = _mm512_set1_ps(band.weights.length);
            let slope = _mm512_set1_ps(band.weights.slope);
            let (rest, one) = (_mm512_set1_epi32(REST), _mm512_set1_epi32(1));
            let mut fixed = [_mm512_setzero_si512(); N];
            for n in 0..N {
                fixed[n] = _mm512_loadu_si512(runs[n].fixed.as_ptr().cast());
            }
            let mut near = [_mm512_setzero_ps(); N];
            let mut far = [_mm512_setzero_ps(); N];
            for (i, &shift) in band.shifts.iter().enumerate() {
                for n in 0..N {
                    let (row, shift) = band.window(i, runs[n].least, shift);
                    let t = _mm512_add_epi32(fixed[n], _mm512_set1_epi32(shift));
                    let j = _mm512_srli_epi32::<{ Snap::DIGITS }>(t);
                    let behind = _mm512_and_si512(t, rest);
                    let w1 = _mm512_mul_ps(slope, _mm512_cvtepi32_ps(behind));
                    let w0 = _mm512_sub_ps(length, w1);
                    let (a, b) = (_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(16)));
                    let next = _mm512_add_epi32(j, one);
                    near[n] = _mm512_fmadd_ps(w0, _mm512_permutex2var_ps(a, j, b), near[n]);
                    far[n] = _mm512_fmadd_ps(w1, _mm512_permutex2var_ps(a, next, b), far[n]);
                }
            }
            for n in 0..N {
                let sum = _mm512_loadu_ps(sums[n].as_ptr());
                let sum = _mm512_add_ps(sum, _mm512_add_ps(near[n], far[n]));
                _mm512_storeu_ps(sums[n].as_mut_ptr(), sum);
            }
        }
    }

    /// # Safety
    /// The machine has AVX2 and FMA; the rest as for [`AddFixed::add_fixed`].
    #[inline(always)]
    pub(super) unsafe fn add_avx2<const N: usize>(
        band: &Band<'_>,
        runs: &[FixedRun; N],
        sums: &mut [[f32; RUN]; N],
    ) {
        // SAFETY: the machine has the set, and each row holds the window, as the caller promised; all arrays are RUN long.
        unsafe {
            let length = _mm256_set1_ps(band.weights.length);
            let slope = _mm256_set1_ps(band.weights.slope);
            let (rest, one) = (_mm256_set1_epi32(REST), _mm256_set1_epi32(1));
            for (run, sums) in runs.iter().zip(sums) {
                let fixed = [
                    _mm256_loadu_si256(run.fixed.as_ptr().cast()),
                    _mm256_loadu_si256(run.fixed[8..].as_ptr().cast()),
                ];
                // The first or the last ray of a half, relative to the smallest of all.
                let mut least = [run.least; 2];
                for n in 0..2 {
                    let behind = |l: usize| run.fixed[l].wrapping_sub(run.least as i32) as u32;
                    least[n] += i64::from(behind(8 * n).min(behind(8 * n + 7)));
                }
                let mut near = [_mm256_setzero_ps(); 2];
                let mut far = [_mm256_setzero_ps(); 2];
                for (i, &shift) in band.shifts.iter().enumerate() {
                    for n in 0..2 {
                        let (row, shift) = band.window(i, least[n], shift);
                        let (a, b) = (_mm256_loadu_ps(row), _mm256_loadu_ps(row.add(8)));
                        let t = _mm256_add_epi32(fixed[n], _mm256_set1_epi32(shift));
                        let behind = _mm256_and_si256(t, rest);
                        let w1 = _mm256_mul_ps(slope, _mm256_cvtepi32_ps(behind));
                        let w0 = _mm256_sub_ps(length, w1);
                        let j = _mm256_srli_epi32::<{ Snap::DIGITS as i32 }>(t);
                        let next = _mm256_add_epi32(j, one);
                        near[n] = _mm256_fmadd_ps(w0, pick(a, b, j), near[n]);
                        far[n] = _mm256_fmadd_ps(w1, pick(a, b, next), far[n]);
                    }
                }
                for n in 0..2 {
                    let sums = sums.as_mut_ptr().add(8 * n);
                    let sum = _mm256_add_ps(near[n], far[n]);
                    _mm256_storeu_ps(sums, _mm256_add_ps(_mm256_loadu_ps(sums), sum));
                }
            }
        }
    }
}
