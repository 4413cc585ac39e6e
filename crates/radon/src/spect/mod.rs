//! SPECT: projections of a volume with attenuation and depth-dependent resolution.

mod attenuation;
mod axial;
mod blur;
mod collimator;

mod geometry;

mod operator;
mod options;
mod overlap;
mod plan;
mod run;
mod turned;
mod walk;

pub use collimator::{Collimator, HoleResponse, ParallelHoles};
pub use geometry::SpectGeometry;
pub use operator::SpectOperator;
pub use options::SpectOptions;
pub(crate) use plan::Plan;
pub(crate) use run::Scratch;
