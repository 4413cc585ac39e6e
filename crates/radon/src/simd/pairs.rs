//! Weighted sums of pairs of neighbouring pixels and their transpose, for a block of slices: the loops of the projectors.

use std::ops::Range;

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::registers::Registers;
use crate::simd::vector::Vector;

/// The pixels that a ray intersects, two neighbours at a time, and the lengths within them.
#[derive(Clone, Debug, Default)]
pub struct Pairs<T> {
    /// Index of the first pixel of each pair in a block of slices, `[pixel][lane]`.
    pub(super) pixel: Vec<u32>,
    pub(super) near: Vec<T>,
    pub(super) far: Vec<T>,
    /// The largest index.
    pub(super) most: u32,
}

/// A ray whose steps are distributed to two pixels each: step `m` crosses at `t = offset + m * per_step >= 0`, both terms rounded by
/// [`Snap`]. The first pixel is the integer part of `t`; the next one's length is `length * (t - first)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinearRay<T> {
    /// Snapped.
    pub(crate) offset: f64,
    pub(crate) per_step: f64,
    pub(crate) snap: Snap,
    /// Path length of a step.
    pub(crate) length: T,
}

/// Rounding of positions along a row of pixels: a number that is added and subtracted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Snap(f64);

impl Snap {
    /// No rounding.
    pub(crate) const NONE: Self = Self(0.0);
    /// Fractional bits of `FINE`: five integer bits remain in 32 bits (Q5.27).
    pub(crate) const DIGITS: u32 = 27;
    /// Rounds to 2^-27 of a pixel, a tenth of the rounding of an `f32` weight: such positions add exactly, in fixed point as in `f64`.
    /// Positions beyond 2^23 pixels are rounded more coarsely.
    pub(crate) const FINE: Self = Self(1.5 * (1_u64 << (52 - Self::DIGITS)) as f64);

    #[inline(always)]
    pub(crate) fn of(self, position: f64) -> f64 {
        (position + self.0) - self.0
    }
}

/// Positions of the pixels of a ray in memory: step `m` of pixel 0 at `zero`, wrapping, and the distances to the next step and pixel.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub(crate) zero: u32,
    pub(crate) along: u32,
    pub(crate) across: u32,
}

impl<T: Scalar> Pairs<T> {
    pub(crate) fn clear(&mut self) {
        self.pixel.clear();
        self.near.clear();
        self.far.clear();
        self.most = 0;
    }

    /// Empties the list and reserves memory for `n` pairs.
    #[cfg(feature = "sprs")]
    pub(crate) fn try_reserve(
        &mut self,
        n: usize,
    ) -> Result<(), std::collections::TryReserveError> {
        self.clear();
        self.pixel.try_reserve(n)?;
        self.near.try_reserve(n)?;
        self.far.try_reserve(n)
    }

    pub(crate) fn len(&self) -> usize {
        self.pixel.len()
    }

    /// First pixel and both weights of each pair.
    #[cfg(feature = "sprs")]
    pub(crate) fn iter(&self, range: Range<usize>) -> impl Iterator<Item = (usize, T, T)> {
        range.map(|i| (self.pixel[i] as usize, self.near[i], self.far[i]))
    }
}

/// Appends `n` steps of a ray from step `m` to a list of pairs. The numbers do not depend on the set.
pub(super) fn extend<T: Registers>(
    set: InstructionSet,
    pairs: &mut Pairs<T>,
    ray: &LinearRay<T>,
    m: usize,
    n: usize,
    place: Place,
) {
    let start = pairs.len();
    pairs.pixel.resize(start + n, 0);
    pairs.near.resize(start + n, T::ZERO);
    pairs.far.resize(start + n, T::ZERO);
    let (pixel, near, far) = (
        &mut pairs.pixel[start..],
        &mut pairs.near[start..],
        &mut pairs.far[start..],
    );
    // SAFETY: a projector holds a set only after `is_available`.
    let most = unsafe { fill_by(set, ray, m, place, pixel, near, far) };
    pairs.most = pairs.most.max(most);
}

per_set!(
    fn fill_by<Registers>(ray: &LinearRay<T>, m: usize, place: Place, pixel: &mut [u32], near: &mut [T], far: &mut [T]) -> u32 = fill
);

