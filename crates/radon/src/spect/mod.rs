//! SPECT: projections of a volume with attenuation and depth-dependent resolution.

mod attenuation;
mod axial;
mod blur;
pub(crate) mod collimator;
pub(crate) mod geometry;
mod nodes;
pub(crate) mod operator;
pub(crate) mod options;
mod overlap;
mod plan;
mod run;
mod turned;
mod walk;
