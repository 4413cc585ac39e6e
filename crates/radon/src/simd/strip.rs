//! Lengths of the steps of a ray that is a strip, in any number of pixels.
//!
//! They are differences of one function at the edges of pixels, which neighbouring pixels share. It has no branch.

use std::ops::Range;

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::fixed::MARGIN;
use crate::simd::pairs::{Pairs, Place};
use crate::simd::registers::Registers;
use crate::simd::vector::{RUN, Vector, WINDOW};

/// A ray whose steps are distributed to any number of pixels: step `m` is a trapezoid about `t = offset + m * per_step`, a box of one width
/// convolved with one of another. The first pixel is the integer part of `t`; none before it has a part of the trapezoid.
#[derive(Clone, Copy, Debug)]
pub struct StripRay {
    pub(crate) offset: f64,
    pub(crate) per_step: f64,
    /// Largest number of pixels of a step.
    pub(crate) n_taps: usize,
    /// Path length of a step.
    length: f64,
    /// Widths of both boxes.
    narrow: f64,
    wide: f64,
}

impl StripRay {
    /// Returns a ray at 0 whose steps are boxes of these widths in pixels, and of this length.
    pub(crate) fn new([v, w]: [f64; 2], per_step: f64, length: f64) -> Self {
        Self {
            offset: 0.0,
            per_step,
            n_taps: (v + w) as usize + 2,
            length,
            narrow: v.min(w),
            wide: v.max(w),
        }
    }

    /// Whether the lengths are computed in the arithmetic of the samples, also for slices alone: rounding errors are relative to the
    /// length of the step, of which a pixel has little if bins are wide.
    pub(crate) fn is_narrow(&self) -> bool {
        self.n_taps <= MOST_TAPS
    }
}

/// Pixels of a step whose lengths are kept together.
const MOST_TAPS: usize = 8;

/// The trapezoid of a strip.
#[derive(Clone, Copy)]
struct Trapezoid<W> {
    /// Half of its base and of its top.
    foot: W,
    flat: W,
    /// Width of its sides, and half of the reciprocal.
    narrow: W,
    per_narrow: W,
    /// Length of the step, and per pixel at the top.
    length: W,
    density: W,
    n_taps: usize,
    /// Half of the base.
    reach: f64,
}

impl<W: Scalar> Trapezoid<W> {
    fn new(ray: &StripRay) -> Self {
        Self {
            foot: W::of(0.5 * (ray.wide + ray.narrow)),
            flat: W::of(0.5 * (ray.wide - ray.narrow)),
            narrow: W::of(ray.narrow),
            per_narrow: W::of(0.5 / ray.narrow.max(1e-30)),
            length: W::of(ray.length),
            density: W::of(ray.length / ray.wide),
            n_taps: ray.n_taps,
            reach: 0.5 * (ray.wide + ray.narrow),
        }
    }

    /// Returns the length before an edge at this distance after the centre; it does not decrease with the distance.
    #[inline(always)]
    fn before(&self, t: W) -> W {
        let side = self.foot - t.magnitude();
        let side = if side > W::ZERO { side } else { W::ZERO };
        let side = if side < self.narrow {
            side
        } else {
            self.narrow
        };
        let top = self.flat - t.magnitude();
        let top = if top > W::ZERO { top } else { W::ZERO };
        let beyond = (side * (side * self.per_narrow) + top) * self.density;
        if t < W::ZERO {
            beyond
        } else {
            self.length - beyond
        }
    }

    /// Returns the first pixels of a run of steps at the given positions, limited to a range, and the lengths within `N` pixels, of which
    /// the first has number `start` in each step: 0 unless `N` is `MOST_TAPS`.
    ///
    /// The loops have no branch or call, so that the compiler vectorises them.
    #[inline(always)]
    fn lengths<const N: usize>(
        &self,
        start: usize,
        [low, high]: [f64; 2],
        position: &[f64; RUN],
    ) -> ([i32; RUN], [[W; RUN]; N]) {
        let (start, n_taps) = match N < MOST_TAPS {
            true => (0, N),
            false => (start, self.n_taps),
        };
        let (mut first, mut centre) = ([0; RUN], [W::ZERO; RUN]);
        for i in 0..RUN {
            let t = position[i];
            let t = if t > low { t } else { low };
            let t = if t < high { t } else { high };
            let whole = t.floor();
            // SAFETY: callers pass limits within the range of `i32`; NaN has become the lower one.
            first[i] = unsafe { whole.to_int_unchecked() };
            centre[i] = W::of(t - whole + self.reach);
        }
        let mut lengths = [[W::ZERO; RUN]; N];
        let mut before = [W::ZERO; RUN];
        if start > 0 {
            before = centre.map(|centre| self.before(W::whole(start as i32) - centre));
        }
        for (tap, lengths) in lengths.iter_mut().enumerate() {
            let edge = start + tap + 1;
            let mut end = [self.length; RUN];
            if edge < n_taps {
                for i in 0..RUN {
                    end[i] = self.before(W::whole(edge as i32) - centre[i]);
                }
            }
            for i in 0..RUN {
                lengths[i] = end[i] - before[i];
            }
            before = end;
        }
        (first, lengths)
    }
}

