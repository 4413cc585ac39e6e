//! Compton scattering by free electrons (Klein and Nishina).
//!
//! With `a = E / 511 keV` and `x = E / E' = 1 + a (1 - cos)`:
//!
//! ```text
//! d sigma / d Omega = r^2 / 2 g(cos),   g = (x + 1/x - sin^2) / x^2,   r the classical electron radius
//! ```

use crate::Random;
use crate::error::{ScatterError, within};

/// Rest energy of the electron (keV, CODATA 2018).
const ELECTRON_KEV: f64 = 510.998_95;
/// Square of the classical electron radius (cm^2, CODATA 2018).
const RADIUS_SQUARED: f64 = 7.940_787_6e-26;

/// Compton scattering of photons of one energy by free electrons.
///
/// ```
/// use photon_scatter::Compton;
/// let compton = Compton::new(140.5)?;
/// assert!((compton.energy_at(0.0)? - 110.2).abs() < 0.05); // keV, at 90 degrees
/// assert!((compton.cross_section() / 4.52e-25 - 1.0).abs() < 0.01); // cm^2 per electron
/// # Ok::<(), photon_scatter::ScatterError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compton {
    energy: f64,
    alpha: f64,
    /// Two over the integral of g over the cosine.
    factor: f64,
}

impl Compton {
    /// Photons of this energy in keV.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] below 1 keV (energies in MeV) and above 100 MeV.
    pub fn new(energy: f64) -> Result<Self, ScatterError> {
        Ok(Self::of(within("energy in keV", energy, [1.0, 1e5])?))
    }

    pub(crate) fn of(energy: f64) -> Self {
        let alpha = energy / ELECTRON_KEV;
        Self {
            energy,
            alpha,
            factor: 2.0 / integral(alpha),
        }
    }

    /// Total cross-section of a free electron in cm^2.
    #[must_use]
    pub fn cross_section(&self) -> f64 {
        std::f64::consts::TAU * RADIUS_SQUARED / self.factor
    }

    /// Energy in keV after scattering by the angle of this cosine.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for a cosine outside -1 to 1 by more than rounding, such as an angle.
    pub fn energy_at(&self, cosine: f64) -> Result<f64, ScatterError> {
        Ok(self.towards(checked(cosine)?).0)
    }

    /// Probability of scattering into a direction, per solid angle, relative to isotropic scattering: `4 pi / sigma d sigma / d Omega`.
    ///
    /// # Errors
    /// As [`energy_at`](Self::energy_at).
    pub fn relative_density(&self, cosine: f64) -> Result<f64, ScatterError> {
        Ok(self.towards(checked(cosine)?).1)
    }

    /// Returns [`energy_at`](Self::energy_at) and [`relative_density`](Self::relative_density).
    #[inline]
    pub(crate) fn towards(&self, cosine: f64) -> (f64, f64) {
        let (ratio, kernel) = kernel(self.alpha, cosine);
        (self.energy * ratio, self.factor * kernel)
    }

    /// Draws the cosine of a scattering angle, by rejection from a uniform cosine.
    pub fn sample(&self, random: &mut Random) -> f64 {
        loop {
            let cosine = 2.0 * random.uniform() - 1.0;
            // g is largest, 2, for forward scattering.
            if 2.0 * random.uniform() < kernel(self.alpha, cosine).1 {
                return cosine;
            }
        }
    }
}

/// Returns a cosine without its rounding error.
fn checked(cosine: f64) -> Result<f64, ScatterError> {
    let near = cosine.clamp(-1.0, 1.0);
    match (cosine - near).abs() < 1e-9 {
        true => Ok(near),
        false => within("cosine of the scattering angle", cosine, [-1.0, 1.0]),
    }
}

/// Energy after scattering over that before, and g.
#[inline]
fn kernel(alpha: f64, cosine: f64) -> (f64, f64) {
    let x = 1.0 + alpha * (1.0 - cosine);
    let ratio = 1.0 / x;
    let sine_squared = (1.0 - cosine) * (1.0 + cosine);
    (ratio, (x + ratio - sine_squared) * ratio * ratio)
}

/// Integral of g over all cosines.
fn integral(alpha: f64) -> f64 {
    let (end, log) = (1.0 + 2.0 * alpha, (2.0 * alpha).ln_1p());
    let forward = (1.0 + alpha) / (alpha * alpha) * (2.0 * (1.0 + alpha) / end - log / alpha);
    2.0 * (forward + log / (2.0 * alpha) - (1.0 + 3.0 * alpha) / (end * end))
}
