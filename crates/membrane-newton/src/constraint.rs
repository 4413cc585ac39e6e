//! The prescribed quantity of a static solve, and its equation.

use membrane_forces::{DiscreteMembrane, LoadKind, Measure, Measures, MembraneError};

use crate::error::{NewtonError, Result};

/// The prescribed quantity; the force intensity that belongs to it is part of the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Control {
    /// The load of the membrane's law: f, F or p.
    Load(f64),
    /// Force intensity, f or p, under any law (under the total-force law: F / S).
    Intensity(f64),
    /// Total force, intensity times the lateral surface of revolution, under any law.
    TotalForce(f64),
    /// Enclosed volume of revolution, cm^3.
    Volume(f64),
    /// Volume relative to that of the start (reference configuration with its ends fixed), minus one: 0.6 is 60 % more.
    VolumeGain(f64),
    /// Signed area of the 2-D curve, cm^2.
    Area(f64),
}

/// The border equation g(c, f) = 0.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Constraint {
    Intensity(f64),
    TotalForce(f64),
    Measure(Measure, f64),
}

impl Constraint {
    /// Returns the equation of `control`, after checking its range.
    pub(crate) fn new(
        control: Control,
        discrete: &dyn DiscreteMembrane,
        start: &Measures,
    ) -> Result<Self> {
        let any = f64::NEG_INFINITY;
        Ok(match control {
            Control::Load(value) => {
                let value = check("load", value, any)?;
                match discrete.law().load_kind() {
                    LoadKind::Intensity => Self::intensity(value, discrete)?,
                    LoadKind::TotalForce => Self::TotalForce(value),
                }
            }
            Control::Intensity(value) => {
                Self::intensity(check("intensity", value, any)?, discrete)?
            }
            Control::TotalForce(value) => Self::TotalForce(check("total force", value, any)?),
            Control::Volume(value) => Self::Measure(Measure::Volume, check("volume", value, 0.0)?),
            Control::VolumeGain(value) => {
                let rest = check("volume of the start", start.volume, 0.0)?;
                Self::Measure(
                    Measure::Volume,
                    rest * (1.0 + check("volume gain", value, -1.0)?),
                )
            }
            Control::Area(value) => Self::Measure(Measure::Area, check("area", value, any)?),
        })
    }

    fn intensity(value: f64, discrete: &dyn DiscreteMembrane) -> Result<Self> {
        let limit = discrete.blow_up();
        if value.abs() >= limit {
            return Err(NewtonError::Membrane(MembraneError::PastBlowUp {
                pressure: value,
                limit,
            }));
        }
        Ok(Self::Intensity(value))
    }

    /// Returns the prescribed number.
    pub(crate) fn value(&self) -> f64 {
        match *self {
            Self::Intensity(value) | Self::TotalForce(value) | Self::Measure(_, value) => value,
        }
    }

    /// Replaces the prescribed number.
    pub(crate) fn with_value(self, value: f64) -> Self {
        match self {
            Self::Intensity(_) => Self::Intensity(value),
            Self::TotalForce(_) => Self::TotalForce(value),
            Self::Measure(measure, _) => Self::Measure(measure, value),
        }
    }
}

/// Returns `value` if it is finite and exceeds `above`.
pub(crate) fn check(what: &'static str, given: f64, above: f64) -> Result<f64> {
    if given.is_finite() && given > above {
        Ok(given)
    } else {
        Err(NewtonError::OutOfRange { what, given, above })
    }
}
