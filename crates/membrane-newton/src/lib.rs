//! Newton solver for inflated membranes: banded and bordered systems in linear time, volume control.

mod banded;
mod control;
mod equilibrium;
mod error;
mod newton;
mod pair;

pub use banded::BandedLu;
pub use control::Control;
pub use equilibrium::{Discretisation, Equilibrium, Solver};
pub use error::NewtonError;
pub use membrane_forces::{
    self, BandMatrix, Measure, Measures, Membrane, MembraneError, PressureLaw, RestShape, Stiffness,
};
pub use newton::{LineSearch, NewtonOptions, NewtonReport, ResidualSystem, newton};
pub use pair::{Pair, PairEquilibrium};
