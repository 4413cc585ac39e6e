//! Weighted sums of pixels and their transpose, for a block of slices: the loops of the projectors.

use crate::sample::Sample;
use crate::simd::InstructionSet;
use crate::simd::vector::Vector;

/// One pixel's weight in a ray sum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tap<T> {
    /// Index of the pixel in a block of slices, `[pixel][lane]`.
    pub(crate) pixel: u32,
    /// Its weight: a length.
    pub(crate) weight: T,
}

/// Adds the weighted pixels to the sums of one ray, a lane a slice.
pub(crate) fn gather<T: Sample>(
    set: InstructionSet,
    pixels: &[T],
    taps: &[Tap<T>],
    sums: &mut [T],
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a projector holds a set only after `is_available`.
        InstructionSet::Avx512 => unsafe { gather_avx512(pixels, taps, sums) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        InstructionSet::Avx2 => unsafe { gather_avx2(pixels, taps, sums) },
        #[cfg(target_arch = "aarch64")]
        // SAFETY: as above.
        InstructionSet::Neon => unsafe { gather_lanes::<T, T::Neon>(pixels, taps, sums) },
        // SAFETY: needs nothing that the target lacks.
        _ => unsafe { gather_lanes::<T, T::Baseline>(pixels, taps, sums) },
    }
}

/// Adds the ray's value, weighted, to its pixels.
pub(crate) fn scatter<T: Sample>(
    set: InstructionSet,
    pixels: &mut [T],
    taps: &[Tap<T>],
    ray: &[T],
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a projector holds a set only after `is_available`.
        InstructionSet::Avx512 => unsafe { scatter_avx512(pixels, taps, ray) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        InstructionSet::Avx2 => unsafe { scatter_avx2(pixels, taps, ray) },
        #[cfg(target_arch = "aarch64")]
        // SAFETY: as above.
        InstructionSet::Neon => unsafe { scatter_lanes::<T, T::Neon>(pixels, taps, ray) },
        // SAFETY: needs nothing that the target lacks.
        _ => unsafe { scatter_lanes::<T, T::Baseline>(pixels, taps, ray) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
fn gather_avx512<T: Sample>(pixels: &[T], taps: &[Tap<T>], sums: &mut [T]) {
    // SAFETY: this function is compiled for the set.
    unsafe { gather_lanes::<T, T::Avx512>(pixels, taps, sums) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn gather_avx2<T: Sample>(pixels: &[T], taps: &[Tap<T>], sums: &mut [T]) {
    // SAFETY: this function is compiled for the set.
    unsafe { gather_lanes::<T, T::Avx2>(pixels, taps, sums) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
fn scatter_avx512<T: Sample>(pixels: &mut [T], taps: &[Tap<T>], ray: &[T]) {
    // SAFETY: this function is compiled for the set.
    unsafe { scatter_lanes::<T, T::Avx512>(pixels, taps, ray) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn scatter_avx2<T: Sample>(pixels: &mut [T], taps: &[Tap<T>], ray: &[T]) {
    // SAFETY: this function is compiled for the set.
    unsafe { scatter_lanes::<T, T::Avx2>(pixels, taps, ray) }
}

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn gather_lanes<T: Sample, V: Vector<T>>(pixels: &[T], taps: &[Tap<T>], sums: &mut [T]) {
    // SAFETY: the caller's promise.
    unsafe {
        match sums.len() / V::WIDTH {
            _ if sums.len() == 1 => {
                for tap in taps {
                    sums[0] = V::multiply_add_one(tap.weight, pixels[tap.pixel as usize], sums[0]);
                }
            }
            1 => gather_block::<T, V, 1>(pixels, taps, sums),
            2 => gather_block::<T, V, 2>(pixels, taps, sums),
            4 => gather_block::<T, V, 4>(pixels, taps, sums),
            _ => unreachable!("{} lanes", sums.len()),
        }
    }
}

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn gather_block<T: Sample, V: Vector<T>, const N: usize>(
    pixels: &[T],
    taps: &[Tap<T>],
    sums: &mut [T],
) {
    let lanes = N * V::WIDTH;
    let sums = &mut sums[..lanes];
    // SAFETY: `sums` and `pixel` hold N vectors; the machine has the set.
    unsafe {
        let mut acc: [V; N] = std::array::from_fn(|i| V::load(sums.as_ptr().add(i * V::WIDTH)));
        for tap in taps {
            let pixel = &pixels[tap.pixel as usize * lanes..][..lanes];
            let weight = V::splat(tap.weight);
            for i in 0..N {
                acc[i] = weight.multiply_add(V::load(pixel.as_ptr().add(i * V::WIDTH)), acc[i]);
            }
        }
        for i in 0..N {
            acc[i].store(sums.as_mut_ptr().add(i * V::WIDTH));
        }
    }
}

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn scatter_lanes<T: Sample, V: Vector<T>>(pixels: &mut [T], taps: &[Tap<T>], ray: &[T]) {
    // SAFETY: the caller's promise.
    unsafe {
        match ray.len() / V::WIDTH {
            _ if ray.len() == 1 => {
                for tap in taps {
                    let pixel = &mut pixels[tap.pixel as usize];
                    *pixel = V::multiply_add_one(tap.weight, ray[0], *pixel);
                }
            }
            1 => scatter_block::<T, V, 1>(pixels, taps, ray),
            2 => scatter_block::<T, V, 2>(pixels, taps, ray),
            4 => scatter_block::<T, V, 4>(pixels, taps, ray),
            _ => unreachable!("{} lanes", ray.len()),
        }
    }
}

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn scatter_block<T: Sample, V: Vector<T>, const N: usize>(
    pixels: &mut [T],
    taps: &[Tap<T>],
    ray: &[T],
) {
    let lanes = N * V::WIDTH;
    let ray = &ray[..lanes];
    // SAFETY: `ray` and `pixel` hold N vectors; the machine has the set.
    unsafe {
        let ray: [V; N] = std::array::from_fn(|i| V::load(ray.as_ptr().add(i * V::WIDTH)));
        for tap in taps {
            let pixel = &mut pixels[tap.pixel as usize * lanes..][..lanes];
            let weight = V::splat(tap.weight);
            for i in 0..N {
                let at = pixel.as_mut_ptr().add(i * V::WIDTH);
                weight.multiply_add(ray[i], V::load(at)).store(at);
            }
        }
    }
}
