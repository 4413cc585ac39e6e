//! Iterative reconstruction on any operator with an adjoint.

pub(crate) mod cgls;
pub(crate) mod em;
pub(crate) mod operator;
pub(crate) mod report;
pub(crate) mod sirt;
pub(crate) mod stopping;
mod vectors;

pub(crate) use em::interleaved;
pub(crate) use vectors::{check_not_negative, check_samples};
