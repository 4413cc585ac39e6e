//! The two types that pixels and detector bins are stored in.

use std::fmt::{Debug, Display};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

pub(crate) mod sealed {
    /// What kernels need beyond the public arithmetic. The FFT's own bound stays behind the seal, so that the dependency is not
    /// public.
    pub trait Sealed: realfft::FftNum + crate::simd::Vectors + crate::compiled::Compiled {
        /// `self * a + b` with one rounding.
        fn fused(self, a: Self, b: Self) -> Self;

        /// The value without its sign.
        fn magnitude(self) -> Self;

        /// The integer as a sample.
        fn whole(i: i32) -> Self;
    }
}

/// A stored sample: `f32` or `f64`, and no other type (sealed).
///
/// Geometry, filters and weights are computed in `f64` and cast once; only what fills images and sinograms is a `Sample`.
pub trait Sample:
    sealed::Sealed
    + Copy
    + Send
    + Sync
    + Default
    + Debug
    + Display
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Sum
    + 'static
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Distance from one to the next larger value.
    const EPSILON: Self;
    /// Nearest value to `x`.
    fn of(x: f64) -> Self;
    /// The value as `f64`, exactly.
    fn f64(self) -> f64;
    /// Whether the value is neither NaN nor infinite.
    fn finite(self) -> bool;
}

/// Whether samples are all finite, and whether any is other than zero.
pub(crate) fn finite_and_signal<T: Sample>(samples: &[T]) -> (bool, bool) {
    // Side by side, and without a way out early, so that the compiler makes vectors of them.
    const LANES: usize = 16;
    let (mut zeros, mut most) = ([T::ZERO; LANES], [T::ZERO; LANES]);
    let (whole, rest) = samples.as_chunks::<LANES>();
    let mut add = |lane: usize, x: T| {
        // 0 for finite x and NaN otherwise, for good.
        zeros[lane] += x * T::ZERO;
        let size = x.magnitude();
        most[lane] = if size > most[lane] { size } else { most[lane] };
    };
    for chunk in whole {
        for lane in 0..LANES {
            add(lane, chunk[lane]);
        }
    }
    for (lane, &x) in rest.iter().enumerate() {
        add(lane, x);
    }
    (
        zeros.iter().all(|&x| x == T::ZERO),
        most.iter().any(|&x| x > T::ZERO),
    )
}

macro_rules! sample {
    ($t:ident) => {
        impl sealed::Sealed for $t {
            #[inline(always)]
            fn fused(self, a: Self, b: Self) -> Self {
                self.mul_add(a, b)
            }
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn whole(i: i32) -> Self {
                i as $t
            }
        }
        impl Sample for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $t::EPSILON;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn finite(self) -> bool {
                self.is_finite()
            }
        }
    };
}
sample!(f32);
sample!(f64);
