//! What a sample is in counts: the camera's sensitivity, the seconds of a view, the decay.

use super::view_time::ViewTime;
use std::f64::consts::LN_2;

/// Seconds of an hour.
const HOUR: f64 = 3600.0;

/// The camera's sensitivity, `[counting]` of a scene: with it, activity is in MBq per mL, and a sample, activity times cm in the mean over
/// the time that its view sees, stands for an expected number of counts,
///
/// ```text
/// sample x area of a bin (cm^2) x sensitivity x seconds that the view sees x decay
/// ```
///
/// A parallel-hole collimator in air is as sensitive at any distance, so that one number does. Seconds are [`ViewTime::window`]: a gate's
/// are its share of the view's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Counting {
    /// Counts a second and MBq, of one head.
    pub sensitivity: f64,
    /// How the activity, given for the start of the first view, falls.
    pub decay: Decay,
}

/// Decay during the scan. Of a view it is the mean of `2^(-t / half-life)` over its time, of an exposure over the exposure; within a view
/// the heart beats too fast for it to make a difference between phases.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Decay {
    /// None: the activity stays.
    None,
    /// Technetium-99m, 6.0072 h (E. Browne, J. K. Tuli, Nuclear Data Sheets 145 (2017) 25).
    #[cfg_attr(feature = "scene", serde(rename = "tc-99m"))]
    Tc99m,
    /// A half-life in hours.
    HalfLifeHours(f64),
}

impl Decay {
    /// Allowed half-lives in hours.
    pub(crate) const HALF_LIVES: [f64; 2] = [1e-6, 1e12];

    /// Seconds to half of the activity; `None` if it stays.
    ///
    /// ```
    /// use heart_phantom::Decay;
    /// assert_eq!(Decay::Tc99m.half_life(), Some(6.0072 * 3600.0));
    /// ```
    pub fn half_life(&self) -> Option<f64> {
        match *self {
            Self::None => None,
            Self::Tc99m => Some(6.0072 * HOUR),
            Self::HalfLifeHours(hours) => Some(hours * HOUR),
        }
    }

    /// What is left in the mean over `seconds` from `start` on.
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
    /// Expected counts of a sample of 1 on bins of `area` cm^2, of a view whose time, without breaks, is `lasts` seconds.
    pub(crate) fn per_unit(&self, area: f64, time: &ViewTime, lasts: f64) -> f64 {
        area * self.sensitivity * time.window * self.decay.left(time.start, lasts)
    }
}
