//! Rows of the detector side by side, which share the positions and weights of pixels.

use crate::Sample;

/// Rows of a block.
pub(super) const LANES: usize = 16;

/// One position in the rows of a block: a cache line of `f32`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Lanes<T>(pub(super) [T; LANES]);

impl<T: Sample> Lanes<T> {
    /// The same number in all rows.
    #[inline(always)]
    pub(super) fn splat(x: T) -> Self {
        Self([x; LANES])
    }

    /// Adds `factor` times `other`.
    #[inline(always)]
    pub(super) fn add(&mut self, factor: T, other: &Self) {
        for (x, &y) in self.0.iter_mut().zip(&other.0) {
            *x += factor * y;
        }
    }

    /// Each times its counterpart.
    #[inline(always)]
    pub(super) fn times(mut self, other: &Self) -> Self {
        for (x, &y) in self.0.iter_mut().zip(&other.0) {
            *x *= y;
        }
        self
    }
}
