//! The registers of a sample type, one for each instruction set.

use super::vector::{Plain, Truncated, Vector};
#[cfg(target_arch = "x86_64")]
use super::x86;

/// The registers of a sample type. Those of other architectures are declared but unused.
pub(crate) trait Registers: Truncated {
    type Baseline: Vector<Self>;
    type Neon: Vector<Self>;
    type Avx2: Vector<Self>;
    type Avx512: Vector<Self>;
}

impl Registers for f32 {
    type Baseline = Plain<f32, 4, false>;
    type Neon = Plain<f32, 4, true>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F32x8;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = x86::F32x16;
    #[cfg(not(target_arch = "x86_64"))]
    type Avx2 = Self::Baseline;
    #[cfg(not(target_arch = "x86_64"))]
    type Avx512 = Self::Baseline;
}

impl Registers for f64 {
    type Baseline = Plain<f64, 2, false>;
    type Neon = Plain<f64, 2, true>;
    #[cfg(target_arch = "x86_64")]
    type Avx2 = x86::F64x4;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = x86::F64x8;
    #[cfg(not(target_arch = "x86_64"))]
    type Avx2 = Self::Baseline;
    #[cfg(not(target_arch = "x86_64"))]
    type Avx512 = Self::Baseline;
}
