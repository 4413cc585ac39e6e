//! How breathing moves the heart: a rigid motion that depends on one number, which runs through a curve once a breath.

use super::volume_curve::{Height, VolumeCurve};
use crate::error::{PhantomError, check, check_count};
use crate::ranges;
use revolve_voxel::nalgebra::Vector3;
use revolve_voxel::{Pose, RevolveError};

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

/// A rigid motion of the heart with the breath, and nothing of what is around it.
///
/// At the fraction r of the way from end-expiration to end-inspiration the heart is turned by `r turn` about the lab's axes x, y and
/// z, in this order and about the lab's origin, and then shifted by `r shift`. r runs through [`BreathingCurve`] once a period, from the
/// phase at the start of the first view. The diaphragm takes the heart 1 to 2 cm towards the feet as a rule.
///
/// ```
/// use heart_phantom::{Breathing, BreathingCurve};
/// // 2 cm towards -z in 4 seconds and back, long at end-expiration.
/// let breathing = Breathing::new([0.0, 0.3, -2.0], 4.0, &BreathingCurve::Lujan { n: 3 })?;
/// assert_eq!(breathing.fraction(0.0), 0.0);
/// assert!((breathing.fraction(2.0) - 1.0).abs() < 1e-15);
/// assert!((breathing.fraction(1.0) - 0.125).abs() < 1e-15);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Breathing {
    shift: [f64; 3],
    turn: [f64; 3],
    period: f64,
    start: f64,
    curve: Height,
    gates: Option<RespiratoryGates>,
}

impl Breathing {
    /// A shift of `shift` cm at end-inspiration, `[x, y, z]` of the lab, once in `period` seconds; it begins at end-expiration.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a shift of more than 100 cm, a period outside 0.1 to 1000 s, samples without sense;
    /// [`PhantomError::Count`] for an exponent outside 1 to 20.
    pub fn new(shift: [f64; 3], period: f64, curve: &BreathingCurve) -> Result<Self, PhantomError> {
        for along in shift {
            check("shift by breathing", along, ranges::SHIFT)?;
        }
        Ok(Self {
            shift,
            turn: [0.0; 3],
            period: check("period of breathing", period, ranges::BREATHS)?,
            start: 0.0,
            curve: match curve {
                BreathingCurve::Sinusoid => Height::Sinusoid,
                BreathingCurve::Lujan { n } => {
                    Height::Power(
                        check_count("exponent of breathing", *n, ranges::EXPONENTS)? as i32
                    )
                }
                BreathingCurve::Sampled(samples) => {
                    Height::new(&VolumeCurve::Sampled(samples.clone()), 60.0)?
                }
            },
            gates: None,
        })
    }

    /// The same, turned by these angles in radians about the lab's axes at end-inspiration, before the shift.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for an angle of more than half a turn.
    pub fn with_turn(mut self, turn: [f64; 3]) -> Result<Self, PhantomError> {
        for about in turn {
            check("turn by breathing", about, ranges::TURN)?;
        }
        self.turn = turn;
        Ok(self)
    }

    /// The same, the first view beginning at this phase of the breath, 0 to 1; 0 is end-expiration.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] outside 0 to 1.
    pub fn with_start(mut self, phase: f64) -> Result<Self, PhantomError> {
        self.start = check("phase of the breath at the start", phase, [0.0, 1.0])?;
        Ok(self)
    }

    /// The same with one set of views for each respiratory gate: set `k G + g` of a scan with G cardiac gates is the cardiac gate g in
    /// the respiratory gate k.
    ///
    /// # Errors
    /// [`PhantomError::Count`] unless there are 1 to 100.
    pub fn with_gates(mut self, gates: RespiratoryGates) -> Result<Self, PhantomError> {
        check_count(
            "respiratory gates",
            gates.count(),
            ranges::RESPIRATORY_GATES,
        )?;
        self.gates = Some(gates);
        Ok(self)
    }

    /// What sorts views by breath.
    pub fn gates(&self) -> Option<RespiratoryGates> {
        self.gates
    }

    /// Seconds of a breath.
    pub fn period(&self) -> f64 {
        self.period
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
        let [x, y, z] = self.turn.map(|angle| angle * fraction);
        pose.turned_x(x)?
            .turned_y(y)?
            .turned_z(z)?
            .shifted(Vector3::from(self.shift) * fraction)
    }

    /// Whether it moves anything.
    pub(crate) fn moves(&self) -> bool {
        self.shift.iter().chain(&self.turn).any(|by| *by != 0.0)
    }

    /// Shift at end-inspiration, `[x, y, z]` in cm.
    pub fn shift(&self) -> [f64; 3] {
        self.shift
    }

    /// Turn at end-inspiration, about x, y and z in radians.
    pub fn turn(&self) -> [f64; 3] {
        self.turn
    }

    /// Breaths since the end-expiration before the start of the first view.
    pub(crate) fn breaths(&self, seconds: f64) -> f64 {
        seconds / self.period + self.start
    }

    /// When so many breaths have passed.
    pub(crate) fn time_of(&self, breaths: f64) -> f64 {
        (breaths - self.start) * self.period
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
