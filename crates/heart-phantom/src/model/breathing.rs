//! Respiratory motion of the heart: a rigid motion that depends on the respiratory position, a periodic function of time.

use super::volume_curve::{Height, VolumeCurve};
use crate::PhantomError;
use crate::scene::{Check, array_of, exactly};
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{Pose, RevolveError};

/// Allowed numbers of respiratory gates.
const GATES: [usize; 2] = [1, 100];

/// The respiratory position over phase: 0 at end-expiration, 1 at end-inspiration.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum BreathingCurve {
    /// `(1 - cos 2 pi p) / 2`.
    Sinusoid,
    /// `sin(pi p)^(2 n)`: a larger n extends end-expiration; n = 1 is the sinusoid.
    ///
    /// The curve of Lujan, Larsen, Balter and Ten Haken 1999 (Med Phys 26:715, <https://doi.org/10.1118/1.598577>), `z = z0 - b
    /// cos(pi t / tau - phi)^(2 n)` with z0 the position at end-expiration, as quoted by later work; the paper was not read.
    Lujan {
        /// n, 1 to 20; typically 2 or 3.
        n: usize,
    },
    /// Samples at equally spaced phases from 0, in any unit: the smallest becomes 0, the largest 1. Interpolation by the monotone
    /// cubic of [`VolumeCurve::Sampled`].
    Sampled(Vec<f64>),
}

/// The definition of respiratory gates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RespiratoryGates {
    /// Equal intervals of the respiratory phase, from end-expiration.
    Phase(usize),
    /// Equal intervals of the respiratory position, for both inspiration and expiration.
    Amplitude(usize),
}

impl RespiratoryGates {
    /// Returns their number.
    pub(crate) fn count(self) -> usize {
        let (Self::Phase(n) | Self::Amplitude(n)) = self;
        n
    }
}

/// `[breathing]`: rigid respiratory motion of the heart. The surroundings do not move.
///
/// At the respiratory position r the heart is rotated by `r rotation_degrees` about the axes x, y and z of the lab, in this order and
/// about its origin, then shifted by `r shift`. r follows [`BreathingCurve`] with the given period, from the phase at the start of
/// the first view. Typically the diaphragm displaces the heart by 1 to 2 cm towards the feet.
#[doc(alias("respiratory motion", "respiratory gating"))]
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Breathing {
    /// Shift at end-inspiration, `[x, y, z]` in cm.
    #[serde(deserialize_with = "exactly")]
    pub shift: [f64; 3],
    /// Rotation at end-inspiration about the lab's x, then y, then z, in degrees.
    #[serde(deserialize_with = "exactly")]
    pub rotation_degrees: [f64; 3],
    /// Seconds of a respiratory cycle.
    pub period: f64,
    /// Respiratory position over phase.
    pub curve: BreathingCurve,
    /// Respiratory phase at the start of the first view; 0 is end-expiration.
    pub start: f64,
    /// Respiratory gates; `None` for none. Gated projection set `k G + g` of a scan with G cardiac gates is cardiac gate g in
    /// respiratory gate k.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gates: Option<RespiratoryGates>,
}

impl Default for Breathing {
    fn default() -> Self {
        Self {
            shift: [0.0; 3],
            rotation_degrees: [0.0; 3],
            period: 4.0,
            curve: BreathingCurve::Sinusoid,
            start: 0.0,
            gates: None,
        }
    }
}

impl Breathing {
    pub(crate) fn check(&self, c: &mut Check) {
        c.all_within("shift", &self.shift, [-100.0, 100.0]);
        c.all_within("rotation_degrees", &self.rotation_degrees, [-180.0, 180.0]);
        c.within("period", self.period, [0.1, 1e3]);
        c.within("start", self.start, [0.0, 1.0]);
        match &self.curve {
            BreathingCurve::Sinusoid => {}
            BreathingCurve::Lujan { n } => c.count("curve.lujan.n", *n, [1, 20]),
            BreathingCurve::Sampled(samples) => {
                if let Err(error) = self.curve.height() {
                    c.fault("curve.sampled", array_of(samples.len()), error.to_string());
                }
            }
        }
        match self.gates {
            None => {}
            Some(RespiratoryGates::Phase(n)) => c.count("gates.phase", n, GATES),
            Some(RespiratoryGates::Amplitude(n)) => c.count("gates.amplitude", n, GATES),
        }
    }
}

impl BreathingCurve {
    fn height(&self) -> Result<Height, PhantomError> {
        match self {
            Self::Sinusoid => Ok(Height::Sinusoid),
            Self::Lujan { n } => Ok(Height::Power(*n as i32)),
            Self::Sampled(samples) => Height::new(&VolumeCurve::Sampled(samples.clone()), 60.0),
        }
    }
}

/// Respiratory motion with its curve prepared for evaluation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RespiratoryMotion {
    of: Breathing,
    curve: Height,
}

impl RespiratoryMotion {
    /// Prepares validated breathing.
    pub(crate) fn new(of: &Breathing) -> Result<Self, PhantomError> {
        Ok(Self {
            of: of.clone(),
            curve: of.curve.height()?,
        })
    }

    /// Returns its parameters.
    pub(crate) fn breathing(&self) -> &Breathing {
        &self.of
    }

    /// Returns the respiratory position at a time in seconds: 0 at end-expiration, 1 at end-inspiration.
    pub(crate) fn fraction(&self, seconds: f64) -> f64 {
        self.at_phase(self.breaths(seconds).rem_euclid(1.0))
    }

    /// Returns the pose at a respiratory position of a body with the given pose at end-expiration.
    pub(crate) fn moved(&self, pose: &Pose, fraction: f64) -> Result<Pose, RevolveError> {
        if fraction == 0.0 {
            return Ok(*pose);
        }
        let [x, y, z] = self.turn().map(|angle| angle * fraction);
        pose.rotated_x(x)?
            .rotated_y(y)?
            .rotated_z(z)?
            .shifted(Vector3::from(self.of.shift) * fraction)
    }

    /// Returns whether it has an effect.
    pub(crate) fn moves(&self) -> bool {
        (self.of.shift.iter().chain(&self.of.rotation_degrees)).any(|by| *by != 0.0)
    }

    /// Rotation at end-inspiration about x, y and z, radians.
    pub(crate) fn turn(&self) -> [f64; 3] {
        self.of.rotation_degrees.map(f64::to_radians)
    }

    /// Respiratory cycles since the end-expiration before the start of the first view.
    pub(crate) fn breaths(&self, seconds: f64) -> f64 {
        seconds / self.of.period + self.of.start
    }

    /// Returns the time after a number of respiratory cycles.
    pub(crate) fn time_of(&self, breaths: f64) -> f64 {
        (breaths - self.of.start) * self.of.period
    }

    /// Returns the position at a phase in [0, 1].
    pub(crate) fn at_phase(&self, phase: f64) -> f64 {
        self.curve.at(phase)
    }

    /// The curve over phase 0 to 1.
    pub(crate) fn curve(&self) -> &Height {
        &self.curve
    }
}
