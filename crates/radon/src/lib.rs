//! Parallel-beam tomography on a CPU: projectors with exact adjoints, filtered back-projection, analytic test objects.

mod error;
mod geometry;
mod measure;
mod sample;

pub use error::RadonError;
pub use geometry::{ArcPolicy, ImageGrid, ParallelGeometry, StackOrder};
pub use measure::{MaskedStats, disc_mask, rmse_within};
pub use sample::Sample;
