//! A beating heart phantom with exact ground truth.

mod cycle;
mod error;
#[cfg(feature = "figures")]
pub mod figures;
pub mod files;

pub use cycle::Cycle;
pub use error::PhantomError;
