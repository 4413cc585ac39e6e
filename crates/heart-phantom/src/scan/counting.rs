//! Calibration from samples to counts: sensitivity, acquisition time, decay.

use super::view_time::ViewTime;
use std::f64::consts::LN_2;

/// Seconds per hour.
const HOUR: f64 = 3600.0;

/// Calibration from samples to counts, `[counting]` of a scene. Activity is in MBq per mL; a sample (activity times cm, averaged over the
/// acquisition time) has the expected counts
///
/// ```text
/// sample x area of a bin (cm^2) x sensitivity x acquisition time of the view (s) x decay
/// ```
///
/// The sensitivity of a parallel-hole collimator in air does not depend on the distance. The acquisition time is [`ViewTime::window`]; a gate has its
/// fraction of the view's time.
#[doc(alias("calibration", "sensitivity"))]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counting {
    /// Sensitivity of a head, counts per second and MBq.
    pub sensitivity: f64,
    /// Decay of the activity, which is given at the start of the first view.
    pub decay: Decay,
}

/// Decay during the acquisition: the average of `2^(-t / half-life)` over the time of a view or exposure. Within a view the heart beats too
/// fast for decay to differ between phases.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Decay {
    /// No decay.
    None,
    /// Technetium-99m, 6.0072 h (E. Browne, J. K. Tuli, Nuclear Data Sheets 145 (2017) 25).
    #[serde(rename = "tc-99m")]
    Tc99m,
    /// Half-life in hours.
    HalfLifeHours(f64),
}

impl Decay {
    /// Allowed half-lives in hours.
    pub(crate) const HALF_LIVES: [f64; 2] = [1e-6, 1e12];

    /// Returns the half-life in seconds; `None` without decay.
    pub(crate) fn half_life(&self) -> Option<f64> {
        match *self {
            Self::None => None,
            Self::Tc99m => Some(6.0072 * HOUR),
            Self::HalfLifeHours(hours) => Some(hours * HOUR),
        }
    }

    /// Returns the remaining fraction, averaged over `seconds` from `start`.
    fn left(&self, start: f64, seconds: f64) -> f64 {
        let Some(half_life) = self.half_life() else {
            return 1.0;
        };
        let (rate, within) = (LN_2 / half_life, LN_2 * seconds / half_life);
        let mean = match within > 0.0 {
            true => -(-within).exp_m1() / within,
            false => 1.0,
        };
        (-rate * start).exp() * mean
    }
}

impl Counting {
    /// Returns the expected counts per unit sample for bins of `area` cm^2 and a view that lasts `lasts` seconds without breaks.
    pub(crate) fn per_unit(&self, area: f64, time: &ViewTime, lasts: f64) -> f64 {
        area * self.sensitivity * time.window * self.decay.left(time.start, lasts)
    }
}
