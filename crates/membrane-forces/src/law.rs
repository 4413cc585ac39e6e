//! Pressure laws: the conversion of a load to a force.
//!
//! Both discretisations and all solvers use this file, so that a law is defined in one place.

use crate::error::{MembraneError, Result};

/// The force per unit s that a load exerts; n is the unit exterior normal of the current curve.
///
/// Rohmer et al. 2006 use all three; they are different models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum PressureLaw {
    /// Force f n per unit of **material** length s (Eq. 3). The load is f.
    #[default]
    PerMaterialLength,
    /// Force (F / S(c)) n, S the lateral surface of revolution (Eq. 4). The load is F. Same
    /// shapes as the first law, with f = F / S found together with the shape.
    TotalForce,
    /// Force p |c'| n = p (-c_y', c_x'), constant per unit of **current** length (3.2.2, and physical pressure). The load is p.
    PerCurrentLength,
}

impl PressureLaw {
    /// Whether the load is the total force F, intensity times the lateral surface of revolution; otherwise it is the intensity, f or p.
    #[must_use]
    pub fn is_total_force(self) -> bool {
        match self {
            Self::PerMaterialLength | Self::PerCurrentLength => false,
            Self::TotalForce => true,
        }
    }

    /// Whether there is an intensity at which the curve runs to infinity.
    pub(crate) fn blows_up(self) -> bool {
        match self {
            Self::PerMaterialLength | Self::TotalForce => false,
            Self::PerCurrentLength => true,
        }
    }

    /// Intensity that moves a membrane of this stiffness by about its length: a force per unit s, or per unit of current length.
    pub(crate) fn intensity_scale(self, stiffness: f64, length: f64) -> f64 {
        match self {
            Self::PerMaterialLength | Self::TotalForce => stiffness * length,
            Self::PerCurrentLength => stiffness,
        }
    }

    /// Force per current area from the `intensity` (f or p), averaged over a curve of this `length`; NaN unless the length is positive.
    ///
    /// Under the total-force law the intensity is F / S, not the load F: a total force passed as `intensity` gives a result that is too large
    /// by the factor S.
    #[must_use]
    pub fn mean_pressure(self, intensity: f64, length: f64) -> f64 {
        if length.is_nan() || length <= 0.0 {
            return f64::NAN;
        }
        match self {
            Self::PerMaterialLength | Self::TotalForce => intensity / length,
            Self::PerCurrentLength => intensity,
        }
    }

    /// Returns the factor on `d`, the displacement along the curve per `ds`, that makes it the tangent of the law: the force is
    /// `intensity factor (-d_y, d_x)`.
    ///
    /// # Errors
    /// The displacement is zero and the law needs a direction; `index` is its index.
    #[inline]
    pub(crate) fn factor(self, d: [f64; 2], ds: f64, index: usize) -> Result<f64> {
        match self {
            Self::PerMaterialLength | Self::TotalForce => {
                let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
                if length > 0.0 {
                    Ok(1.0 / length)
                } else {
                    Err(MembraneError::CoincidentPoints { index })
                }
            }
            Self::PerCurrentLength => Ok(1.0 / ds),
        }
    }

    /// `out` = forces at `intensity` for displacements along the curve per `ds`. Returns whether all of them have a direction, if the law
    /// needs one (NaN has none).
    pub(crate) fn forces_into(
        self,
        intensity: f64,
        ways: impl Iterator<Item = [f64; 2]>,
        ds: f64,
        out: &mut [[f64; 2]],
    ) -> bool {
        match self {
            Self::PerMaterialLength | Self::TotalForce => {
                // Tested after the loop, which then has a single exit.
                let mut all_differ = true;
                for (out, d) in out.iter_mut().zip(ways) {
                    let square = d[0] * d[0] + d[1] * d[1];
                    all_differ &= square > 0.0;
                    let factor = intensity / square.sqrt();
                    *out = [-factor * d[1], factor * d[0]];
                }
                all_differ
            }
            Self::PerCurrentLength => {
                let factor = intensity * (1.0 / ds);
                for (out, d) in out.iter_mut().zip(ways) {
                    *out = [-factor * d[1], factor * d[0]];
                }
                true
            }
        }
    }

    /// Derivative of `f factor (-d_y, d_x)` by d, row by row, `factor` from [`PressureLaw::factor`].
    #[inline]
    pub(crate) fn derivative(self, f: f64, d: [f64; 2], factor: f64) -> [[f64; 2]; 2] {
        match self {
            // of n = (-d_y, d_x) / |d|
            Self::PerMaterialLength | Self::TotalForce => {
                let cube = factor * factor * factor;
                [
                    [f * d[0] * d[1] * cube, -f * (factor - d[1] * d[1] * cube)],
                    [f * (factor - d[0] * d[0] * cube), -f * d[0] * d[1] * cube],
                ]
            }
            // the plain rotation
            Self::PerCurrentLength => [[0.0, -f * factor], [f * factor, 0.0]],
        }
    }
}
