//! The few vector operations of the kernels, per instruction set; compilers do not find these by themselves reliably.

use crate::sample::Sample;

/// A register of samples.
///
/// Every method must be inlined into a function compiled for the instruction set: callers promise that the machine has it.
pub trait Vector<T>: Copy {
    /// Samples in the register.
    const WIDTH: usize;
    /// All samples equal to `x`.
    unsafe fn splat(x: T) -> Self;
    /// `WIDTH` samples from `at` on, which must be valid to read.
    unsafe fn load(at: *const T) -> Self;
    /// `WIDTH` samples to `at` on, which must be valid to write.
    unsafe fn store(self, at: *mut T);
    /// `self * a + b`, rounded once where the set has a fused multiply-add, else twice.
    unsafe fn multiply_add(self, a: Self, b: Self) -> Self;
    /// The same for single samples.
    fn multiply_add_one(x: T, a: T, b: T) -> T;
}

/// A 16-byte register without intrinsics; `FUSED` where the target always has a fused multiply-add.
#[derive(Debug, Clone, Copy)]
pub struct Plain<T, const W: usize, const FUSED: bool>([T; W]);

impl<T: Sample, const W: usize, const FUSED: bool> Vector<T> for Plain<T, W, FUSED> {
    const WIDTH: usize = W;
    #[inline(always)]
    unsafe fn splat(x: T) -> Self {
        Self([x; W])
    }
    #[inline(always)]
    unsafe fn load(at: *const T) -> Self {
        // SAFETY: the caller's promise; an array has the alignment of its samples.
        Self(unsafe { *at.cast() })
    }
    #[inline(always)]
    unsafe fn store(self, at: *mut T) {
        // SAFETY: the caller's promise.
        unsafe { *at.cast() = self.0 }
    }
    #[inline(always)]
    unsafe fn multiply_add(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| {
            Self::multiply_add_one(self.0[i], a.0[i], b.0[i])
        }))
    }
    #[inline(always)]
    fn multiply_add_one(x: T, a: T, b: T) -> T {
        if FUSED { x.fused(a, b) } else { x * a + b }
    }
}

/// The vectors of a sample type, one per instruction set.
pub trait Vectors: Sized {
    type Baseline: Vector<Self>;
    #[cfg(target_arch = "aarch64")]
    type Neon: Vector<Self>;
    #[cfg(target_arch = "x86_64")]
    type Avx2: Vector<Self>;
    #[cfg(target_arch = "x86_64")]
    type Avx512: Vector<Self>;
}

impl Vectors for f32 {
    type Baseline = Plain<f32, 4, false>;
    #[cfg(target_arch = "aarch64")]
    type Neon = Plain<f32, 4, true>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F32x8;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = x86::F32x16;
}

impl Vectors for f64 {
    type Baseline = Plain<f64, 2, false>;
    #[cfg(target_arch = "aarch64")]
    type Neon = Plain<f64, 2, true>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F64x4;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = x86::F64x8;
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Vector;

    macro_rules! vector {
        ($name:ident, $register:ident, $t:ident, $width:literal, $splat:ident, $load:ident, $store:ident, $fma:ident) => {
            #[derive(Debug, Clone, Copy)]
            pub struct $name($register);

            // SAFETY (all): the caller runs on a machine with the set, and promises what the trait asks of pointers.
            impl Vector<$t> for $name {
                const WIDTH: usize = $width;
                #[inline(always)]
                unsafe fn splat(x: $t) -> Self {
                    Self(unsafe { $splat(x) })
                }
                #[inline(always)]
                unsafe fn load(at: *const $t) -> Self {
                    Self(unsafe { $load(at) })
                }
                #[inline(always)]
                unsafe fn store(self, at: *mut $t) {
                    unsafe { $store(at, self.0) }
                }
                #[inline(always)]
                unsafe fn multiply_add(self, a: Self, b: Self) -> Self {
                    Self(unsafe { $fma(self.0, a.0, b.0) })
                }
                #[inline(always)]
                fn multiply_add_one(x: $t, a: $t, b: $t) -> $t {
                    x.mul_add(a, b)
                }
            }
        };
    }
    vector!(
        F32x8,
        __m256,
        f32,
        8,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_fmadd_ps
    );
    vector!(
        F64x4,
        __m256d,
        f64,
        4,
        _mm256_set1_pd,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        _mm256_fmadd_pd
    );
    vector!(
        F32x16,
        __m512,
        f32,
        16,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_fmadd_ps
    );
    vector!(
        F64x8,
        __m512d,
        f64,
        8,
        _mm512_set1_pd,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        _mm512_fmadd_pd
    );
}
