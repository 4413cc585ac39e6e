//! Lengths of the steps of a ray that is a strip, in any number of pixels.

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::pairs::{Pairs, Place};
use crate::simd::registers::Registers;
use crate::simd::vector::Vector;

/// A ray whose steps are distributed to any number of pixels: step `m` is a trapezoid about `t = offset + m * per_step`, a box of one width
/// convolved with one of another. The first pixel is the integer part of `t`; none before it has a part of the trapezoid.
#[derive(Clone, Copy, Debug)]
pub struct StripRay {
    pub(crate) offset: f64,
    pub(crate) per_step: f64,
    /// Path length of a step.
    pub(crate) length: f64,
    /// Largest number of pixels of a step.
    pub(crate) n_taps: usize,
    /// Half of the trapezoid's base and of its top.
    foot: f64,
    flat: f64,
    /// Width of its sides, and the reciprocal; the reciprocal of its width at half of its height.
    narrow: f64,
    per_narrow: f64,
    per_wide: f64,
}

impl StripRay {
    /// Returns a ray at 0 whose steps are boxes of these widths in pixels, and of this length.
    pub(crate) fn new([v, w]: [f64; 2], per_step: f64, length: f64) -> Self {
        let (narrow, wide) = if v < w { (v, w) } else { (w, v) };
        Self {
            offset: 0.0,
            per_step,
            length,
            n_taps: (v + w) as usize + 2,
            foot: 0.5 * (wide + narrow),
            flat: 0.5 * (wide - narrow),
            narrow,
            per_narrow: 1.0 / narrow.max(f64::MIN_POSITIVE),
            per_wide: 1.0 / wide,
        }
    }

    /// Returns the fraction of the trapezoid before the first edge of pixel `tap`, counted from the first, of a step whose position has
    /// the fractional part `behind`.
    #[inline(always)]
    fn before(&self, tap: f64, behind: f64) -> f64 {
        let t = tap - self.foot - behind;
        let side = self.foot - t.abs();
        let side = if side > 0.0 { side } else { 0.0 };
        let side = if side < self.narrow {
            side
        } else {
            self.narrow
        };
        let top = self.flat - t.abs();
        let top = if top > 0.0 { top } else { 0.0 };
        let beyond = (0.5 * side * (side * self.per_narrow) + top) * self.per_wide;
        if t < 0.0 { beyond } else { 1.0 - beyond }
    }
}

/// Steps of a strip whose positions are kept between its pairs.
const STEPS: usize = 32;

/// Appends `n` steps of a strip from step `m` to a list of pairs: of each `STEPS` steps the first two pixels, then the next two, and so on.
/// `pixels` are the positions of first pixels of the pairs that meet the window; the others get no length. The numbers do not depend on the
/// set.
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

/// Its loops have no branch or call, so that the compiler vectorises them.
///
/// # Safety
/// The machine has the instruction set of `V`, for which it is compiled; `V` is not used otherwise.
#[inline(always)]
unsafe fn fill_strip<T: Scalar, V: Vector<T>>(
    pairs: &mut Pairs<T>,
    ray: &StripRay,
    m: usize,
    n: usize,
    place: Place,
    [low, high]: [i32; 2],
) {
    let (mut first, mut behind, mut before) = ([0; STEPS], [0.0; STEPS], [0.0; STEPS]);
    let (first, behind, before) = (&mut first[..n], &mut behind[..n], &mut before[..n]);
    for (i, (first, behind)) in first.iter_mut().zip(&mut *behind).enumerate() {
        let t = ray.offset + (m as f64 + f64::from(i as i32)) * ray.per_step;
        (*first, *behind) = divided(t);
    }
    // Pairs beyond the window at all steps are omitted.
    let (least, most) = (first[0].min(first[n - 1]), first[0].max(first[n - 1]));
    let start = (i64::from(low) - i64::from(most)).max(0) / 2;
    let end = (i64::from(high) - i64::from(least) + 1) / 2;
    let end = end.min(ray.n_taps.div_ceil(2) as i64);
    for (before, &behind) in before.iter_mut().zip(&*behind) {
        *before = ray.before(2.0 * start as f64, behind);
    }
    for pair in start..end {
        let at = pairs.len();
        pairs.pixel.resize(at + n, 0);
        pairs.near.resize(at + n, T::ZERO);
        pairs.far.resize(at + n, T::ZERO);
        let lengths = pairs.near[at..].iter_mut().zip(&mut pairs.far[at..]);
        let steps = first.iter().zip(&*behind).zip(&mut *before);
        let (tap, mut last) = (2 * pair as i32, 0);
        for (i, ((pixel, (near, far)), ((&first, &behind), before))) in pairs.pixel[at..]
            .iter_mut()
            .zip(lengths)
            .zip(steps)
            .enumerate()
        {
            let middle = ray.before(f64::from(tap + 1), behind);
            let end = ray.before(f64::from(tap + 2), behind);
            let position = first + tap;
            let inside = (position >= low) & (position < high);
            let (position, length) = if inside {
                (position, ray.length)
            } else {
                (low, 0.0)
            };
            let along = (i as u32).wrapping_mul(place.along);
            let across = (position as u32).wrapping_mul(place.across);
            *pixel = place.zero.wrapping_add(along).wrapping_add(across);
            last = if *pixel > last { *pixel } else { last };
            *near = T::of(length * (middle - *before));
            *far = T::of(length * (end - middle));
            *before = end;
        }
        pairs.most = pairs.most.max(last);
    }
}

/// Divides a position into its integer part, limited to the range of `i32`, and its fractional part.
#[inline(always)]
fn divided(t: f64) -> (i32, f64) {
    const BEYOND: f64 = 2_147_483_647.0;
    let whole = t.floor();
    let whole = if whole > -BEYOND { whole } else { -BEYOND };
    let whole = if whole < BEYOND { whole } else { BEYOND };
    // SAFETY: clamped to the range of `i32`; NaN has become its lower end.
    let first = unsafe { whole.to_int_unchecked() };
    (first, t - whole)
}