/// Calls a function with the number of pixels of a step as its last constant: at most `MOST_TAPS`, which also is that of wide strips.
macro_rules! per_taps {
    ($n_taps:expr, $function:ident<$($constant:ty),*>($($argument:expr),*)) => {
        match $n_taps {
            2 => $function::<$($constant,)* 2>($($argument),*),
            3 => $function::<$($constant,)* 3>($($argument),*),
            4 => $function::<$($constant,)* 4>($($argument),*),
            _ => $function::<$($constant,)* MOST_TAPS>($($argument),*),
        }
    };
}

/// Steps for which the pixels of a strip are limited to those of the window.
const STEPS: usize = 32;

/// Appends `n` steps of a strip from step `m` to a list of pairs, those of narrow strips in the order of the steps. `pixels` are the
/// positions of first pixels of the pairs that meet the window; the others are omitted. The numbers do not depend on the set.
pub(super) fn extend_strip<T: Registers>(
    set: InstructionSet,
    pairs: &mut Pairs<T>,
    ray: &StripRay,
    m: usize,
    n: usize,
    place: Place,
    pixels: [i32; 2],
) {
    for start in (0..n).step_by(STEPS) {
        let along = (start as u32).wrapping_mul(place.along);
        let zero = place.zero.wrapping_add(along);
        let (m, n, place) = (m + start, STEPS.min(n - start), Place { zero, ..place });
        // SAFETY: a projector holds a set only after `is_available`.
        unsafe { fill_strip_by(set, pairs, ray, m, n, place, pixels) };
    }
}

per_set!(
    fn fill_strip_by<Registers>(pairs: &mut Pairs<T>, ray: &StripRay, m: usize, n: usize, place: Place, pixels: [i32; 2]) = fill_strip
);

/// # Safety
/// The machine has the instruction set of `V`, for which it is compiled; `V` is not used otherwise.
#[inline(always)]
unsafe fn fill_strip<T: Scalar, V: Vector<T>>(
    pairs: &mut Pairs<T>,
    ray: &StripRay,
    m: usize,
    n: usize,
    place: Place,
    pixels: [i32; 2],
) {
    match ray.is_narrow() {
        true => per_taps!(ray.n_taps, fill < T, T > (pairs, ray, m, n, place, pixels)),
        false => fill::<T, f64, MOST_TAPS>(pairs, ray, m, n, place, pixels),
    }
}

/// Computes at most `STEPS` steps in the arithmetic of `W`.
#[inline(always)]
fn fill<T: Scalar, W: Scalar, const N: usize>(
    pairs: &mut Pairs<T>,
    ray: &StripRay,
    m: usize,
    n: usize,
    place: Place,
    [low, high]: [i32; 2],
) {
    const ALL: [f64; 2] = [-2_147_483_647.0, 2_147_483_647.0];
    let trapezoid = Trapezoid::<W>::new(ray);
    let at = |i: usize| ray.offset + (m as f64 + f64::from(i as i32)) * ray.per_step;
    // Pixels beyond the window at all steps are omitted.
    let ends = [at(0), at(n - 1)];
    let start = (f64::from(low) - ends[0].max(ends[1])) as usize & !1;
    let end = (f64::from(high) - ends[0].min(ends[1]) + 2.0) as usize;
    let taps = match N < MOST_TAPS {
        true => 0..N,
        false => start..end.min(ray.n_taps),
    };
    let most = pairs.len() + n * taps.len().div_ceil(N) * N.div_ceil(2);
    let mut kept = pairs.len();
    pairs.pixel.resize(most, 0);
    pairs.near.resize(most, T::ZERO);
    pairs.far.resize(most, T::ZERO);
    let (pixels, nears, fars) = (&mut *pairs.pixel, &mut *pairs.near, &mut *pairs.far);
    let mut last = 0;
    for run in (0..n).step_by(RUN) {
        let position = std::array::from_fn(|i| at(run + i));
        for start in taps.clone().step_by(N) {
            let (first, lengths) = trapezoid.lengths::<N>(start, ALL, &position);
            for (i, &first) in first.iter().take(n - run).enumerate() {
                let along = ((run + i) as u32).wrapping_mul(place.along);
                let zero = place.zero.wrapping_add(along);
                for tap in (0..N).step_by(2) {
                    let near = T::of(lengths[tap][i].f64());
                    let far = lengths
                        .get(tap + 1)
                        .map_or(T::ZERO, |far| T::of(far[i].f64()));
                    let position = first + (start + tap) as i32;
                    let pixel = zero.wrapping_add((position as u32).wrapping_mul(place.across));
                    (pixels[kept], nears[kept], fars[kept]) = (pixel, near, far);
                    let inside = (position >= low) & (position < high) & (near + far > T::ZERO);
                    last = last.max(if inside { pixel } else { 0 });
                    kept += usize::from(inside);
                }
            }
        }
    }
    pairs.most = pairs.most.max(last);
    pairs.pixel.truncate(kept);
    pairs.near.truncate(kept);
    pairs.far.truncate(kept);
}

