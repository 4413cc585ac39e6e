//! Parallel-beam tomography on a CPU: projectors with exact adjoints, filtered back-projection, analytic test objects.

mod error;
mod fbp;
mod filter;
mod geometry;
mod iterative;
mod measure;
mod phantom;
mod projector;
mod sample;
mod simd;
mod slices;

pub use error::RadonError;
pub use fbp::{EdgePolicy, FbpOptions, FbpPlan, FbpReport, FbpScratch, Interpolation, Skip};
pub use filter::{Window, padded_len, ramp_response, ramp_sample};
pub use geometry::{ArcPolicy, ImageGrid, ParallelGeometry, StackOrder};
pub use iterative::{
    CglsOptions, EmOptions, Iteration, IterativeReport, LinearOperator, SirtOptions, StoppedBy,
    Stopping, Subset, cgls, mlem, osem, sirt,
};
pub use measure::{MaskedStats, disc_mask, rmse_within};
pub use phantom::{BinSampling, Phantom2, Phantom3, Shape2, Shape3};
pub use projector::{Kernel, Projector, ProjectorReport, ProjectorScratch, StackOperator};
pub use sample::Sample;
pub use simd::InstructionSet;
pub use slices::SliceAxis;
#[cfg(feature = "sprs")]
pub use sprs;
