//! The cardiac cycle: which phase at which time, which volume gain at which phase.

use crate::error::PhantomError;
use std::f64::consts::TAU;

/// Phases are kept on a grid of `2^-40` of a cycle, so that instants which are whole cycles apart
/// give the same bits although `t * bpm / 60` was rounded differently. At 65 beats per minute the
/// grid is 0.8 ps wide; no shape changes by a rounding error over that.
const PHASE_GRID: f64 = (1u64 << 40) as f64;

/// A periodic cardiac cycle with the sinusoidal volume curve of the study.
///
/// The cavity's volume gain (Rohmer et al. 2006, Eq. 35: `(V - V_rest) / V_rest`) at phase `p` is
/// `peak_gain (1 - cos 2 pi p) / 2`: rest at phase 0, largest at phase 1/2.
///
/// ```
/// use heart_phantom::Cycle;
/// let cycle = Cycle::new(65.0, 0.6)?;
/// assert_eq!(cycle.gain(0.0), 0.0);
/// assert!((cycle.gain(0.5) - 0.6).abs() < 1e-15);
/// // One view a second sees twelve phases only: 65 beats a minute are 13/12 beats a second.
/// assert_eq!(cycle.phase(0.0), cycle.phase(12.0));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    beats_per_second: f64,
    peak_gain: f64,
}

impl Cycle {
    /// A cycle of `beats_per_minute` whose cavity gains `peak_gain` of its rest volume at phase 1/2.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 < beats_per_minute <= 1000` and
    /// `0 <= peak_gain <= 20`, both finite.
    pub fn new(beats_per_minute: f64, peak_gain: f64) -> Result<Self, PhantomError> {
        crate::error::check(
            "beats_per_minute",
            beats_per_minute,
            f64::MIN_POSITIVE,
            1000.0,
        )?;
        crate::error::check("peak_gain", peak_gain, 0.0, 20.0)?;
        Ok(Self {
            beats_per_second: beats_per_minute / 60.0,
            peak_gain,
        })
    }

    /// Phase in `[0, 1)` at time `t` in seconds; phase 0 is at `t = 0`.
    pub fn phase(&self, t: f64) -> f64 {
        wrap(t * self.beats_per_second)
    }

    /// Volume gain of the cavity at a phase (any real number; whole cycles are dropped).
    pub fn gain(&self, phase: f64) -> f64 {
        let phase = wrap(phase);
        // Folded, so that mirrored phases have the same gain to the last bit and share a shape.
        let phase = phase.min(1.0 - phase);
        self.peak_gain * (1.0 - (TAU * phase).cos()) / 2.0
    }

    /// Length of one cycle in seconds.
    pub fn period(&self) -> f64 {
        1.0 / self.beats_per_second
    }

    /// The largest gain of the cycle.
    pub fn peak_gain(&self) -> f64 {
        self.peak_gain
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
            assert!(Cycle::new(65.0, bad).is_err());
        }
    }
}
