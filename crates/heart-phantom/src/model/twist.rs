//! Twist of the wall about its axis.

use crate::scene::{Check, array_of};

/// The material coordinate of the apex.
pub(super) const APEX: f64 = 0.5;
/// Allowed numbers of samples along a membrane.
const SAMPLES: [usize; 2] = [2, 1000];

/// `[twist]`: rotation of the wall about its axis at end-systole, positive from body y to body z (counter-clockwise seen from beyond the
/// apex): `tau(s, u) = (1 - u) tau_inner(s) + u tau_outer(s)`.
///
/// Both functions of s are piecewise linear between two or more equally spaced samples from the base, s = 0, to the apex, s = 1/2, both
/// included. A twist rotates every circle about the axis: surfaces, volumes, longitudinal and circumferential stretches do not change; shear
/// is added.
///
/// At end-systole the apex of a healthy ventricle is rotated by about 10 degrees counter-clockwise, its base by 3 degrees clockwise
/// (Russel et al. 2012, J Cardiovasc Magn Reson 14:49, doi:10.1186/1532-429X-14-49).
///
/// ```
/// use heart_phantom::Twist;
/// let systole = Twist { inner_degrees: vec![-3.0, 10.0], outer_degrees: vec![-3.0, 8.0] }; // base and apex
/// assert!((systole.angle(0.0, 0.25).to_degrees() - 3.5).abs() < 1e-12);
/// assert!((systole.angle(1.0, 0.5).to_degrees() - 8.0).abs() < 1e-12);
/// ```
#[doc(alias = "torsion")]
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Twist {
    /// Rotation of the inner membrane in degrees, from base to apex.
    pub inner_degrees: Vec<f64>,
    /// Rotation of the outer membrane.
    pub outer_degrees: Vec<f64>,
}

impl Twist {
    pub(crate) fn check(&self, c: &mut Check) {
        for (name, samples) in [
            ("inner_degrees", &self.inner_degrees),
            ("outer_degrees", &self.outer_degrees),
        ] {
            c.all_within(name, samples, [-360.0, 360.0]);
            if !(SAMPLES[0]..=SAMPLES[1]).contains(&samples.len()) {
                let wanted = format!("must have between {} and {}", SAMPLES[0], SAMPLES[1]);
                c.fault(name, array_of(samples.len()), wanted);
            }
        }
    }

    /// Returns the twist with all angles multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let scaled = |degrees: &[f64]| degrees.iter().map(|angle| angle * factor).collect();
        Self {
            inner_degrees: scaled(&self.inner_degrees),
            outer_degrees: scaled(&self.outer_degrees),
        }
    }

    /// Returns the angle in radians at a layer (0 inner, 1 outer membrane) and a material coordinate s, both clamped to the wall.
    #[must_use]
    pub fn angle(&self, layer: f64, s: f64) -> f64 {
        let layer = layer.clamp(0.0, 1.0);
        let [[inner, _], [outer, _]] = self.along(s);
        (1.0 - layer) * inner + layer * outer
    }

    /// Returns the derivatives of the angle with respect to layer and s.
    pub(super) fn rates(&self, layer: f64, s: f64) -> [f64; 2] {
        let [inner, outer] = self.along(s);
        [
            outer[0] - inner[0],
            (1.0 - layer) * inner[1] + layer * outer[1],
        ]
    }

    /// Returns value and slope of both membranes at s.
    fn along(&self, s: f64) -> [[f64; 2]; 2] {
        [&self.inner_degrees, &self.outer_degrees].map(|degrees| along(degrees, s))
    }

    /// Returns the rotation of the apex relative to the base in degrees, averaged over both membranes.
    pub(crate) fn base_to_apex(&self) -> f64 {
        (self.angle(0.5, APEX) - self.angle(0.5, 0.0)).to_degrees()
    }
}

/// Returns value and slope in radians at s for equally spaced samples in degrees from base to apex; zero without samples.
fn along(degrees: &[f64], s: f64) -> [f64; 2] {
    let last = degrees.len().saturating_sub(1);
    let at = (s / APEX).clamp(0.0, 1.0) * last as f64;
    let k = (at as usize).min(last.saturating_sub(1));
    let [from, to] = [k, k + 1].map(|k| degrees.get(k.min(last)).map_or(0.0, |a| a.to_radians()));
    let step = to - from;
    [from + (at - k as f64) * step, step * last as f64 / APEX]
}
