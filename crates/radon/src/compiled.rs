//! What takes long to compile, compiled here for each of the two sample types: generic code that held it would be compiled again in
//! every crate that calls it.

use std::ops::Range;
use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

use crate::error::RadonError;
use crate::fbp::{FbpPlan, FbpReport, FbpScratch};
use crate::fourier::{Gridding, GriddingScratch, Response};
use crate::iterative::{CglsOptions, EmOptions, IterativeReport, LinearOperator, Observer};
use crate::iterative::{SirtOptions, cgls, em, sirt};
use crate::projector::{Projector, ProjectorReport, ProjectorScratch};
use crate::spect::{self, SpectGeometry, SpectOptions};
use crate::stack::Stack;
use crate::{
    Blur, DepthBlur, ImageGrid, InstructionSet, ParallelGeometry, Sample, SliceAxis, StackOrder,
};

/// Declares the trait's methods and gives each of the sample types its own, which is a call of the generic function named behind `=`.
macro_rules! compiled {
    ($(fn $name:ident($($argument:ident: $type:ty),*) -> $out:ty = $function:expr;)*) => {
        /// Entrances to generic code, one for each sample type.
        pub trait Compiled: Sized {
            $(fn $name($($argument: $type),*) -> $out where Self: Sample;)*
        }
        impl Compiled for f32 {
            $(fn $name($($argument: $type),*) -> $out where Self: Sample { $function($($argument),*) })*
        }
        impl Compiled for f64 {
            $(fn $name($($argument: $type),*) -> $out where Self: Sample { $function($($argument),*) })*
        }
    };
}

compiled! {
    fn transforms(forward: usize, inverse: usize) -> Transforms<Self> = transforms;
    fn complex_transforms(len: usize) -> ComplexTransforms<Self> = complex_transforms;
    fn reconstruct(
        plan: &FbpPlan<Self>, stack: &Stack, projections: &[Self], slices: Range<usize>, slab: &mut [Self],
        scratch: &mut FbpScratch<Self>, memory: usize
    ) -> Result<FbpReport, RadonError> = FbpPlan::run;
    fn gridding(
        geometry: &ParallelGeometry, grid: &ImageGrid, tolerance: f64, set: InstructionSet, response: Response
    ) -> Result<Gridding<Self>, RadonError> = Gridding::new;
    fn project_gridded(gridding: &Gridding<Self>, image: &[Self], rows: &mut [Self], scratch: &mut GriddingScratch<Self>) -> ()
        = Gridding::project;
    fn project_back_gridded(
        gridding: &Gridding<Self>, rows: &[Self], image: &mut [Self], scratch: &mut GriddingScratch<Self>
    ) -> () = Gridding::project_back;
    fn project(
        projector: &Projector, volume: &[Self], n_slices: usize, order: StackOrder, projections: &mut [Self],
        scratch: &mut ProjectorScratch<Self>
    ) -> Result<ProjectorReport, RadonError> = Projector::project;
    fn project_back(
        projector: &Projector, projections: &[Self], n_slices: usize, order: StackOrder, volume: &mut [Self],
        scratch: &mut ProjectorScratch<Self>
    ) -> Result<ProjectorReport, RadonError> = Projector::project_back;
    fn em(
        parts: &[em::Part<'_, Self>], data: &[Self], image: &mut [Self], options: &EmOptions<Self>, observe: Observer<'_, Self>
    ) -> Result<IterativeReport, RadonError> = em::run;
    fn cgls(
        operator: &dyn LinearOperator<Self>, data: &[Self], image: &mut [Self], options: &CglsOptions, observe: Observer<'_, Self>
    ) -> Result<IterativeReport, RadonError> = cgls::run;
    fn sirt(
        operator: &dyn LinearOperator<Self>, data: &[Self], image: &mut [Self], options: &SirtOptions, observe: Observer<'_, Self>
    ) -> Result<IterativeReport, RadonError> = sirt::run;
    fn spect_plan(
        geometry: &SpectGeometry, grid: &ImageGrid, layers: &SliceAxis, options: &SpectOptions<Self>
    ) -> Result<spect::Plan<Self>, RadonError> = spect::Plan::new;
    fn spect_forward(
        plan: &spect::Plan<Self>, views: &[usize], volume: &[Self], out: &mut [Self], scratch: &mut spect::Scratch<Self>
    ) -> Result<(), RadonError> = spect::Plan::forward;
    fn spect_adjoint(
        plan: &spect::Plan<Self>, views: &[usize], data: &[Self], volume: &mut [Self], scratch: &mut spect::Scratch<Self>
    ) -> Result<(), RadonError> = spect::Plan::adjoint;
    fn blur(blur: &Blur, samples: &mut [Self]) -> () = Blur::blur;
    fn blur_depth(blur: &DepthBlur, slabs: &[Self], size: [usize; 2], out: &mut [Self]) -> () = DepthBlur::blur;
    fn blur_rows(blur: &Blur, samples: &mut [Self], rows: &Range<usize>) -> Vec<Self> = Blur::blur_rows;
}

/// A forward and an inverse transform of real rows.
pub(crate) type Transforms<T> = (Arc<dyn RealToComplex<T>>, Arc<dyn ComplexToReal<T>>);

/// Plans transforms of `forward` real samples, and back to `inverse`.
fn transforms<T: realfft::FftNum>(forward: usize, inverse: usize) -> Transforms<T> {
    let mut planner = RealFftPlanner::new();
    (
        planner.plan_fft_forward(forward),
        planner.plan_fft_inverse(inverse),
    )
}

/// Forward and inverse transforms of complex rows.
pub(crate) type ComplexTransforms<T> = (Arc<dyn Fft<T>>, Arc<dyn Fft<T>>);

/// Plans transforms of `len` complex samples, there and back.
fn complex_transforms<T: realfft::FftNum>(len: usize) -> ComplexTransforms<T> {
    let mut planner = FftPlanner::new();
    (planner.plan_fft_forward(len), planner.plan_fft_inverse(len))
}
