//! Warnings: allowed values that are probably not intended.

use std::collections::BTreeMap;
use std::fmt;

/// An allowed value that is probably not intended. [`fmt::Display`] writes the message.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Warning {
    /// The kind.
    pub what: WarningKind,
    /// The key of the scene that it concerns.
    pub key: &'static str,
    /// The consequence and the numbers.
    pub message: String,
    /// The numbers, by the names that [`WarningKind`] lists; in `report.json` they are fields of the warning.
    #[serde(flatten)]
    pub numbers: BTreeMap<&'static str, f64>,
}

impl Warning {
    pub(super) fn new<const N: usize>(
        what: WarningKind,
        key: &'static str,
        numbers: [(&'static str, f64); N],
        message: String,
    ) -> Self {
        Self {
            what,
            key,
            message,
            numbers: numbers.into(),
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// The kind of a [`Warning`], with the names of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum WarningKind {
    /// Views truncate cavity and wall at end-diastole and end-systole, or at the static phase: the rows are shorter (`camera.bins`) or the views lower
    /// (`camera.rows`) than `needed_cm`, centred on the axis of rotation; they have `available_cm`. For `camera.bins`, `angle_degrees` is the
    /// view angle of the largest truncation.
    TruncatedHeart,
    /// The same for the activity around the heart, of `[background]` or organs.
    TruncatedActivity,
    /// The same for the attenuating torso, or for attenuating organs without activity.
    TruncatedTorso,
    /// The heart is above or below all rows (`camera.rows`), or farther from the axis of rotation than half the length of a row (`camera.bins`):
    /// its smallest distance from the middle row or from the axis is `nearest_cm`, half the height or length of the views `reach_cm`.
    OutOfView,
    /// The heart is not completely inside the attenuating torso. `times`: largest distance of the heart from the axis of the torso, relative to
    /// that of the torso surface.
    OutOfTorso,
    /// The collimator face of the orbit is inside the body, most deeply in `view`, at `radius_cm` from the axis of rotation; the body extends
    /// `needed_cm` towards it. Line integrals are unaffected; the headers place a detector inside the patient.
    DetectorInside,
    /// The number `directions` of distinct directions of the `views` is small; opposite and repeated directions count once.
    FewDirections,
    /// OSEM of parallel projections that leave directions unmeasured, as of an arc below 180 degrees: the volume is distorted along them.
    /// `gap_degrees`: the largest gap between neighbouring directions modulo half a turn.
    ShortArc,
    /// The scene attenuates, by at most `coefficient_per_cm`, but the reconstruction does not model it.
    Uncorrected,
    /// A `value` is legal, but outside the range of patients, `least` to `most`, as if it had another unit.
    Unusual,
    /// A setting with which reconstructions or counts are useless: a resolution coarser than the heart, voxels that do not cover it, a custom
    /// window with another gain than 1 at frequency 0, less than one expected count in a view. `value` follows from the setting, beyond `limit`.
    Unsuitable,
    /// The heart overlaps an organ (`organ` is its index, from 0) that attenuates more, such as the spine, by up to `volume_ml`, and replaces it
    /// there.
    InBone,
    /// Samples are values at the centres of bins that are wider than half the response, or than cavity, wall or a defect: in the first view they
    /// differ from averages over bins by up to `error`, relative to the largest sample. `pitch_cm`: pitch of the bins, or of the rows if that is
    /// larger; `fwhm_cm`: smallest full width at half maximum of the response, 0 without one.
    Aliased,
    /// Gates of a continuously rotating camera have uneven angles, but the projection format stores even steps only. The mean angle is exact.
    /// `off_degrees`: largest difference between the angle of a view and that in its file.
    UnevenAngles,
    /// A setting has no effect.
    Unused,
    /// Counts without acquisition times, which differ between views or gates, as after rejected beats: from `shortest_s` to `longest_s`.
    UntimedCounts,
    /// Nothing in the scene is active: all samples are zero.
    NoActivity,
    /// The twist of a wall with defects changes by more than 0.05 radians within 1/256 of the size of the heart. Boundaries of the defects are
    /// less accurate there than the tolerances state.
    SteepTwist,
}
