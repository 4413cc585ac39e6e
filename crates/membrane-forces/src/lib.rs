//! Elastic membranes of revolution under pressure: reference configurations, forces, exact tangent stiffness matrices, lengths,
//! areas and volumes.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! A membrane is a plane curve c(s) = (x, y) with the material coordinate s in [0, 1], revolved about the x axis. Elastic forces act
//! towards its reference configuration c0, the pressure acts along the exterior normal n. Both ends c(0) and c(1) are fixed:
//!
#![doc = include_str!("../img/equations.html")]
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | s | material coordinate | 1 |
//! | c, c0 | current and reference curve | cm |
//! | lambda | stiffness | force per unit s and cm |
//! | f | force intensity: force per unit of the material coordinate s | force per unit s |
//! | F | total force, f = F / S(c) with the surface area S | unit of f times cm^2 |
//! | p | force per unit of current length, f = p abs(c') | unit of f divided by cm |
//!
#![doc = include_str!("../img/body.svg")]
//!
//! Lengths are in centimetres. Curves run from (0, +R) over the apex to (0, -R). State vectors are x0, y0, x1, y1, ... Forces are per unit s;
//! elastic force F_e plus pressure force F_p vanish at equilibrium. Only [`Rubber`] has circumferential tension; its forces are nodal forces.
//! Not included: solvers (`membrane-newton`), motion (`membrane-implicit`), bending and gravity. The feature `serde` implements
//! serialisation of [`PressureLaw`] and [`StrainEnergy`].
//!
//! Reference: Rohmer, Sitek, Gullberg, Simulation of the Beating Heart Based on Physically
//! Modeling a Deformable Balloon, 2006, hal-03929238, with its misprints corrected.

mod band;
mod chebyshev;
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
mod shared;
mod spectral;
mod spectral_measures;
mod springs;
mod strain_energy;
mod tangent;

pub use band::BandMatrix;
pub use crossing::collapse;
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
