//! The two types that pixels and detector bins are stored in.

use crate::fft::Transform;
use crate::scalar::Scalar;
use crate::simd::Kernels;

/// A stored sample: `f32` or `f64`, and no other type (sealed: kernels and transforms exist for these two).
///
/// Geometry, filters and weights are computed in `f64` and cast once; only images and sinograms contain samples. The arithmetic is in
/// [`Scalar`]. Kernels and Fourier transforms are compiled with this crate, and not again in the crates that use it.
pub trait Sample: Scalar + Kernels + Transform {}

impl Sample for f32 {}
impl Sample for f64 {}

/// Whether samples are all finite, and whether any is other than zero.
pub(crate) fn finite_and_signal<T: Sample>(samples: &[T]) -> (bool, bool) {
    // Side by side and without an early exit, so that the compiler vectorises the loop.
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
