//! Elastic membranes of revolution under pressure: rest shapes, forces and exact tangents.

mod band;
mod closed_form;
mod crossing;
mod differences;
mod error;
mod measures;
mod membrane;
mod rest;
mod stiffness;

pub use band::BandMatrix;
pub use closed_form::{CircleEquilibrium, balloon_at_rest};
pub use differences::FiniteDifferences;
pub use error::MembraneError;
pub use measures::{Measure, Measures};
pub use membrane::{Membrane, PressureLaw};
pub use rest::{CurvePoint, RestShape};
pub use stiffness::Stiffness;
