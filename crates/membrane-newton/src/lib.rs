//! Newton solver for inflated membranes: any control, either discretisation, in linear time.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! The unknowns are the curve c and its force intensity f; one equation g for the prescribed
//! quantity borders the equilibrium, and Newton solves
//!
#![doc = include_str!("../img/equations.html")]
//!
//! by block elimination around a banded (finite differences) or condensed (spectral elements)
//! factorisation. Lengths are cm, volumes cm^3; norms are free of units.
//!
//! Convergence: a full step is tested by the correction that would follow it with the same factorisation (natural monotonicity, Deuflhard
//! 2004); if Newton fails from the start the control is raised in steps; where the branch of equilibria turns back the error contains the
//! last value reached. Choice of the equilibrium: with variable stiffness there may be a largest load, and above some hundred times lambda
//! R there are equilibria with loops, which cross themselves. The result is the one that inflation reaches: the bordered determinant has
//! the sign of the start and the curve turns through at most a full circle, or it was reached in steps limited by the rates of change at
//! their ends. (These conditions are necessary, not sufficient.) If membrane and ends are mirror images, so is the result.
//!
//! The feature `serde` gives options and reports a form in files.
//!
//! Limits: not a general nonlinear solver library, though [`newton`] takes any [`ResidualSystem`]; no time dependence.
//!
//! References: Rohmer, Sitek, Gullberg 2006 (hal-03929238); Deuflhard, Newton Methods for Nonlinear Problems, 2004,
//! doi:10.1007/978-3-642-23899-4; Trefethen, Spectral Methods in MATLAB, 2000, doi:10.1137/1.9780898719598.

mod banded;
mod block;
mod border;
mod branch;
mod cause;
mod constraint;
mod continuation;
mod equilibrium;
mod error;
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
mod pentadiagonal;
mod report;
mod resolution;
mod route;
mod sensitivity;
mod solver;
mod stability;
mod turning;

pub use banded::{BandedFactorisation, BandedLu};
pub use border::{Border, BorderElimination, dot_in_eight};
pub use branch::BranchPoint;
pub use constraint::Control;
pub use equilibrium::Equilibrium;
pub use error::{NewtonError, UserError};
pub use membrane_forces::{
    self, BandMatrix, CurvePiece, CurvePoint, DiscreteMembrane, Measure, Measures, Membrane,
    MembraneError, PressureLaw, ReferenceShape, Rubber, RubberState, Stiffness, StrainEnergy,
    Thickness,
};
pub use newton::{NewtonScratch, ResidualSystem, newton, newton_observed, newton_with};
pub use options::{LineSearch, NewtonOptions, Refactor};
pub use pair::{Pair, PairEquilibrium};
pub use pentadiagonal::PentadiagonalLdl;
pub use report::{NewtonReport, StopReason};
pub use sensitivity::Sensitivity;
pub use solver::{Discretisation, Solver};
pub use stability::{Modes, Stability};
