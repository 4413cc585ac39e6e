//! Models and accuracy of a SPECT operator.

use super::collimator::Collimator;

/// Options of a [`SpectOperator`](crate::SpectOperator).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct SpectOptions<T> {
    /// The depth-dependent resolution.
    pub collimator: Collimator,
    /// Attenuation coefficients (1/cm) of the voxels, `[layer][y][x]`, 0.15 for water at 140 keV; empty for none.
    pub attenuation: Vec<T>,
    /// Largest deviation of the image of a point from the discrete normal distribution ([`gaussian_filter`](crate::gaussian_filter)) with the
    /// mean variance over the depth h of its plane, sigma(d)^2 + slope^2 h^2 / 12, relative to the peak; from 1e-6 to 0.1. The variance is
    /// exact at any tolerance; voxels and bins add to it ([`SpectOperator`](crate::SpectOperator)).
    pub tolerance: f64,
}

impl<T> Default for SpectOptions<T> {
    /// No blur, no attenuation, a tolerance of 1e-3.
    fn default() -> Self {
        Self {
            collimator: Collimator::default(),
            attenuation: Vec::new(),
            tolerance: 1e-3,
        }
    }
}

impl<T> SpectOptions<T> {
    setters! {
        /// Sets the collimator.
        with_collimator(collimator: Collimator);
        /// Sets the attenuation map.
        with_attenuation(attenuation: Vec<T>);
        /// Sets the tolerance.
        with_tolerance(tolerance: f64);
    }
}
