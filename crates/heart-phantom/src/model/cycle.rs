//! The cardiac cycle: phase over time, volume gain over phase, and the respiratory motion.

use super::breathing::{Breathing, RespiratoryMotion};
use super::rhythm::{Beats, Rhythm};
use super::volume_curve::{Height, VolumeCurve};
use crate::error::{PhantomError, check};
use crate::ranges::GAIN;
use revolve_voxel::Pose;
use std::sync::Arc;

/// Phases are rounded to a grid of `2^-40` of a cycle, so that times that differ by whole cycles have identical phases despite
/// rounding of `t * bpm / 60`. At 65 beats per minute the grid is 0.8 ps wide.
const PHASE_GRID: f64 = (1u64 << 40) as f64;

/// A periodic cardiac cycle: a heart rate and a volume curve.
///
/// The volume gain of the cavity (Rohmer et al. 2006, Eq. 35: `(V - V_ref) / V_ref`) at phase `p` is `g_low + (g_high - g_low)
/// h(p)` with the [`VolumeCurve`] `h`. That of the study is the sinusoid from the reference volume at phase 0 to the
/// peak gain at phase 1/2.
///
/// ```
/// use heart_phantom::{Cycle, VolumeCurve};
/// let cycle = Cycle::new(65.0, &VolumeCurve::Sinusoid, [0.0, 0.6])?;
/// assert_eq!(cycle.gain(0.0), 0.0);
/// assert!((cycle.gain(0.5) - 0.6).abs() < 1e-15);
/// // Views one second apart have twelve phases only: 65 beats per minute are 13/12 beats per second.
/// assert_eq!(cycle.phase(0.0), cycle.phase(12.0));
/// // A ventricle instead: its volume is largest at phase 0 and smallest at aortic closure.
/// let cycle = Cycle::new(65.0, &VolumeCurve::Physiological, [0.0, 0.6])?;
/// assert_eq!((cycle.gain(0.0), cycle.gain(0.46)), (0.6, 0.0));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    beats_per_minute: f64,
    gains: [f64; 2],
    height: Height,
    /// Variable R-R intervals, or rejected beats.
    rhythm: Option<Arc<Rhythm>>,
    breathing: Option<Arc<RespiratoryMotion>>,
}