/// The strips of a view through one image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strips {
    /// The strip of bin 0, which is narrow; position 1 is the first pixel.
    pub(crate) ray: StripRay,
    /// Distance between neighbouring bins.
    pub(crate) per_bin: f64,
    /// Pixels of a row, the first of them at `MARGIN / 2`.
    pub(crate) n: usize,
    /// Distance between the rows of pixels, one for each step: at least the pixels and a margin.
    pub(crate) stride: usize,
}

/// Bins whose lengths are computed together.
const CHUNK: usize = 128;

impl Strips {
    /// Calls `add` at every step at which some of at most `CHUNK` bins may meet the image: with the step, a range of those bins that consists
    /// of runs, the first pixels of all bins in the row and the lengths within each pixel.
    #[inline(always)]
    fn each_step<const N: usize>(
        &self,
        bins: Range<usize>,
        steps: Range<usize>,
        mut add: impl FnMut(usize, Range<usize>, &[i32; CHUNK], &[[f32; CHUNK]; N]),
    ) {
        let ray = &self.ray;
        let trapezoid = Trapezoid::<f32>::new(ray);
        let limits = [1.0 - ray.n_taps as f64, (self.n + 1) as f64];
        let per_pixel = 1.0 / self.per_bin;
        let offset: [f64; CHUNK] =
            std::array::from_fn(|l| ray.offset + (bins.start + l) as f64 * self.per_bin);
        let (mut first, mut lengths) = ([0; CHUNK], [[0.0; CHUNK]; N]);
        for m in steps {
            let shift = m as f64 * ray.per_step;
            let [a, b] = limits.map(|limit| (limit - shift - offset[0]) * per_pixel);
            // One more on either side for rounding.
            let start = (a.min(b) - 1.0) as usize / RUN * RUN;
            let end = ((a.max(b) + 2.0) as usize)
                .min(bins.len())
                .next_multiple_of(RUN);
            for run in (start..end).step_by(RUN) {
                let position = std::array::from_fn(|l| offset[run + l] + shift);
                let (pixels, parts) = trapezoid.lengths::<N>(0, limits, &position);
                let pixels = pixels.map(|first| first + (MARGIN / 2 - 1) as i32);
                first[run..run + RUN].copy_from_slice(&pixels);
                for (lengths, part) in lengths.iter_mut().zip(&parts) {
                    lengths[run..run + RUN].copy_from_slice(part);
                }
            }
            if start < end {
                add(m, start..end, &first, &lengths);
            }
        }
    }

    /// Checks that the pixels of all steps are among `samples`.
    fn check(&self, n_steps: usize, n_samples: usize) {
        assert!(self.ray.is_narrow() && self.stride >= self.n + MARGIN);
        assert!(n_steps * self.stride <= n_samples && self.n < 1 << 31);
    }
}

/// Adds the image to the sums of bins 0, 1, ..., a multiple of `RUN`, `n_band` steps at a time. The sums are those of
/// [`gather`](super::pairs::gather) with the pairs of [`extend_strip`].
pub(crate) fn add_strips(
    set: InstructionSet,
    strips: &Strips,
    image: &[f32],
    [n_steps, n_band]: [usize; 2],
    sums: &mut [f32],
) {
    // A window after the pixels of the last row is read.
    strips.check(n_steps, image.len() - WINDOW);
    for (chunk, sums) in sums.chunks_mut(CHUNK).enumerate() {
        for start in (0..n_steps).step_by(n_band) {
            let steps = start..(start + n_band).min(n_steps);
            // SAFETY: a projector contains a set only after `is_available`; the size of the image was checked.
            unsafe { add_chunk(set, strips, image, steps, chunk * CHUNK, sums) };
        }
    }
}