/// Without a branch or call, so that the compiler vectorises it.
///
/// # Safety
/// The machine has the instruction set of `V`, for which it is compiled; `V` is not used otherwise.
#[inline(always)]
unsafe fn fill<T: Scalar, V: Vector<T>>(
    ray: &LinearRay<T>,
    m: usize,
    place: Place,
    pixel: &mut [u32],
    near: &mut [T],
    far: &mut [T],
) -> u32 {
    let m = m as f64;
    let mut most = 0;
    for (i, ((pixel, near), far)) in pixel.iter_mut().zip(near).zip(far).enumerate() {
        let (first, weights) = ray.at(ray.offset, ray.shift(m + f64::from(i as i32)));
        let along = (i as u32).wrapping_mul(place.along);
        let across = (first as u32).wrapping_mul(place.across);
        *pixel = place.zero.wrapping_add(along).wrapping_add(across);
        most = if *pixel > most { *pixel } else { most };
        (*near, *far) = weights;
    }
    most
}

impl<T: Scalar> LinearRay<T> {
    /// Returns the displacement of the position from step 0 to step `m`.
    #[inline(always)]
    pub(crate) fn shift(&self, m: f64) -> f64 {
        self.snap.of(m * self.per_step)
    }

    /// Returns the first pixel of the step at `t = offset + shift`, and the lengths within it and the next.
    #[inline(always)]
    pub(crate) fn at(&self, offset: f64, shift: f64) -> (i32, (T, T)) {
        const BEYOND: f64 = 2_147_483_647.0;
        let t = offset + shift;
        let t = if t > 0.0 { t } else { 0.0 };
        let t = if t < BEYOND { t } else { BEYOND };
        // SAFETY: clamped to the range of `i32`; NaN has become 0.
        let first: i32 = unsafe { t.to_int_unchecked() };
        (first, self.weights(t - f64::from(first)))
    }

    /// Returns the lengths within the first and the next pixel of a step that crosses at this distance after the first.
    #[inline(always)]
    pub(crate) fn weights(&self, behind: f64) -> (T, T) {
        let far = self.length * T::of(behind);
        (self.length - far, far)
    }
}

/// Prefetches samples, if the target supports it.
#[inline(always)]
pub(crate) fn prefetch<T>(samples: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for line in samples.chunks(64 / size_of::<T>()) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint that every machine of this target supports.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = samples;
}

/// Adds the weighted pixels to the sums of one ray, one lane per slice; the second pixel of a pair is at a distance of `across`.
///
/// First and second pixels have separate sums: two short chains of additions instead of a long one.
pub(super) fn gather<T: Registers>(
    set: InstructionSet,
    pixels: &[T],
    pairs: &Pairs<T>,
    range: Range<usize>,
    across: usize,
    sums: &mut [T],
) {
    let steps = Steps::new(pixels.len(), pairs, range, across, sums.len());
    // SAFETY: a projector contains a set only after `is_available`; `Steps::new` has checked the pixels.
    unsafe { gather_by(set, pixels, steps, sums) }
}

/// Adds the weighted value of the ray to its pixels.
pub(super) fn scatter<T: Registers>(
    set: InstructionSet,
    pixels: &mut [T],
    pairs: &Pairs<T>,
    range: Range<usize>,
    across: usize,
    ray: &[T],
) {
    let steps = Steps::new(pixels.len(), pairs, range, across, ray.len());
    // SAFETY: a projector contains a set only after `is_available`; `Steps::new` has checked the pixels.
    unsafe { scatter_by(set, pixels, steps, ray) }
}

/// Pairs that were checked to lie within the pixels.
#[derive(Clone, Copy)]
struct Steps<'a, T> {
    pixel: &'a [u32],
    near: &'a [T],
    far: &'a [T],
    /// Distance from the first to the second pixel, in samples.
    across: usize,
}

impl<'a, T: Scalar> Steps<'a, T> {
    fn new(
        n_samples: usize,
        pairs: &'a Pairs<T>,
        range: Range<usize>,
        across: usize,
        lanes: usize,
    ) -> Self {
        assert!((pairs.most as usize + across + 1) * lanes <= n_samples);
        Self {
            pixel: &pairs.pixel[range.clone()],
            near: &pairs.near[range.clone()],
            far: &pairs.far[range],
            across: across * lanes,
        }
    }

    /// First sample of the first pixel, and both weights.
    #[inline(always)]
    fn iter(self, lanes: usize) -> impl Iterator<Item = (usize, T, T)> {
        let weights = self.near.iter().zip(self.far);
        let pairs = self.pixel.iter().zip(weights);
        pairs.map(move |(&pixel, (&near, &far))| (pixel as usize * lanes, near, far))
    }
}

