//! Fourier transforms, compiled here for each of the two sample types: code that is generic over them would be compiled again in
//! every crate that calls it.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

/// Forward and inverse transforms of real rows.
pub(crate) type RealPair<T> = (Arc<dyn RealToComplex<T>>, Arc<dyn ComplexToReal<T>>);
/// Forward and inverse transforms of complex rows.
pub(crate) type ComplexPair<T> = (Arc<dyn Fft<T>>, Arc<dyn Fft<T>>);

/// A sample type with Fourier transforms.
pub trait Transform: realfft::FftNum {
    /// Plans transforms of `forward` real samples, and back to `inverse`.
    fn real(forward: usize, inverse: usize) -> RealPair<Self>;
    /// Plans transforms of `len` complex samples.
    fn complex(len: usize) -> ComplexPair<Self>;
}

macro_rules! transform {
    ($t:ident) => {
        impl Transform for $t {
            fn real(forward: usize, inverse: usize) -> RealPair<Self> {
                let mut planner = RealFftPlanner::new();
                (
                    planner.plan_fft_forward(forward),
                    planner.plan_fft_inverse(inverse),
                )
            }
            fn complex(len: usize) -> ComplexPair<Self> {
                let mut planner = FftPlanner::new();
                (planner.plan_fft_forward(len), planner.plan_fft_inverse(len))
            }
        }
    };
}
transform!(f32);
transform!(f64);
