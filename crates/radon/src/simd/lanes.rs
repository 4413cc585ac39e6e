//! Rows of samples side by side, which share positions and weights.

use crate::scalar::Scalar;

/// Rows of a block.
pub(crate) const ROWS: usize = 16;

/// One position in the rows of a block: a cache line of `f32`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(crate) struct Lanes<T>(pub(crate) [T; ROWS]);

impl<T: Scalar> Lanes<T> {
    /// The same number in all rows.
    #[inline(always)]
    pub(crate) fn splat(x: T) -> Self {
        Self([x; ROWS])
    }

    /// Adds `factor` times `other`, with one rounding if `FUSED`: for instruction sets with a fused multiply-add.
    #[inline(always)]
    pub(crate) fn add<const FUSED: bool>(&mut self, factor: T, other: &Self) {
        for (x, &y) in self.0.iter_mut().zip(&other.0) {
            *x = match FUSED {
                true => y.fused(factor, *x),
                false => *x + factor * y,
            };
        }
    }

    /// Each times its counterpart.
    #[inline(always)]
    pub(crate) fn times(mut self, other: &Self) -> Self {
        for (x, &y) in self.0.iter_mut().zip(&other.0) {
            *x *= y;
        }
        self
    }

    /// The samples of some positions, row by row within each.
    pub(crate) fn flat(lanes: &[Self]) -> &[T] {
        const { assert!(size_of::<Self>() == ROWS * size_of::<T>()) };
        // SAFETY: positions are arrays of samples without padding.
        unsafe { std::slice::from_raw_parts(lanes.as_ptr().cast(), ROWS * lanes.len()) }
    }

    /// As [`flat`](Self::flat).
    pub(crate) fn flat_mut(lanes: &mut [Self]) -> &mut [T] {
        const { assert!(size_of::<Self>() == ROWS * size_of::<T>()) };
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(lanes.as_mut_ptr().cast(), ROWS * lanes.len()) }
    }
}
