//! The cardiac cycle: which phase at which time, which volume gain at which phase.

use super::volume_curve::{Height, VolumeCurve};
use crate::error::{PhantomError, check};
use crate::ranges::GAIN;

/// Phases are kept on a grid of `2^-40` of a cycle, so that instants which are whole cycles apart
/// give the same bits although `t * bpm / 60` was rounded differently. At 65 beats per minute the
/// grid is 0.8 ps wide; no shape changes by a rounding error over that.
const PHASE_GRID: f64 = (1u64 << 40) as f64;

/// A periodic cardiac cycle: a heart rate and a volume curve.
///
/// The cavity's volume gain (Rohmer et al. 2006, Eq. 35: `(V - V_rest) / V_rest`) at phase `p` is
/// `g_low + (g_high - g_low) h(p)`, `h` the [`VolumeCurve`]. [`Cycle::new`] is the study's: the
/// sinusoid from rest at phase 0 to `peak_gain` at phase 1/2.
///
/// ```
/// use heart_phantom::{Cycle, VolumeCurve};
/// let cycle = Cycle::new(65.0, 0.6)?;
/// assert_eq!(cycle.gain(0.0), 0.0);
/// assert!((cycle.gain(0.5) - 0.6).abs() < 1e-15);
/// // One view a second sees twelve phases only: 65 beats a minute are 13/12 beats a second.
/// assert_eq!(cycle.phase(0.0), cycle.phase(12.0));
/// // A ventricle instead: full at phase 0, at its emptiest when the aortic valve closes.
/// let cycle = Cycle::with_curve(65.0, &VolumeCurve::Physiological, [0.0, 0.6])?;
/// assert_eq!((cycle.gain(0.0), cycle.gain(0.46)), (0.6, 0.0));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    beats_per_minute: f64,
    beats_per_second: f64,
    gains: [f64; 2],
    height: Height,
}

impl Cycle {
    /// A cycle of `beats_per_minute` whose cavity gains `peak_gain` of its rest volume at phase 1/2.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 < beats_per_minute <= 1000` and
    /// `0 <= peak_gain <= 20`, both finite.
    pub fn new(beats_per_minute: f64, peak_gain: f64) -> Result<Self, PhantomError> {
        check("peak_gain", peak_gain, GAIN)?;
        Self::with_curve(beats_per_minute, &VolumeCurve::Sinusoid, [0.0, peak_gain])
    }

    /// A cycle of any form, with the volume gains at end-systole and at end-diastole (see
    /// [`VolumeRange::gains`](crate::VolumeRange::gains)).
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 < beats_per_minute <= 1000` and
    /// `0 <= g_low <= g_high <= 20`; and for a curve that has no sense, see [`VolumeCurve`].
    pub fn with_curve(
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
            beats_per_second: beats_per_minute / 60.0,
            gains,
            height: Height::new(curve, beats_per_minute)?,
        })
    }

    /// Phase in `[0, 1)` at time `t` in seconds; phase 0 is at `t = 0`.
    pub fn phase(&self, t: f64) -> f64 {
        wrap(t * self.beats_per_second)
    }

    /// A phase reduced to `[0, 1)`, on the grid that times give.
    pub(crate) fn wrapped(&self, phase: f64) -> f64 {
        wrap(phase)
    }

    /// Volume gain of the cavity at a phase (any real number; whole cycles are dropped); NaN for one that is no number or infinite.
    pub fn gain(&self, phase: f64) -> f64 {
        self.gain_at_height(self.height.at(wrap(phase)))
    }

    /// The gain at a height of the curve.
    pub(crate) fn gain_at_height(&self, height: f64) -> f64 {
        let [low, high] = self.gains;
        low + (high - low) * height
    }

    /// The form of the curve.
    pub(crate) fn height(&self) -> &Height {
        &self.height
    }

    /// Heart rate.
    pub fn beats_per_minute(&self) -> f64 {
        self.beats_per_minute
    }

    /// Length of one cycle in seconds.
    pub fn period(&self) -> f64 {
        1.0 / self.beats_per_second
    }

    /// The first phase at which the volume is smallest, and at which it is largest.
    pub fn extreme_phases(&self) -> [f64; 2] {
        self.height.extreme_phases()
    }

    /// The largest gain of the cycle.
    pub fn peak_gain(&self) -> f64 {
        self.gains[1]
    }

    /// The gains at end-systole and at end-diastole.
    pub fn gains(&self) -> [f64; 2] {
        self.gains
    }
}

/// `phase` reduced to `[0, 1)` and put on the phase grid.
fn wrap(phase: f64) -> f64 {
    let p = (phase.rem_euclid(1.0) * PHASE_GRID).round() / PHASE_GRID;
    if p >= 1.0 { 0.0 } else { p }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_view_a_second_at_65_bpm_sees_twelve_phases() {
        let cycle = Cycle::new(65.0, 0.6).unwrap();
        let mut phases: Vec<f64> = (0..90).map(|k| cycle.phase(k as f64)).collect();
        phases.sort_by(f64::total_cmp);
        phases.dedup();
        assert_eq!(phases.len(), 12);
        for (j, p) in phases.iter().enumerate() {
            assert!((p - j as f64 / 12.0).abs() < 1.0 / PHASE_GRID);
        }
    }

    #[test]
    fn gain_is_periodic_even_and_bounded() {
        let cycle = Cycle::new(72.0, 0.6).unwrap();
        for j in 0..64 {
            let p = j as f64 / 64.0;
            assert_eq!(cycle.gain(p), cycle.gain(p + 3.0));
            assert_eq!(cycle.gain(p), cycle.gain(1.0 - p));
            assert!((0.0..=0.6).contains(&cycle.gain(p)));
        }
    }

    #[test]
    fn refuses_nonsense() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
            assert!(matches!(
                Cycle::new(bad, 0.6),
                Err(PhantomError::OutOfRange { .. })
            ));
        }
        for bad in [-0.1, f64::NAN, 21.0] {
            assert!(matches!(
                Cycle::new(65.0, bad),
                Err(PhantomError::OutOfRange { .. })
            ));
        }
        for curve in [VolumeCurve::Sinusoid, VolumeCurve::Physiological] {
            let cycle = Cycle::with_curve(65.0, &curve, [0.1, 0.6]).unwrap();
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(cycle.gain(bad).is_nan());
                assert!(cycle.gain(cycle.phase(bad)).is_nan());
            }
        }
    }
}
