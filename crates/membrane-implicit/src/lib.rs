//! Implicit time integration of elastic membranes with an energy balance.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! A membrane has N nodes and fixed ends. Forces are per unit s; a dot is d/dt. The energy terms ([`Energy`]) balance to rounding error.
//!
#![doc = include_str!("../img/equations.html")]
//!
//! c(s, t) (cm) is the curve in the plane of its axis, F_e the elastic force, n the exterior normal, scaled as the [`PressureLaw`] defines,
//! f the force intensity, S the surface area (cm^2), V the enclosed volume (cm^3), m the mass and mu the damping per unit s.
//!
//! # Conventions
//! The feature `serde` implements serialisation of options, energies and counters.
//! Lengths are in centimetres, times in seconds. Nodes run from s = 0 at (0, +R) over the apex to s = 1 at (0, -R); x
//! is the axis. Norms over s are (integral of |.|^2 ds)^(1/2), so that they do not grow with N.
//!
//! # Limits
//! No fluid dynamics: the water transmits pressure instantly and has no inertia. The coupling of a pair is one-way: the outer membrane
//! follows the volume of the inner one without reaction.
//!
//! # References
//! Rohmer, Sitek and Gullberg 2006 (hal-03929238), section 3.2. TR-BDF2: Bank et al., IEEE Trans. CAD 4 (1985) 436-451; Hosea and Shampine,
//! Appl. Numer. Math. 20 (1996) 21-37. Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, IV.12 and VII.

mod body;
mod constraint;
mod energy;
mod error;
mod evolving;
mod kinematics;
mod load;
mod method;
mod motion;
mod mover;
mod report;
mod scheme;

pub use body::{Body, LoadState};
pub use error::ImplicitError;
pub use evolving::{EvolvingOptions, evolve, evolve_observed};
pub use load::{Feedback, Load};
pub use membrane_newton::{
    self, DiscreteMembrane, Measure, Measures, Membrane, MembraneError, PressureLaw,
    ReferenceShape, Rubber, Stiffness, StrainEnergy, Thickness,
};
pub use motion::{Motion, State, Stop, TimeStep, Tolerance};
pub use report::{Energy, Evolution, Frame, Work};
pub use scheme::{Jacobian, LoadKind, Scheme};
