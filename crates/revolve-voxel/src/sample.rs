//! The stored number types: `f32` and `f64`.

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A stored sample, `f32` or `f64`; geometry is always computed in `f64` and rounded once.
pub trait Sample: Copy + Default + Send + Sync + std::ops::AddAssign + sealed::Sealed {
    /// Returns the nearest stored value.
    fn from_f64(value: f64) -> Self;
    /// Returns the stored value as `f64`.
    fn to_f64(self) -> f64;
}

impl Sample for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Sample for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}
