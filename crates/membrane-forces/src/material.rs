//! The material: springs or rubber.

use crate::error::{Result, positive};
use crate::profile::{Stiffness, Thickness};
use crate::strain_energy::StrainEnergy;

/// The material of a membrane.
#[derive(Debug, Clone, PartialEq)]
pub enum Material {
    /// The paper's springs: a force against the displacement, without hoop tension.
    Springs {
        /// lambda(s) between neighbours.
        stiffness: Stiffness,
        /// lambda_2(s) between second neighbours, if any.
        second: Option<Stiffness>,
    },
    /// Rubber, with tensions along the meridian and around the axis.
    Rubber(Rubber),
}

/// A sheet of incompressible rubber.
#[derive(Debug, Clone, PartialEq)]
pub struct Rubber {
    pub(crate) energy: StrainEnergy,
    pub(crate) thickness: Thickness,
}

impl Rubber {
    /// Creates a sheet of strain energy `energy` and reference thickness `thickness` (cm).
    ///
    /// # Errors
    /// Those of [`StrainEnergy::check`].
    pub fn new(energy: StrainEnergy, thickness: Thickness) -> Result<Self> {
        energy.check()?;
        Ok(Self { energy, thickness })
    }

    /// Returns the strain energy.
    #[must_use]
    pub fn energy(&self) -> &StrainEnergy {
        &self.energy
    }

    /// Returns the reference thickness.
    #[must_use]
    pub fn thickness(&self) -> &Thickness {
        &self.thickness
    }

    /// The distance from the axis of a reference curve that is at `y` at `s`; only the apex is on the axis.
    pub(crate) fn radius(&self, y: f64, s: f64) -> Result<f64> {
        let what = "distance of the reference curve of rubber from the axis";
        positive(what, if s > 0.5 { -y } else { y })
    }
}