per_set!(fn gather_by<Registers>(pixels: &[T], steps: Steps<'_, T>, sums: &mut [T]) = gather_lanes);
per_set!(fn scatter_by<Registers>(pixels: &mut [T], steps: Steps<'_, T>, ray: &[T]) = scatter_lanes);

/// # Safety
/// The machine has the instruction set of `V`, and `steps` was checked against these pixels and as many lanes.
#[inline(always)]
unsafe fn gather_lanes<T: Scalar, V: Vector<T>>(pixels: &[T], steps: Steps<'_, T>, sums: &mut [T]) {
    // SAFETY: the caller's promise.
    unsafe {
        match sums.len() / V::WIDTH {
            _ if sums.len() == 1 => {
                let (mut near, mut far) = (T::ZERO, T::ZERO);
                for (at, w0, w1) in steps.iter(1) {
                    near = V::multiply_add_one(w0, pixels[at], near);
                    far = V::multiply_add_one(w1, pixels[at + steps.across], far);
                }
                sums[0] += near + far;
            }
            1 => gather_block::<T, V, 1>(pixels, steps, sums),
            2 => gather_block::<T, V, 2>(pixels, steps, sums),
            4 => gather_block::<T, V, 4>(pixels, steps, sums),
            8 => gather_block::<T, V, 8>(pixels, steps, sums),
            #[expect(clippy::unreachable, reason = "callers pass 1, 2, 4 or 8 vectors")]
            _ => unreachable!("{} lanes", sums.len()),
        }
    }
}

/// # Safety
/// As for `gather_lanes`.
#[inline(always)]
unsafe fn gather_block<T: Scalar, V: Vector<T>, const N: usize>(
    pixels: &[T],
    steps: Steps<'_, T>,
    sums: &mut [T],
) {
    let sums = &mut sums[..N * V::WIDTH];
    // SAFETY: both pixels of a pair and `sums` have N vectors; the machine has the set.
    unsafe {
        // Loaded before they are needed, because they are far away in memory.
        let before: [V; N] = std::array::from_fn(|i| V::load(sums.as_ptr().add(i * V::WIDTH)));
        let mut near = [V::splat(T::ZERO); N];
        let mut far = [V::splat(T::ZERO); N];
        for (at, w0, w1) in steps.iter(N * V::WIDTH) {
            let (p0, w0, w1) = (pixels.as_ptr().add(at), V::splat(w0), V::splat(w1));
            let p1 = p0.add(steps.across);
            for i in 0..N {
                near[i] = w0.multiply_add(V::load(p0.add(i * V::WIDTH)), near[i]);
                far[i] = w1.multiply_add(V::load(p1.add(i * V::WIDTH)), far[i]);
            }
        }
        for i in 0..N {
            let sum = before[i].plus(near[i].plus(far[i]));
            sum.store(sums.as_mut_ptr().add(i * V::WIDTH));
        }
    }
}

/// # Safety
/// The machine has the instruction set of `V`, and `steps` was checked against these pixels and as many lanes.
#[inline(always)]
unsafe fn scatter_lanes<T: Scalar, V: Vector<T>>(pixels: &mut [T], steps: Steps<'_, T>, ray: &[T]) {
    // SAFETY: the caller's promise.
    unsafe {
        match ray.len() / V::WIDTH {
            _ if ray.len() == 1 => {
                for (at, w0, w1) in steps.iter(1) {
                    for (at, w) in [(at, w0), (at + steps.across, w1)] {
                        pixels[at] = V::multiply_add_one(w, ray[0], pixels[at]);
                    }
                }
            }
            1 => scatter_block::<T, V, 1>(pixels, steps, ray),
            2 => scatter_block::<T, V, 2>(pixels, steps, ray),
            4 => scatter_block::<T, V, 4>(pixels, steps, ray),
            #[expect(clippy::unreachable, reason = "callers pass 1, 2 or 4 vectors")]
            _ => unreachable!("{} lanes", ray.len()),
        }
    }
}

/// # Safety
/// As for `scatter_lanes`.
#[inline(always)]
unsafe fn scatter_block<T: Scalar, V: Vector<T>, const N: usize>(
    pixels: &mut [T],
    steps: Steps<'_, T>,
    ray: &[T],
) {
    let ray = &ray[..N * V::WIDTH];
    // SAFETY: `ray` and both pixels of a pair have N vectors; the machine has the set.
    unsafe {
        let ray: [V; N] = std::array::from_fn(|i| V::load(ray.as_ptr().add(i * V::WIDTH)));
        for (at, w0, w1) in steps.iter(N * V::WIDTH) {
            let (p0, w0, w1) = (pixels.as_mut_ptr().add(at), V::splat(w0), V::splat(w1));
            let p1 = p0.add(steps.across);
            for i in 0..N {
                let (p0, p1) = (p0.add(i * V::WIDTH), p1.add(i * V::WIDTH));
                w0.multiply_add(ray[i], V::load(p0)).store(p0);
                w1.multiply_add(ray[i], V::load(p1)).store(p1);
            }
        }
    }
}
