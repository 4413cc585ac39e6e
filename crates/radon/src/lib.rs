//! Parallel-beam tomography on a CPU: projectors with exact adjoints, filtered back-projection, analytic test objects.
//!
#![doc = include_str!("../README.md")]
//!
//! # Operators
//!
//! The Radon transform p of an image f (value x length), and filtered back-projection:
//!
#![doc = include_str!("../img/equations.html")]
//!
//! h is the band-limited ramp filter times a window, defined by its spatial samples (here for unit pitch); w are the weights of the view
//! angles. A projector is `(A x)[view, bin] = sum over pixels of weight * x[pixel]`; its adjoint uses the same weights.
//!
#![doc = include_str!("../img/camera.svg")]
#![doc = include_str!("../img/centres.svg")]
//!
//! Results are bitwise identical for any number of threads; between instruction sets ([`InstructionSet`]) they differ by rounding errors.
//!
//! # Progress and cancellation
//!
//! Iterative solvers call an observer after each step, which can end them ([`no_observer`]). The computations of [`FbpPlan`], [`Projector`],
//! [`FourierProjector`] and [`SpectOperator`] report their progress to a `simd_set::Watch`, and end when it is stopped, if they run on a thread
//! pool whose threads are connected with it (`simd_set::watch_with`).
//!
//! # Arrays
//!
//! Images, volumes and projections are slices and `Vec`s, which `ndarray` takes without a copy; the last index is the fastest.
//!
//! ```
//! use ndarray::Array3;
//! use radon::{FbpOptions, FbpPlan, ImageGrid, ParallelGeometry, StackOrder};
//! let (n_slices, geometry) = (3, ParallelGeometry::half_turn(8, 16, 1.0)?);
//! let plan = FbpPlan::<f32>::new(&geometry, &ImageGrid::square(12, 1.0)?, &FbpOptions::default())?;
//! let projections = Array3::<f32>::zeros((8, n_slices, 16)); // [view][slice][bin]
//! let samples = projections.as_slice().ok_or("not contiguous")?;
//! let volume = plan.reconstruct_stack(samples, n_slices, StackOrder::ViewSliceBin)?;
//! let volume = Array3::from_shape_vec((n_slices, 12, 12), volume)?; // [slice][y][x]
//! assert_eq!(volume[[2, 11, 0]], 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # References
//!
//! Kak & Slaney, Principles of Computerized Tomographic Imaging (1988), ch. 3. Joseph 1982, doi:10.1109/TMI.1982.4307572. Siddon
//! 1985, doi:10.1118/1.595715.

#![cfg_attr(docsrs, feature(doc_cfg))]
#[macro_use]
mod setters;
mod error;
mod fbp;
mod fft;
mod filter;
mod fourier;
mod geometry;
mod iterative;
mod lattice;
mod measure;
mod motion;
#[cfg(feature = "noise")]
mod noise;
mod parallel;
mod phantom;
mod pool;
mod projector;
mod sample;
mod scalar;
mod shift;
mod simd;
mod slices;
mod smooth;
mod spect;
mod stack;
#[cfg(feature = "serde")]
mod stored;

pub use error::{RadonError, UserError};
pub use fbp::{
    FbpPlan, FbpScratch,
    options::{EdgePolicy, FbpMethod, FbpOptions, FbpReport, Interpolation},
};
pub use filter::{Window, padded_len, ramp_response, ramp_sample};
pub use fourier::projector::FourierProjector;
pub use geometry::{ArcPolicy, ImageGrid, ParallelGeometry};
pub use iterative::{
    cgls::{CglsOptions, cgls},
    em::{EmOptions, Subset, mlem, osem},
    operator::{LinearOperator, adjoint_mismatch},
    report::{Iteration, IterativeReport, StopReason},
    sirt::{SirtOptions, sirt},
    stopping::{Stopping, no_observer},
};
pub use measure::{MaskedStats, disc_mask, rmse_within};
pub use motion::{
    moving::{MotionState, MovingOperator},
    warp::{Displacements, Warp},
    warps::Warps,
};
#[cfg(feature = "noise")]
#[cfg_attr(docsrs, doc(cfg(feature = "noise")))]
pub use noise::{CountScale, poisson_counts, poisson_counts_into};
pub use phantom::{
    BinSampling, Phantom, phantom2::Phantom2, phantom3::Phantom3, shape2::Shape2, shape3::Shape3,
};
pub use projector::{Projector, kernel::Kernel, operator::StackOperator};
pub use sample::Sample;
pub use scalar::Scalar;
pub use shift::add_shifted;
pub use simd::InstructionSet;
pub use slices::SliceAxis;
pub use smooth::gaussian_filter;
pub use spect::{
    collimator::{Collimator, HoleResponse, ParallelHoles},
    geometry::SpectGeometry,
    operator::SpectOperator,
    options::SpectOptions,
};
#[cfg(feature = "sprs")]
#[cfg_attr(docsrs, doc(cfg(feature = "sprs")))]
pub use sprs;
pub use stack::StackOrder;
