//! Newton solver for inflated membranes: banded and bordered systems in linear time, volume control.

mod banded;
mod border;
mod bordered;
mod condensed;
mod continuation;
mod control;
mod discrete;
mod equilibrium;
mod error;
mod newton;
mod options;
mod pair;
mod plan;
mod sensitivity;
mod solver;
mod study;

pub use banded::BandedLu;
pub use border::Border;
pub use control::Control;
pub use equilibrium::Equilibrium;
pub use error::NewtonError;
pub use membrane_forces::{
    self, BandMatrix, CurvePiece, CurvePoint, Measure, Measures, Membrane, MembraneError,
    PressureLaw, RestShape, Stiffness,
};
pub use newton::{NewtonScratch, ResidualSystem, newton, newton_with};
pub use options::{LineSearch, NewtonOptions, NewtonReport};
pub use pair::{Pair, PairEquilibrium};
pub use sensitivity::Sensitivity;
pub use solver::{Discretisation, Solver};
pub use study::{PaperJacobian, paper_newton};
