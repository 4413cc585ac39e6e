//! A beating heart phantom with exact ground truth.

mod acquire;
mod camera;
mod cycle;
mod error;
#[cfg(feature = "figures")]
pub mod figures;
pub mod files;
mod heart;
#[cfg(feature = "figures")]
pub mod study;
mod truth;

pub use acquire::{Acquisition, Sinograms, acquire};
pub use camera::Camera;
pub use cycle::Cycle;
pub use error::PhantomError;
pub use heart::{Balloon, Heart, HeartShape};
pub use truth::{Measures, Regions, truth};
