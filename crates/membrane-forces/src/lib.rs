//! Elastic membranes of revolution under pressure: reference configurations, forces, exact tangents, measures.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! A membrane is a plane curve c(s) = (x, y), s in [0, 1] material, that is revolved about the x axis. Springs pull it back to its
//! reference configuration c0, pressure pushes it out along the exterior normal n:
//!
#![doc = include_str!("../img/equations.html")]
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | s | material coordinate | 1 |
//! | c, c0 | current and reference curve | cm |
//! | lambda | stiffness | force per unit s and cm |
//! | f | force intensity, per unit of material length | force per unit s |
//! | F | total force, f = F / S(c) | f cm^2 |
//! | p | force per unit of current length, f = p abs(c') | f / cm |
//!
#![doc = include_str!("../img/body.svg")]
//!
//! Conventions: centimetres; curves run from (0, +R) over the apex to (0, -R); states are flat, x0, y0, x1, y1, ...; forces are per unit s,
//! F_e + F_p vanishes at equilibrium. Not included: solvers (`membrane-newton`) and motion (`membrane-implicit`); bending and gravity. Only
//! [`Rubber`] has tension around the axis; its forces are those at the nodes. The feature `serde` gives [`PressureLaw`] and
//! [`StrainEnergy`] names in files.
//!
//! Reference: Rohmer, Sitek, Gullberg, Simulation of the Beating Heart Based on Physically
//! Modeling a Deformable Balloon, 2006, hal-03929238, with its misprints corrected.

mod band;
mod chebyshev;
mod closed_form;
mod complex;
mod crossing;
mod curve;
mod differences;
mod discrete;
mod error;
mod law;
mod linear_equilibrium;
mod material;
mod measures;
mod membrane;
mod nodes;
mod profile;
mod reference;
mod rubber_energy;
mod rubber_nodes;
mod spectral;
mod spectral_measures;
mod springs;
mod strain_energy;
mod tangent;

pub use band::BandMatrix;
pub use closed_form::{CircleEquilibrium, balloon_measures};
pub use curve::CurvePiece;
pub use differences::FiniteDifferences;
pub use discrete::{DiscreteMembrane, Setting};
pub use error::MembraneError;
pub use law::PressureLaw;
pub use linear_equilibrium::LinearEquilibrium;
pub use material::{Material, Rubber};
pub use measures::{Measure, Measures};
pub use membrane::Membrane;
pub use profile::{OfStiffness, OfThickness, Profile, Quantity, Stiffness, Thickness};
pub use reference::{CurvePoint, ReferenceShape};
pub use spectral::SpectralElements;
pub use strain_energy::{EnergyDerivatives, RubberState, StrainEnergy};
pub use tangent::Tangent;
