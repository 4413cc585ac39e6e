//! SPECT: projections of a volume with attenuation and depth-dependent resolution.

mod attenuation;
mod axial;
mod blur;
mod collimator;
mod geometry;
mod nodes;
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
use plan::Plan;
use run::Scratch;
