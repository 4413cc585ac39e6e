//! Elastic membranes of revolution under pressure: rest shapes, forces and exact tangents.

mod band;
mod chebyshev;
mod closed_form;
mod crossing;
mod curve;
mod differences;
mod error;
mod linear_equilibrium;
mod measures;
mod membrane;
mod rest;
mod spectral;
mod spectral_measures;
mod stiffness;

pub use band::BandMatrix;
pub use closed_form::{CircleEquilibrium, balloon_at_rest};
pub use curve::CurvePiece;
pub use differences::FiniteDifferences;
pub use error::MembraneError;
pub use linear_equilibrium::LinearEquilibrium;
pub use measures::{Measure, Measures};
pub use membrane::{Membrane, PressureLaw};
pub use rest::{CurvePoint, RestShape};
pub use spectral::SpectralElements;
pub use stiffness::Stiffness;
