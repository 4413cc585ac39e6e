//! Iterative reconstruction on any operator with an adjoint.

mod cgls;
mod em;
mod operator;
mod report;
mod sirt;
mod stopping;
mod vectors;

pub use cgls::{CglsOptions, cgls, cgls_observed};
pub use em::{EmOptions, Subset, mlem, mlem_observed, osem, osem_observed};
pub use operator::LinearOperator;
pub use report::{Iteration, IterativeReport, StoppedBy};
pub use sirt::{SirtOptions, sirt, sirt_observed};
pub use stopping::Stopping;
pub(crate) use vectors::{check_not_negative, check_samples, norm, relative, sum2};
