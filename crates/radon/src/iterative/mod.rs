//! Iterative reconstruction on any operator with an adjoint.

mod cgls;
mod em;
mod operator;
mod report;
mod sirt;
mod stopping;
mod vectors;

pub use cgls::{CglsOptions, cgls};
pub(crate) use em::interleaved;
pub use em::{EmOptions, Subset, mlem, osem};
pub use operator::{LinearOperator, adjoint_mismatch};
pub use report::{Iteration, IterativeReport, StopReason};
pub use sirt::{SirtOptions, sirt};
pub use stopping::{Stopping, no_observer};
pub(crate) use vectors::{check_not_negative, check_samples};
