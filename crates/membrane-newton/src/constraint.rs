//! The prescribed quantity of a static solve, and its equation.

use membrane_forces::{DiscreteMembrane, Measure, Measures, MembraneError};

use crate::error::{Result, own};
use crate::route::Route;

/// The prescribed quantity; the force intensity that belongs to it is part of the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Control {
    /// The load of the membrane's law: f, F or p; negative for suction.
    Load(f64),
    /// Force intensity, f or p, under any law (under the total-force law: F / S).
    Intensity(f64),
    /// Total force, intensity times the lateral surface of revolution, under any law.
    TotalForce(f64),
    /// Enclosed volume of revolution, cm^3; positive.
    Volume(f64),
    /// Volume relative to that of the start (reference configuration with its ends fixed), minus one: 0.6 is 60 % more. It is a fraction,
    /// not a percentage: 60.0 is 61 times the volume, and solved.
    VolumeGain(f64),
    /// Signed area of the 2-D curve, cm^2.
    Area(f64),
}

/// The quantity of a border equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Quantity {
    Intensity,
    TotalForce,
    Measure(Measure),
}

/// The border equation g(c, f) = 0: a quantity equals `value`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constraint {
    pub(crate) quantity: Quantity,
    pub(crate) value: f64,
}

impl Quantity {
    pub(crate) const VOLUME: Self = Self::Measure(Measure::Volume);

    /// Returns the name of the quantity of a membrane with this route, with its unit.
    pub(crate) fn name(self, route: Route) -> &'static str {
        match self {
            Self::Intensity if route == Route::Inflate => "pressure in the unit of the modulus",
            Self::Intensity => "force intensity in the unit of the pressure law",
            Self::TotalForce => "total force in the unit of the intensity times cm^2",
            Self::Measure(Measure::Length) => "length in cm",
            Self::Measure(Measure::Area) => "area in cm^2",
            Self::Measure(Measure::Surface) => "surface in cm^2",
            Self::Measure(Measure::Volume) => "volume in cm^3",
        }
    }

    /// Returns the quantity in state `x`, nodes and intensity.
    pub(crate) fn of(self, discrete: &dyn DiscreteMembrane, x: &[f64]) -> f64 {
        let (f, nodes) = (x[x.len() - 1], &x[..x.len() - 1]);
        let measure = |measure| own(discrete.measure(measure, nodes));
        match self {
            Self::Intensity => f,
            Self::TotalForce => f * measure(Measure::Surface),
            Self::Measure(of) => measure(of),
        }
    }
}

impl Constraint {
    pub(crate) fn volume(value: f64) -> Self {
        let quantity = Quantity::VOLUME;
        Self { quantity, value }
    }

    /// Returns the equation of `control`, after checking its range.
    pub(crate) fn new(
        control: Control,
        discrete: &dyn DiscreteMembrane,
        start: &Measures,
    ) -> Result<Self> {
        let any = f64::MIN;
        let (quantity, what, given, least) = match control {
            Control::Load(value) if discrete.law().is_total_force() => {
                (Quantity::TotalForce, "load", value, any)
            }
            Control::Load(value) => (Quantity::Intensity, "load", value, any),
            Control::Intensity(value) => (Quantity::Intensity, "intensity", value, any),
            Control::TotalForce(value) => (Quantity::TotalForce, "total force", value, any),
            Control::Volume(value) => (Quantity::VOLUME, "volume", value, POSITIVE),
            Control::VolumeGain(value) => {
                (Quantity::VOLUME, "volume gain", value, (-1f64).next_up())
            }
            Control::Area(value) => (Quantity::Measure(Measure::Area), "area", value, any),
        };
        let mut value = check(what, given, least)?;
        if let Control::VolumeGain(gain) = control {
            value = check("volume of the start", start.volume, POSITIVE)? * (1.0 + gain);
        }
        let (pressure, limit) = (value, discrete.blow_up());
        if quantity == Quantity::Intensity && value.abs() >= limit {
            return Err(MembraneError::PastBlowUp { pressure, limit }.into());
        }
        Ok(Self { quantity, value })
    }
}

/// The smallest positive number.
pub(crate) const POSITIVE: f64 = 0f64.next_up();

/// Returns `given` if it is finite and at least `least`.
pub(crate) fn check(what: &'static str, given: f64, least: f64) -> Result<f64> {
    Ok(MembraneError::within(what, given, least, f64::MAX)?)
}