/// Adds the values of bins 0, 1, ..., a multiple of `RUN`, to the pixels of `steps`: in the order of the bins, as [`scatter`](super::pairs::scatter).
pub(crate) fn spread_strips(
    set: InstructionSet,
    strips: &Strips,
    values: &[f32],
    steps: Range<usize>,
    pixels: &mut [f32],
) {
    strips.check(steps.len(), pixels.len());
    for (chunk, values) in values.chunks(CHUNK).enumerate() {
        // SAFETY: a projector contains a set only after `is_available`.
        unsafe { spread_chunk(set, strips, values, steps.clone(), chunk * CHUNK, pixels) };
    }
}

per_set!(fn add_chunk(strips: &Strips, image: &[f32], steps: Range<usize>, bin: usize, sums: &mut [f32]) = add_bins for f32);
per_set!(fn spread_chunk(strips: &Strips, values: &[f32], steps: Range<usize>, bin: usize, pixels: &mut [f32]) = spread_bins for f32);

/// # Safety
/// The machine has the instruction set of `V`, and the image has the size that `add_strips` requires.
#[inline(always)]
unsafe fn add_bins<V: Vector<f32>>(
    strips: &Strips,
    image: &[f32],
    steps: Range<usize>,
    bin: usize,
    sums: &mut [f32],
) {
    // SAFETY: the caller's promise.
    unsafe { per_taps!(strips.ray.n_taps, add_taps<V>(strips, image, steps, bin, sums)) }
}

/// # Safety
/// As for `add_bins`.
#[inline(always)]
unsafe fn add_taps<V: Vector<f32>, const N: usize>(
    strips: &Strips,
    image: &[f32],
    steps: Range<usize>,
    bin: usize,
    sums: &mut [f32],
) {
    // First and second pixels of pairs.
    let mut parts = [[0.0; CHUNK]; 2];
    let is_close = strips.per_bin.abs() <= 2.0;
    let bins = bin..bin + sums.len();
    strips.each_step::<N>(bins, steps, |m, bins, first, lengths| {
        let row = &image[m * strips.stride..];
        for run in bins.step_by(V::WIDTH) {
            let index = &first[run..run + V::WIDTH];
            let at = parts
                .each_mut()
                .map(|part| part[run..][..V::WIDTH].as_mut_ptr());
            // SAFETY: `parts` have room for the run; all pixels, also those of a window after them, are within the rows and their margins.
            unsafe {
                let mut sums = at.map(|at| V::load(at));
                for tap in 0..N {
                    let pixels = row.as_ptr().add(tap);
                    let pixels = match is_close {
                        true => V::gather_close(pixels, index),
                        false => V::gather(pixels, index),
                    };
                    let lengths = V::load(lengths[tap].as_ptr().add(run));
                    sums[tap % 2] = lengths.multiply_add(pixels, sums[tap % 2]);
                }
                sums[0].store(at[0]);
                sums[1].store(at[1]);
            }
        }
    });
    for (sum, (near, far)) in sums.iter_mut().zip(parts[0].iter().zip(&parts[1])) {
        *sum += near + far;
    }
}

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn spread_bins<V: Vector<f32>>(
    strips: &Strips,
    values: &[f32],
    steps: Range<usize>,
    bin: usize,
    pixels: &mut [f32],
) {
    per_taps!(
        strips.ray.n_taps,
        spread_taps<V>(strips, values, steps, bin, pixels)
    );
}

#[inline(always)]
fn spread_taps<V: Vector<f32>, const N: usize>(
    strips: &Strips,
    values: &[f32],
    steps: Range<usize>,
    bin: usize,
    pixels: &mut [f32],
) {
    let start = steps.start;
    let bins = bin..bin + values.len();
    let is_rising = strips.per_bin > 0.0;
    strips.each_step::<N>(bins, steps, |m, bins, first, lengths| {
        let row = &mut pixels[(m - start) * strips.stride..][..strips.stride];
        let first = first[bins.clone()].as_chunks::<RUN>().0;
        let values = values[bins.clone()].as_chunks::<RUN>().0;
        for i in 0..N {
            // A pixel takes its bins in their order.
            let tap = if is_rising { N - 1 - i } else { i };
            let row = &mut row[tap..];
            let lengths = lengths[tap][bins.clone()].as_chunks::<RUN>().0;
            for ((first, values), lengths) in first.iter().zip(values).zip(lengths) {
                for l in 0..RUN {
                    // SAFETY: first pixels are limited to those of the row and its margins, after which there are `MOST_TAPS`.
                    let pixel = unsafe { row.get_unchecked_mut(first[l] as usize) };
                    *pixel = V::multiply_add_one(lengths[l], values[l], *pixel);
                }
            }
        }
    });
}
