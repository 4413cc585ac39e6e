//! How breathing moves the heart: a rigid motion that depends on one number, which runs through a curve once a breath.

use super::volume_curve::{Height, VolumeCurve};
use crate::PhantomError;
#[cfg(feature = "scene")]
use crate::scene::exactly;
use crate::scene::{Check, array_of};
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{Pose, RevolveError};

/// Numbers of respiratory gates.
const GATES: [usize; 2] = [1, 100];

/// How far the breath has come, over a breath: 0 at end-expiration, 1 at end-inspiration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum BreathingCurve {
    /// `(1 - cos 2 pi p) / 2`.
    Sinusoid,
    /// `sin(pi p)^(2 n)`: the heart stays near end-expiration the longer, the larger n; 1 is the sinusoid.
    ///
    /// It is the curve of Lujan, Larsen, Balter and Ten Haken 1999 (Med Phys 26:715, <https://doi.org/10.1118/1.598577>),
    /// `z = z0 - b cos(pi t / tau - phi)^(2 n)` with z0 the place at end-expiration, as later work quotes it; the paper itself was not
    /// read.
    Lujan {
        /// n, 1 to 20; 2 or 3 as a rule.
        n: usize,
    },
    /// Samples at equally spaced phases from 0 on, in any unit: the least becomes 0, the largest 1, and between them runs the monotone
    /// cubic of [`VolumeCurve::Sampled`].
    Sampled(Vec<f64>),
}

/// What sorts the time of a view by breath.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum RespiratoryGates {
    /// So many equal parts of every breath, from end-expiration on.
    Phase(usize),
    /// So many equal parts of the way between end-expiration and end-inspiration, on the way in and on the way out.
    Amplitude(usize),
}

impl RespiratoryGates {
    /// How many.
    pub fn count(self) -> usize {
        let (Self::Phase(n) | Self::Amplitude(n)) = self;
        n
    }
}

/// `[breathing]`: a rigid motion of the heart with the breath. What is around the heart does not move.
///
/// At the fraction r of the way from end-expiration to end-inspiration the heart is turned by `r turn` about the lab's axes x, y and
/// z, in this order and about the lab's origin, and then shifted by `r shift`. r runs through [`BreathingCurve`] once a period, from the
/// phase at the start of the first view. The diaphragm takes the heart 1 to 2 cm towards the feet as a rule.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct Breathing {
    /// Shift at end-inspiration, `[x, y, z]` in cm.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub shift: [f64; 3],
    /// Turn at end-inspiration about the lab's x, then y, then z, in degrees.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub turn_degrees: [f64; 3],
    /// Seconds of a respiratory cycle.
    pub period: f64,
    /// Fraction of the way over the respiratory cycle.
    pub curve: BreathingCurve,
    /// Respiratory phase at the start of the first view; 0 is end-expiration.
    pub start: f64,
    /// Respiratory gates; `None` for none. Set `k G + g` of a scan with G cardiac gates is the cardiac gate g in the respiratory gate k.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub gates: Option<RespiratoryGates>,
}

impl Default for Breathing {
    fn default() -> Self {
        Self {
            shift: [0.0; 3],
            turn_degrees: [0.0; 3],
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
        c.all_within("turn_degrees", &self.turn_degrees, [-180.0, 180.0]);
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

/// Breathing with its curve made ready.
///
/// ```
/// use heart_phantom::{Breathing, BreathingCurve, Phantom, Scene};
/// // 2 cm towards -z in 4 seconds and back, long at end-expiration.
/// let curve = BreathingCurve::Lujan { n: 3 };
/// let breathing = Breathing { shift: [0.0, 0.3, -2.0], curve, ..Breathing::default() };
/// let scene = Scene { breathing: Some(breathing), ..Scene::default().with_size(16) };
/// let phantom = Phantom::new(scene)?;
/// let breathing = phantom.cycle().breathing().unwrap();
/// assert_eq!(breathing.fraction(0.0), 0.0);
/// assert!((breathing.fraction(2.0) - 1.0).abs() < 1e-15);
/// assert!((breathing.fraction(1.0) - 0.125).abs() < 1e-15);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RespiratoryMotion {
    of: Breathing,
    curve: Height,
}

impl RespiratoryMotion {
    /// Of breathing that was validated.
    pub(crate) fn new(of: &Breathing) -> Result<Self, PhantomError> {
        Ok(Self {
            of: of.clone(),
            curve: of.curve.height()?,
        })
    }

    /// What it was made of.
    pub fn breathing(&self) -> &Breathing {
        &self.of
    }

    /// How far the breath has come at a time in seconds: 0 at end-expiration, 1 at end-inspiration.
    pub fn fraction(&self, seconds: f64) -> f64 {
        self.at_phase(self.breaths(seconds).rem_euclid(1.0))
    }

    /// The motion of a body that stands so at end-expiration.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for a fraction that is no number.
    pub fn moved(&self, pose: &Pose, fraction: f64) -> Result<Pose, RevolveError> {
        if fraction == 0.0 {
            return Ok(*pose);
        }
        let [x, y, z] = self.turn().map(|angle| angle * fraction);
        pose.turned_x(x)?
            .turned_y(y)?
            .turned_z(z)?
            .shifted(Vector3::from(self.of.shift) * fraction)
    }

    /// Whether it moves anything.
    pub(crate) fn moves(&self) -> bool {
        (self.of.shift.iter().chain(&self.of.turn_degrees)).any(|by| *by != 0.0)
    }

    /// Turn at end-inspiration, about x, y and z in radians.
    pub(crate) fn turn(&self) -> [f64; 3] {
        self.of.turn_degrees.map(f64::to_radians)
    }

    /// Breaths since the end-expiration before the start of the first view.
    pub(crate) fn breaths(&self, seconds: f64) -> f64 {
        seconds / self.of.period + self.of.start
    }

    /// When so many breaths have passed.
    pub(crate) fn time_of(&self, breaths: f64) -> f64 {
        (breaths - self.of.start) * self.of.period
    }

    /// The fraction at a phase in [0, 1].
    pub(crate) fn at_phase(&self, phase: f64) -> f64 {
        self.curve.at(phase)
    }

    /// The curve, a breath from phase 0 to 1.
    pub(crate) fn curve(&self) -> &Height {
        &self.curve
    }
}
