//! The arithmetic of complex numbers that a closed form needs.

use std::ops::{Add, Mul};

/// Real and imaginary part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Complex(pub(crate) f64, pub(crate) f64);

impl Complex {
    /// Absolute value.
    pub(crate) fn norm(self) -> f64 {
        self.0.hypot(self.1)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self(self.0 * b.0 - self.1 * b.1, self.0 * b.1 + self.1 * b.0)
    }
}

impl Mul<f64> for Complex {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        Self(self.0 * b, self.1 * b)
    }
}
