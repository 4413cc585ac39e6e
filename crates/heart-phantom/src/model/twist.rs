//! Twist of the wall about its axis.

use crate::error::{PhantomError, check, check_count};
use std::f64::consts::TAU;

/// The material coordinate of the apex.
const APEX: f64 = 0.5;
/// Largest number of samples along a membrane.
const MOST_SAMPLES: usize = 1000;

/// Rotation of each material point of the wall about the axis: `tau(s, u) = (1 - u) tau_inner(s) + u tau_outer(s)`, radians,
/// positive from body y to body z (counter-clockwise seen from beyond the apex).
///
/// Both functions of s are piecewise linear between equally spaced samples from the base, s = 0, to the apex, s = 1/2. A twist
/// rotates every circle about the axis: surfaces, volumes, longitudinal and circumferential stretches do not change; shear is
/// added.
///
/// At end-systole the apex of a healthy ventricle is rotated by about 10 degrees counter-clockwise, its base by 3 degrees clockwise
/// (Russel et al. 2012, J Cardiovasc Magn Reson 14:49, doi:10.1186/1532-429X-14-49).
///
/// ```
/// use heart_phantom::Twist;
/// let systole = Twist::sampled(&[-3.0, 10.0], &[-3.0, 8.0])?; // degrees: base and apex, inner and outer
/// assert!((systole.angle(0.0, 0.25).to_degrees() - 3.5).abs() < 1e-12);
/// assert!((systole.angle(1.0, 0.5).to_degrees() - 8.0).abs() < 1e-12);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[doc(alias = "torsion")]
#[derive(Debug, Clone, PartialEq)]
pub struct Twist {
    /// Radians, from base to apex, for the inner and the outer membrane.
    samples: [Vec<f64>; 2],
}

impl Twist {
    /// A sampled twist: angles in degrees at equally spaced s from base to apex, both included, for the inner and the outer
    /// membrane. Two angles each give a linear twist.
    ///
    /// # Errors
    /// [`PhantomError::Count`] for fewer than two or more than 1000 samples; [`PhantomError::OutOfRange`] for an angle beyond a
    /// full turn.
    pub fn sampled(inner: &[f64], outer: &[f64]) -> Result<Self, PhantomError> {
        let radians = |degrees: &[f64]| {
            check_count("samples of the twist", degrees.len(), [2, MOST_SAMPLES])?;
            let angle = |angle: &f64| check("twist", angle.to_radians(), [-TAU, TAU]);
            degrees.iter().map(angle).collect::<Result<Vec<_>, _>>()
        };
        Ok(Self {
            samples: [radians(inner)?, radians(outer)?],
        })
    }

    /// Returns the twist with all angles multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let samples = (self.samples.each_ref()).map(|s| s.iter().map(|a| a * factor).collect());
        Self { samples }
    }

    /// Returns the angle in radians at a layer (0 inner, 1 outer membrane) and a material coordinate s, both clamped to the wall.
    #[must_use]
    pub fn angle(&self, layer: f64, s: f64) -> f64 {
        let layer = layer.clamp(0.0, 1.0);
        let [inner, outer] = self.samples.each_ref().map(|s_k| along(s_k, s)[0]);
        (1.0 - layer) * inner + layer * outer
    }

    /// Returns the derivatives of the angle with respect to layer and s.
    pub(super) fn rates(&self, layer: f64, s: f64) -> [f64; 2] {
        let [inner, outer] = self.samples.each_ref().map(|s_k| along(s_k, s));
        [
            outer[0] - inner[0],
            (1.0 - layer) * inner[1] + layer * outer[1],
        ]
    }

    /// Returns the rotation of the apex relative to the base in degrees, averaged over both membranes.
    pub(crate) fn base_to_apex(&self) -> f64 {
        (self.angle(0.5, APEX) - self.angle(0.5, 0.0)).to_degrees()
    }
}

/// Returns value and slope at s for equally spaced samples from base to apex.
fn along(samples: &[f64], s: f64) -> [f64; 2] {
    let n = (samples.len() - 1) as f64;
    let at = (s / APEX).clamp(0.0, 1.0) * n;
    let k = (at as usize).min(samples.len() - 2);
    let step = samples[k + 1] - samples[k];
    [samples[k] + (at - k as f64) * step, step * n / APEX]
}
