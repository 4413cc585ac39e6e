//! The methods of a step.

pub(crate) mod linearised;
pub(crate) mod midpoint;
mod pentadiagonal;
pub(crate) mod splitting;
pub(crate) mod stage;
pub(crate) mod tr_bdf2;