impl Cycle {
    /// A cycle with any volume curve and the volume gains at end-systole and end-diastole (see
    /// [`VolumeRange::gains`](crate::VolumeRange::gains)).
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 < beats_per_minute <= 1000` and gains are within 0 to 20 and ascending, or for an
    /// invalid [`VolumeCurve`].
    pub fn new(
        beats_per_minute: f64,
        curve: &VolumeCurve,
        gains: [f64; 2],
    ) -> Result<Self, PhantomError> {
        check(
            "beats_per_minute",
            beats_per_minute,
            [f64::MIN_POSITIVE, 1000.0],
        )?;
        check("largest gain", gains[1], GAIN)?;
        check("smallest gain", gains[0], [0.0, gains[1]])?;
        Ok(Self {
            beats_per_minute,
            gains,
            height: Height::new(curve, beats_per_minute)?,
            rhythm: None,
            breathing: None,
        })
    }

    /// Sets variable R-R intervals about the rate of the cycle. Accepted beats that all last the period of the cycle give bitwise
    /// identical results to a regular cycle.
    pub(crate) fn with_beats(mut self, beats: &Beats) -> Result<Self, PhantomError> {
        let rhythm = Rhythm::new(beats, self.period(), &self.height)?;
        self.rhythm = (!rhythm.is_plain()).then(|| Arc::new(rhythm));
        Ok(self)
    }

    /// Sets the respiratory motion. A motion without effect and without gates leaves results bitwise identical.
    pub(crate) fn with_breathing(mut self, breathing: &Breathing) -> Result<Self, PhantomError> {
        let motion = RespiratoryMotion::new(breathing)?;
        let there = motion.moves() || breathing.gates.is_some();
        self.breathing = there.then(|| Arc::new(motion));
        Ok(self)
    }

    /// Returns the phase in `[0, 1)` at time `t` in seconds; phase 0 is at `t = 0`.
    #[must_use]
    pub fn phase(&self, t: f64) -> f64 {
        match &self.rhythm {
            None => wrap(t * (self.beats_per_minute / 60.0)),
            Some(rhythm) => {
                let beat = rhythm.beat(rhythm.number_at(t));
                wrap(rhythm.phase(&beat, t - beat.start))
            }
        }
    }

    /// Returns the respiratory motion.
    pub(crate) fn breathing(&self) -> Option<&RespiratoryMotion> {
        self.breathing.as_deref()
    }

    /// Returns the respiratory position at a time; 0 without respiratory motion.
    #[must_use]
    pub fn breath(&self, t: f64) -> f64 {
        (self.breathing.as_ref()).map_or(0.0, |breathing| breathing.fraction(t))
    }

    /// Returns the beats if R-R intervals vary or beats are rejected.
    pub(crate) fn rhythm(&self) -> Option<&Rhythm> {
        self.rhythm.as_deref()
    }

    /// Returns whether projections are acquired in real time: with variable R-R intervals or respiratory motion.
    pub(crate) fn in_real_time(&self) -> bool {
        self.rhythm.is_some() || self.breathing.is_some()
    }

    /// Returns the number of respiratory gates, or 1.
    pub(crate) fn breath_gates(&self) -> usize {
        (self.breathing.as_ref())
            .and_then(|motion| motion.breathing().gates)
            .map_or(1, |gates| gates.count())
    }

    /// Removes the respiratory motion.
    pub(crate) fn without_breathing(mut self) -> Self {
        self.breathing = None;
        self
    }

    /// Returns the pose of the heart at a respiratory position.
    pub(crate) fn moved(&self, pose: &Pose, breath: f64) -> Result<Pose, PhantomError> {
        Ok(match &self.breathing {
            None => *pose,
            Some(breathing) => breathing.moved(pose, breath)?,
        })
    }

    /// Returns the volume gain at a phase (any real number, modulo 1); NaN for NaN or infinity.
    #[must_use]
    pub fn gain(&self, phase: f64) -> f64 {
        self.gain_at_height(self.height.at(wrap(phase)))
    }

    /// Returns the gain at a normalised volume.
    pub(crate) fn gain_at_height(&self, height: f64) -> f64 {
        let [low, high] = self.gains;
        low + (high - low) * height
    }

    /// Returns the emptied fraction of the stroke volume at a gain: 0 at end-diastole, 1 at end-systole; 0 for a constant volume.
    pub(crate) fn emptied(&self, gain: f64) -> f64 {
        let [low, high] = self.gains;
        match high > low {
            true => ((high - gain) / (high - low)).clamp(0.0, 1.0),
            false => 0.0,
        }
    }

    /// Returns the normalised volume curve.
    pub(crate) fn height(&self) -> &Height {
        &self.height
    }

    /// Returns the heart rate.
    pub(crate) fn beats_per_minute(&self) -> f64 {
        self.beats_per_minute
    }

    /// Returns the length of one cycle in seconds.
    #[must_use]
    pub fn period(&self) -> f64 {
        1.0 / (self.beats_per_minute / 60.0)
    }

    /// Returns the first phases of smallest and of largest volume.
    #[must_use]
    pub fn extreme_phases(&self) -> [f64; 2] {
        self.height.extreme_phases()
    }

    /// Returns the gains at end-systole and end-diastole.
    #[must_use]
    pub fn gains(&self) -> [f64; 2] {
        self.gains
    }
}

/// Reduces `phase` to `[0, 1)` and rounds it to the phase grid.
pub(crate) fn wrap(phase: f64) -> f64 {
    let p = (phase.rem_euclid(1.0) * PHASE_GRID).round() / PHASE_GRID;
    if p >= 1.0 { 0.0 } else { p }
}
