//! Where a ray crosses the steps of a view, and how it divides each step between two pixels: the arithmetic of the traversal.

use crate::sample::Sample;
use crate::simd::InstructionSet;

/// A ray whose steps are spread over two pixels each: step `m` crosses at `t = offset + m * per_step + lead`, the first pixel is
/// its integer part, and the share of that pixel is `whole - per_width * (t - first)`, held within `[0, 1]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxRay {
    pub(crate) offset: f64,
    pub(crate) per_step: f64,
    pub(crate) lead: f64,
    pub(crate) whole: f64,
    pub(crate) per_width: f64,
    /// Path length of a step.
    pub(crate) length: f64,
}

/// First pixel of each step, and the lengths within it and within the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoxSteps<T> {
    pub(crate) first: Vec<i32>,
    pub(crate) near: Vec<T>,
    pub(crate) far: Vec<T>,
}

impl<T: Sample> BoxSteps<T> {
    /// Computes `n` steps from step `m` on, all of which must cross within `[0, 2^31)`. Every set gets the same numbers.
    pub(crate) fn fill(&mut self, set: InstructionSet, ray: &BoxRay, m: usize, n: usize) {
        self.first.resize(n, 0);
        self.near.resize(n, T::ZERO);
        self.far.resize(n, T::ZERO);
        let (first, near, far) = (&mut self.first, &mut self.near, &mut self.far);
        match set {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a projector holds a set only after `is_available`.
            InstructionSet::Avx512 => unsafe { fill_avx512(ray, m, first, near, far) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            InstructionSet::Avx2 => unsafe { fill_avx2(ray, m, first, near, far) },
            _ => fill(ray, m, first, near, far),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
fn fill_avx512<T: Sample>(
    ray: &BoxRay,
    m: usize,
    first: &mut [i32],
    near: &mut [T],
    far: &mut [T],
) {
    fill(ray, m, first, near, far);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn fill_avx2<T: Sample>(ray: &BoxRay, m: usize, first: &mut [i32], near: &mut [T], far: &mut [T]) {
    fill(ray, m, first, near, far);
}

/// Without a branch, and without a call that could keep the compiler from making vectors of it.
#[inline(always)]
fn fill<T: Sample>(ray: &BoxRay, m: usize, first: &mut [i32], near: &mut [T], far: &mut [T]) {
    const BEYOND: f64 = 2_147_483_647.0;
    let m = m as f64;
    for (i, ((first, near), far)) in first.iter_mut().zip(near).zip(far).enumerate() {
        let t = ray.offset + (m + f64::from(i as i32)) * ray.per_step + ray.lead;
        let within = if t > 0.0 { t } else { 0.0 };
        let within = if within < BEYOND { within } else { BEYOND };
        // SAFETY: held within the range of `i32`; NaN has become 0.
        *first = unsafe { within.to_int_unchecked() };
        let share = ray.whole - (t - f64::from(*first)) * ray.per_width;
        let share = if share > 0.0 { share } else { 0.0 };
        let share = if share < 1.0 { share } else { 1.0 };
        *near = T::of(ray.length * share);
        *far = T::of(ray.length * (1.0 - share));
    }
}
