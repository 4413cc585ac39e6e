//! Newton solver for inflated membranes in linear time, for prescribed pressure, force, volume or area.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! The unknowns are the curve c and its force intensity f. The equation g = 0 of the prescribed
//! quantity (the control) borders the equilibrium equations F = 0. Each Newton step solves
//!
#![doc = include_str!("../img/equations.html")]
//!
//! by block elimination with a banded (finite differences) or condensed (spectral elements)
//! factorisation. Lengths are in cm, volumes in cm^3; norms are dimensionless.
//!
//! Convergence: a step is accepted by the natural monotonicity test (Deuflhard 2004). If Newton does not converge from the reference
//! configuration, the control is increased in steps (continuation). At a limit point the error contains the last value reached. With variable
//! stiffness a limit load may exist. Above a force intensity of a few hundred lambda R (stiffness times base radius), additional equilibria
//! with self-intersecting curves exist for the same control value. The solver returns the equilibrium that inflation reaches. It accepts a
//! direct solution if the bordered determinant has the same sign as in the reference configuration and the curve turns through at most 2 pi.
//! These two conditions are necessary, not sufficient. If they do not hold, the solver follows the equilibria in continuation steps. A step
//! is halved if the rates of change of the shape at its two ends differ by more than a factor of 4, or if the change of the shape exceeds the
//! step times 1.5 times the larger rate. Mirror-symmetric membranes have symmetric solutions.
//!
//! The feature `serde` implements serialisation of controls, discretisations, options and reports.
//!
//! Limits: no time dependence; solves of membranes cannot be cancelled, those of other systems can ([`ResidualSystem::observe`]); not a general nonlinear solver library,
//! although [`newton`] accepts any [`ResidualSystem`].
//!
//! References: Rohmer, Sitek, Gullberg 2006 (hal-03929238); Deuflhard, Newton Methods for Nonlinear Problems, 2004,
//! doi:10.1007/978-3-642-23899-4; Trefethen, Spectral Methods in MATLAB, 2000, doi:10.1137/1.9780898719598.

mod banded;
mod block;
mod border;
mod constraint;
mod continuation;
mod equilibrium;
mod error;
mod estimate;
mod factors;
mod flat;
mod inertia;
mod inflation;
mod limit;
mod nested;
mod nested_system;
mod newton;
mod options;
mod pair;
mod report;
mod resolution;
mod route;
mod sensitivity;
mod solver;
mod stability;
mod turning;

pub use banded::BandedLu;
pub use border::{Border, dot_in_eight};
pub use constraint::Control;
pub use equilibrium::Equilibrium;
pub use error::{NewtonError, UserError};
pub use membrane_forces::{
    self, BandMatrix, CurvePiece, CurvePoint, DiscreteMembrane, Measure, Measures, Membrane,
    MembraneError, PressureLaw, ReferenceShape, Rubber, RubberState, Stiffness, StrainEnergy,
    Thickness,
};
pub use newton::{NewtonScratch, ResidualSystem, newton, newton_with};
pub use options::{LineSearch, NewtonOptions, Refactor};
pub use pair::{Pair, PairEquilibrium};
pub use report::{NewtonReport, StopReason};
pub use sensitivity::Sensitivity;
pub use solver::{Discretisation, Solver};
pub use stability::{Modes, Stability};
