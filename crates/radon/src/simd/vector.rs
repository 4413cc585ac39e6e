//! The vector operations of the kernels, per instruction set, which compilers do not vectorise reliably.

use crate::scalar::Scalar;

/// A sample whose integer part is computed without a range check.
pub(crate) trait Truncated: Scalar {
    /// The integer part.
    ///
    /// # Safety
    /// The integer part is within the range of `i32`.
    unsafe fn truncated(self) -> i32;
}
macro_rules! truncated {
    ($($t:ident)*) => {$(
        impl Truncated for $t {
            #[inline(always)]
            unsafe fn truncated(self) -> i32 {
                // SAFETY: the caller's promise.
                unsafe { self.to_int_unchecked() }
            }
        }
    )*};
}
truncated!(f32 f64);

/// A register of samples.
///
/// # Safety
/// Every method must be inlined into a function compiled for the instruction set. Callers promise that the machine has the set and that the
/// requirements on pointers hold.
pub(crate) trait Vector<T>: Copy {
    /// Samples in the register.
    const WIDTH: usize;
    /// All samples equal to `x`.
    unsafe fn splat(x: T) -> Self;
    /// Loads `WIDTH` samples from `at`, which must be valid to read.
    unsafe fn load(at: *const T) -> Self;
    /// Stores `WIDTH` samples to `at`, which must be valid to write.
    unsafe fn store(self, at: *mut T);
    /// `self * a + b`, rounded once with a fused multiply-add, else twice.
    unsafe fn multiply_add(self, a: Self, b: Self) -> Self;
    /// `self + other`.
    unsafe fn plus(self, other: Self) -> Self;
    /// `self - other`.
    unsafe fn minus(self, other: Self) -> Self;
    /// `self * a + b` for single samples.
    fn multiply_add_one(x: T, a: T, b: T) -> T;
    /// Interleaves the samples of both registers, starting with `self`, into two registers.
    unsafe fn zip(self, other: Self) -> (Self, Self);

    /// Returns index and weight of each pixel of a run: integer part and remainder of `first + lane_dx`, clamped to `[0, most]`.
    #[inline(always)]
    unsafe fn locate(first: T, lane_dx: &[T; RUN], most: T) -> ([i32; RUN], [T; RUN])
    where
        T: Truncated,
    {
        let mut index = [0; RUN];
        let mut weight = [T::ZERO; RUN];
        for l in 0..RUN {
            let t = first + lane_dx[l];
            let t = if t > T::ZERO { t } else { T::ZERO };
            let t = if t < most { t } else { most };
            // SAFETY: `most` is at most the length of a row, which the plan limits to the range of `i32`.
            index[l] = unsafe { t.truncated() };
            weight[l] = t - T::whole(index[l]);
        }
        (index, weight)
    }

    /// Loads the `WIDTH` samples of `row` at `index`, all of which must be valid to read.
    #[inline(always)]
    unsafe fn gather(row: *const T, index: &[i32]) -> Self
    where
        T: Scalar,
    {
        let mut samples = [T::ZERO; RUN];
        for l in 0..Self::WIDTH {
            // SAFETY: the caller's promise.
            samples[l] = unsafe { *row.add(index[l] as usize) };
        }
        // SAFETY: a register is no longer than a run.
        unsafe { Self::load(samples.as_ptr()) }
    }

    /// As [`gather`](Self::gather), of indices that rise or fall by at most two, to rounding; `WINDOW` samples from the least are valid.
    #[inline(always)]
    unsafe fn gather_close(row: *const T, index: &[i32]) -> Self
    where
        T: Scalar,
    {
        // SAFETY: the caller's promise.
        unsafe { Self::gather(row, index) }
    }

    /// Adds one view to the pixels of a run; `row` is the run's base sample. The `WINDOW` samples from there must be valid to read, which
    /// contain those of a `narrow` run, and all samples up to the one after `most`.
    #[inline(always)]
    unsafe fn add_run(
        sums: &mut [T; RUN],
        row: *const T,
        first: T,
        lane_dx: &[T; RUN],
        most: T,
        _narrow: bool,
    ) where
        T: Truncated,
    {
        // SAFETY: the caller's promise: no index passes `most`, which is valid with its right neighbour; all arrays are RUN long.
        unsafe {
            let (index, weight) = Self::locate(first, lane_dx, most);
            for start in (0..RUN).step_by(Self::WIDTH) {
                let index = &index[start..start + Self::WIDTH];
                let near: [T; RUN] = std::array::from_fn(|l| T::ONE - weight[l]);
                let sum = Self::load(near.as_ptr().add(start)).multiply_add(
                    Self::gather(row, index),
                    Self::load(sums.as_ptr().add(start)),
                );
                Self::load(weight.as_ptr().add(start))
                    .multiply_add(Self::gather(row.add(1), index), sum)
                    .store(sums.as_mut_ptr().add(start));
            }
        }
    }
}

/// Pixels along x that share one base sample in a row.
pub(crate) const RUN: usize = 16;
/// Samples after a base sample that can be read without leaving a row's margins.
pub(crate) const WINDOW: usize = 32;

/// A 16-byte register without intrinsics; `FUSED` if the target always has a fused multiply-add.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plain<T, const W: usize, const FUSED: bool>([T; W]);

impl<T: Scalar, const W: usize, const FUSED: bool> Vector<T> for Plain<T, W, FUSED> {
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
    #[inline(always)]
    unsafe fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
    #[inline(always)]
    unsafe fn minus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
    #[inline(always)]
    unsafe fn zip(self, other: Self) -> (Self, Self) {
        let at = |i: usize| {
            if i.is_multiple_of(2) {
                self.0[i / 2]
            } else {
                other.0[i / 2]
            }
        };
        let half = |start| Self(std::array::from_fn(|i| at(start + i)));
        (half(0), half(W))
    }
}
