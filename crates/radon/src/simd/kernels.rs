//! The kernels that are generic in the sample type, compiled here for both types; otherwise every calling crate would compile them.

use std::ops::Range;

use rustfft::num_complex::Complex;

use super::pairs::{self, LinearRay, Pairs, Place};
use super::spread::{self, RayPath, Taps};
use super::strip::{self, StripRay};
use super::tile::{self, Tile};
use super::{InstructionSet, transpose, weighted};
use crate::scalar::Scalar;

/// Declares the kernels as methods of each sample type that call the function after `=`.
macro_rules! kernels {
    ($(fn $name:ident($($argument:ident: $type:ty),*) = $function:path;)*) => {
        /// A sample type with kernels; each is documented at its function.
        pub trait Kernels: Scalar {
            $(fn $name(set: InstructionSet, $($argument: $type),*);)*
        }
        impl Kernels for f32 {
            $(fn $name(set: InstructionSet, $($argument: $type),*) { $function(set, $($argument),*) })*
        }
        impl Kernels for f64 {
            $(fn $name(set: InstructionSet, $($argument: $type),*) { $function(set, $($argument),*) })*
        }
    };
}

kernels! {
    fn add_views(lanes: usize, tile: &Tile<'_, Self>, sums: &mut [Self]) = tile::add_views;
    fn interleave(rows: &[&[Self]], stride: usize, out: &mut [Self]) = transpose::interleave;
    fn separate(block: &[Self], stride: usize, rows: &mut [&mut [Self]]) = transpose::separate;
    fn weighted_sums(samples: &[Self], stride: usize, weights: &[Self], sums: &mut [Self]) = weighted::weighted_sums;
    fn extend(pairs: &mut Pairs<Self>, ray: &LinearRay<Self>, m: usize, n: usize, place: Place) = pairs::extend;
    fn extend_strip(
        pairs: &mut Pairs<Self>, ray: &StripRay, m: usize, n: usize, place: Place, pixels: [i32; 2]
    ) = strip::extend_strip;
    fn gather(pixels: &[Self], pairs: &Pairs<Self>, range: Range<usize>, across: usize, sums: &mut [Self]) = pairs::gather;
    fn scatter(pixels: &mut [Self], pairs: &Pairs<Self>, range: Range<usize>, across: usize, ray: &[Self]) = pairs::scatter;
    fn spread(
        taps: &Taps<Self>, path: &RayPath, values: (&[Complex<Self>], &[Self], Complex<Self>), cells: &mut [Complex<Self>]
    ) = spread::spread;
    fn read_between(taps: &Taps<Self>, path: &RayPath, cells: &[Complex<Self>], out: &mut [Complex<Self>]) = spread::read_between;
}
