//! Kernels compiled once per instruction set, chosen at run time; the only folder with `unsafe`.

#![allow(unsafe_code)]

/// Defines `name(set, arguments)`: the given loop with the vectors of an instruction set, in a function compiled for that set. The loop is
/// generic in the sample type, whose registers its bound names, or `for f32`.
///
/// # Safety
/// The machine has the set (a plan contains none before `is_available`), and the requirements of the loop hold.
macro_rules! per_set {
    (fn $name:ident<$bound:ident>($($argument:ident: $type:ty),*) $(-> $out:ty)? = $looped:ident) => {
        per_set!(@ $name [T: $bound] T ($($argument: $type),*) ($(-> $out)?) $looped [T,]);
    };
    (fn $name:ident($($argument:ident: $type:ty),*) = $looped:ident for f32) => {
        per_set!(@ $name [] f32 ($($argument: $type),*) () $looped []);
    };
    (@ $name:ident [$($bound:tt)*] $t:ident ($($argument:ident: $type:ty),*) ($($out:tt)*) $looped:ident [$($own:tt)*]) => {
        unsafe fn $name<$($bound)*>(set: InstructionSet, $($argument: $type),*) $($out)* {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
            unsafe fn avx512<$($bound)*>($($argument: $type),*) $($out)* {
                // SAFETY: this function is compiled for the set; the rest is the caller's promise.
                unsafe { $looped::<$($own)* <$t as Registers>::Avx512>($($argument),*) }
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            unsafe fn avx2<$($bound)*>($($argument: $type),*) $($out)* {
                // SAFETY: as above.
                unsafe { $looped::<$($own)* <$t as Registers>::Avx2>($($argument),*) }
            }
            // SAFETY: the caller's promise; the baseline needs nothing beyond the target.
            unsafe {
                match set {
                    #[cfg(target_arch = "x86_64")]
                    InstructionSet::Avx512 => avx512($($argument),*),
                    #[cfg(target_arch = "x86_64")]
                    InstructionSet::Avx2 => avx2($($argument),*),
                    #[cfg(target_arch = "aarch64")]
                    InstructionSet::Neon => $looped::<$($own)* <$t as Registers>::Neon>($($argument),*),
                    _ => $looped::<$($own)* <$t as Registers>::Baseline>($($argument),*),
                }
            }
        }
    };
}

mod fixed;
mod kernels;
mod lanes;
mod pairs;
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
mod pixels;
mod registers;
mod spread;
mod strip;
mod tile;
mod transpose;
mod vector;
mod weighted;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use fixed::{Bins, FixedPositions, MARGIN, add_bins};
pub(crate) use kernels::Kernels;
pub(crate) use lanes::{Lanes, ROWS};
pub(crate) use pairs::{LinearRay, Pairs, Place, Snap, prefetch};
pub(crate) use pixels::{SortedBins, add_sorted};
pub(crate) use spread::{DIGITS, LANES, RayPath, Taps};
pub(crate) use strip::{StripRay, Strips, add_strips, spread_strips};
pub(crate) use tile::{ALONE, Tile, ViewStep};
pub(crate) use vector::{RUN, WINDOW};

/// Instruction set that the kernels of a plan use.
///
/// All sets run the same loop. Sets with a fused multiply-add round once instead of twice, so results of different sets differ in the last
/// bits.
pub use simd_set::Set as InstructionSet;

/// Lanes of a block of `n` slices of `T`: one, or 1, 2 or 4 registers, or 8 of 16 bytes. More lanes would exceed the first-level cache.
pub(crate) fn lanes_for<T>(set: InstructionSet, n: usize) -> usize {
    let (bytes, most) = match set {
        InstructionSet::Avx512 => (64, 4),
        InstructionSet::Avx2 => (32, 4),
        InstructionSet::Baseline | InstructionSet::Neon => (16, 8),
    };
    let width = bytes / size_of::<T>();
    [1, width, 2 * width, 4 * width]
        .into_iter()
        .find(|&lanes| n <= lanes)
        .unwrap_or(most * width)
}

/// Lanes of the first of the blocks that back-projection should cut `n` slices of `T` into.
///
/// All lanes of a block share the position of a pixel in a row, so that a block costs less than its slices one by one; but a mostly empty
/// block costs more than its few slices one by one.
pub(crate) fn first_block<T>(set: InstructionSet, n: usize) -> usize {
    // Slices that back-project one by one in about the time of a block of one register.
    let alone = match (set, size_of::<T>()) {
        (InstructionSet::Avx512, 4) => 8,
        (InstructionSet::Avx2, 4) => 2,
        _ => 1,
    };
    // The widest block without empty lanes, or with `alone` slices left over.
    if n <= alone {
        1
    } else {
        let wide = lanes_for::<T>(set, n);
        let narrow = lanes_for::<T>(set, wide / 2);
        if narrow > 1 && narrow < n && n <= narrow + alone {
            narrow
        } else {
            wide
        }
    }
}
