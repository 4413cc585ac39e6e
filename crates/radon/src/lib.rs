//! Parallel-beam tomography on a CPU: projectors with exact adjoints, filtered back-projection, analytic test objects.
//!
#![doc = include_str!("../README.md")]
//!
//! # What it computes
//!
//! The Radon transform p of an image f (value x length), and filtered back-projection:
//!
#![doc = include_str!("../img/equations.html")]
//!
//! h is the band-limited ramp times a window, from its spatial samples (unit pitch here); w are the weights of the angle list.
//! A projector is `(A x)[view, bin] = sum over pixels of weight * x[pixel]`; its adjoint uses the same weights.
//!
#![doc = include_str!("../img/camera.svg")]
#![doc = include_str!("../img/centres.svg")]
//!
//! Results are bitwise identical for any number of threads; between instruction sets ([`InstructionSet`]) they differ by rounding.
//!
//! # One slice
//!
//! Stacks of slices are worked on side by side; one slice, the case of every plane problem and of the solvers on it, has no others.
//! [`Projector`] then works on neighbouring bins (forward) or pixels (adjoint), for the same bits, where the path of stacks takes
//! (128², 256² and 512² pixels, as many views and bins, one thread, the least of some runs) so many times as long:
//!
//! | | `f32` forward | `f32` adjoint | `f64` forward | `f64` adjoint |
//! | --- | ---: | ---: | ---: | ---: |
//! | AVX-512 | 9 to 17 | 8 to 11 | 4.7 to 6.5 | 1 |
//! | AVX2 | 7 to 11 | 3.4 to 3.9 | 3.5 to 4.6 | 1 |
//! | baseline | 5 to 6 | 1.1 to 1.3 | 2.8 to 3.8 | 1 |
//!
//! `f64` samples have their adjoint by the path of stacks. Users: [`Projector::forward`], [`Projector::adjoint`], all solvers with a
//! [`Projector`] as their operator, and what is left of a stack beyond its last full block.
//!
//! # Large slices
//!
//! The sum over views takes N³ updates, a Fourier method N² log N operations. [`FbpPlan`] selects by size ([`Method`]). For forward
//! projection [`FourierProjector`] is the alternative to [`Projector`]; it is another operator with other weights.
//!
//! # What it is not
//!
//! Neither fan nor cone beam, no scatter, no files; objects beyond the analytic ones are the caller's. Attenuation and a blur that grows with
//! the distance are in [`SpectOperator`] alone.
//!
//! # References
//!
//! Kak & Slaney, Principles of Computerized Tomographic Imaging (1988), ch. 3. Joseph 1982, doi:10.1109/TMI.1982.4307572. Siddon
//! 1985, doi:10.1118/1.595715.

#![cfg_attr(docsrs, feature(doc_cfg))]
mod blur;
mod depth_blur;
mod error;
mod fbp;
mod fft;
mod filter;
mod fourier;
mod geometry;
mod iterative;
mod measure;
mod motion;
#[cfg(feature = "noise")]
mod noise;
mod phantom;
mod pool;
mod projector;
mod response;
mod sample;
mod scalar;
mod shift;
mod simd;
mod slices;
mod spect;
mod stack;

pub use blur::Blur;
pub use depth_blur::DepthBlur;
pub use error::{RadonError, UserError};
pub use fbp::{
    EdgePolicy, FbpOptions, FbpPlan, FbpReport, FbpScratch, Interpolation, Method, Skip,
};
pub use filter::{Window, padded_len, ramp_response, ramp_sample};
pub use fourier::FourierProjector;
pub use geometry::{ArcPolicy, ImageGrid, ParallelGeometry, StackOrder};
pub use iterative::{
    CglsOptions, EmOptions, Iteration, IterativeReport, LinearOperator, SirtOptions, StoppedBy,
    Stopping, Subset, cgls, go_on, mlem, osem, sirt,
};
pub use measure::{MaskedStats, disc_mask, rms_within, rmse_within, sum_within};
pub use motion::{Displaced, MovingOperator, State, Warp};
#[cfg(feature = "noise")]
#[cfg_attr(docsrs, doc(cfg(feature = "noise")))]
pub use noise::{CountScale, poisson_counts, poisson_counts_into};
pub use phantom::{BinSampling, Phantom2, Phantom3, Shape2, Shape3};
pub use projector::{Kernel, Projector, ProjectorReport, ProjectorScratch, StackOperator};
pub use sample::Sample;
pub use scalar::Scalar;
pub use shift::add_shifted;
pub use simd::InstructionSet;
pub use slices::SliceAxis;
pub use spect::{Collimator, ParallelHoles, SpectGeometry, SpectOperator, SpectOptions};
#[cfg(feature = "sprs")]
#[cfg_attr(docsrs, doc(cfg(feature = "sprs")))]
pub use sprs;
