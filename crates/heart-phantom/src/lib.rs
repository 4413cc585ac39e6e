//! A beating heart phantom with exact ground truth.

mod cycle;
mod error;
pub mod files;

pub use cycle::Cycle;
pub use error::PhantomError;
