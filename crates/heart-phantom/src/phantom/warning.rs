//! Warnings: allowed values that are probably not intended.

use crate::text::{brief, enough};
use serde::{Serialize, Serializer};
use std::fmt;

/// An allowed value that is probably not intended. The text contains the consequence and the numbers.
///
/// `report.json` contains an object with the name of the variant in kebab case, `what`, its fields, and the text, `message`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(remote = "Self", tag = "what", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Warning {
    /// Projections are truncated.
    Truncated {
        /// The truncated object.
        object: TruncatedObject,
        /// The edge of the detector that truncates it.
        edge: Edge,
        /// Sufficient length of the rows or height of the views, centred on the axis of rotation, cm.
        needed_cm: f64,
        /// Actual length or height, cm.
        available_cm: f64,
        /// For `Bins`: the view angle of the largest truncation, degrees.
        #[serde(skip_serializing_if = "Option::is_none")]
        angle_degrees: Option<f64>,
    },
    /// The heart is above or below all rows, or farther from the axis of rotation than half the length of a row. Some or all views miss it.
    OutOfView {
        /// Beyond the rows, or beyond the bins.
        edge: Edge,
        /// Smallest distance of the heart from the middle row or from the axis of rotation, cm.
        nearest_cm: f64,
        /// Half the height or length of the views, cm.
        reach_cm: f64,
    },
    /// The heart is not completely inside the attenuating torso. The part outside does not attenuate.
    OutOfTorso {
        /// Largest distance of the heart from the axis of the torso, relative to that of the torso surface.
        times: f64,
    },
    /// The collimator face of the orbit is inside the body. Line integrals are unaffected; the headers place a detector inside the patient.
    DetectorInside {
        /// The view in which it is deepest inside.
        view: usize,
        /// Its distance from the axis of rotation in this view, cm.
        radius_cm: f64,
        /// Extent of the body towards it, cm.
        needed_cm: f64,
    },
    /// Projections from few distinct directions; opposite and repeated directions count once.
    FewDirections {
        /// Distinct directions.
        directions: usize,
        /// Projections.
        views: usize,
    },
    /// OSEM of parallel projections that leave directions unmeasured, as of an arc below 180 degrees: the volume is distorted along them.
    ShortArc {
        /// The largest gap between neighbouring directions modulo half a turn, degrees.
        gap_degrees: f64,
    },
    /// The scene attenuates, but the reconstruction does not model it: activities inside the body are too small.
    Uncorrected {
        /// The largest attenuation coefficient, 1/cm.
        coefficient_per_cm: f64,
    },
    /// A value is legal, but outside the range of patients, as if it had another unit.
    Unusual {
        /// The key in the scene; that of attenuation also for the coefficients of organs.
        key: &'static str,
        /// The value given.
        value: f64,
        /// The usual range.
        usual: [f64; 2],
        /// The unit of both.
        unit: &'static str,
    },
    /// A value with which reconstructions or counts are useless: a resolution coarser than the heart, voxels that do not cover it, a custom
    /// window with another gain than 1 at frequency 0, less than one expected count in a view.
    Unsuitable {
        /// The key in the scene.
        key: &'static str,
        /// The reason.
        reason: &'static str,
        /// The value that follows from it.
        value: f64,
        /// The limit.
        limit: f64,
        /// The unit of both; empty for a pure number.
        unit: &'static str,
    },
    /// The heart overlaps an organ that attenuates more, such as the spine, and replaces it there.
    InBone {
        /// Index of the organ, from 0.
        organ: usize,
        /// Largest common volume, mL.
        volume_ml: f64,
    },
    /// Samples are values at the centres of bins that are wider than half the response, or than cavity, wall or a defect, so they differ from
    /// averages over bins.
    Aliased {
        /// Pitch of the bins, or of the rows if that is larger, in cm.
        pitch_cm: f64,
        /// Smallest full width at half maximum of the response, cm; 0 without one.
        fwhm_cm: f64,
        /// The largest difference from averages over bins in the first view, relative to the largest sample.
        error: f64,
    },
    /// Gates of a continuously rotating camera have uneven angles, but the projection format stores even steps only. The mean angle is
    /// exact.
    UnevenAngles {
        /// Largest difference between the angle of a view and that in its file, degrees.
        off_degrees: f64,
    },
    /// A setting has no effect.
    Unused {
        /// The key in the scene.
        key: &'static str,
        /// The reason.
        reason: &'static str,
    },
    /// Counts without acquisition times, which differ between views or gates, as after rejected beats.
    UntimedCounts {
        /// Shortest time of a view in a gate, seconds.
        shortest_s: f64,
        /// Longest one.
        longest_s: f64,
    },
    /// Nothing in the scene is active: all samples are zero.
    NoActivity,
    /// The twist of a wall with defects changes by more than 0.05 radians within 1/256 of the size of the heart. Boundaries of the
    /// defects are less accurate there than the tolerances state.
    SteepTwist,
}

/// An object that views may truncate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum TruncatedObject {
    /// Cavity and wall at end-diastole and end-systole, or at the static phase.
    Heart,
    /// The activity around the heart (`[background]` or organs).
    Background,
    /// The attenuating torso (`[attenuation]`), or attenuating organs without activity.
    Torso,
}

/// An edge of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// The ends of its rows.
    Bins,
    /// Its lowest and highest row.
    Rows,
}

impl Edge {
    /// Its adjective, and the product that defines its size.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Bins => ["wide", "bins x pitch"],
            Self::Rows => ["high", "rows x pitch"],
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Truncated {
                object,
                edge,
                needed_cm,
                available_cm,
                angle_degrees,
            } => {
                let name = match object {
                    TruncatedObject::Heart => "the heart",
                    TruncatedObject::Background => "the activity around the heart",
                    TruncatedObject::Torso => "the attenuating torso",
                };
                let then = match (object, edge) {
                    (TruncatedObject::Torso, _) => {
                        "projections, and osem with attenuation = true, include all of it; attenuation maps that are written end at the field of view"
                    }
                    (_, Edge::Bins) => "projections are truncated and reconstructions have streaks",
                    (_, Edge::Rows) => "slices contain only a part of it",
                };
                let ([side, size], needed, available) =
                    (edge.words(), enough(needed_cm), brief(available_cm));
                write!(f, "{name} needs a detector {needed} cm {side}")?;
                if let Some(angle) = angle_degrees {
                    write!(f, " (at {angle:.1} degrees)")?;
                }
                write!(f, "; {size} is {available} cm: {then}")
            }
            Self::OutOfView {
                edge,
                nearest_cm,
                reach_cm,
            } => {
                let ([_, size], nearest, reach) = (edge.words(), brief(nearest_cm), brief(reach_cm));
                let (from, then) = match edge {
                    Edge::Rows => ("the middle row", "no view contains it"),
                    Edge::Bins => ("the axis of rotation", "only some views contain it"),
                };
                write!(
                    f,
                    "the heart is outside the field of view, at least {nearest} cm from {from}; half of {size} is {reach} cm: {then}"
                )
            }
            Self::OutOfTorso { times } => {
                let times = brief(times);
                write!(
                    f,
                    "the heart extends beyond the attenuating torso, to {times} times the distance of its surface: the part outside does not attenuate"
                )
            }
            Self::DetectorInside {
                view,
                radius_cm,
                needed_cm,
            } => {
                let (radius, needed) = (brief(radius_cm), enough(needed_cm));
                write!(
                    f,
                    "the collimator face is inside the body: in view {view} it is {radius} cm from the axis of rotation, and the body extends {needed} cm towards it"
                )
            }
            Self::FewDirections { directions, views } => write!(
                f,
                "the {views} projections have only {directions} distinct directions; a reconstruction needs more"
            ),
            Self::ShortArc { gap_degrees } => write!(
                f,
                "the views leave a gap of {} degrees between neighbouring directions: osem distorts the volume along them; camera.arc is in degrees",
                brief(gap_degrees)
            ),
            Self::Uncorrected { coefficient_per_cm } => write!(
                f,
                "the scene attenuates (up to {} /cm), but the reconstruction does not model it: activities inside the body are too small; \
                 osem with attenuation = true models it",
                brief(coefficient_per_cm)
            ),
            Self::Unusual {
                key,
                value,
                usual: [low, high],
                unit,
            } => write!(
                f,
                "{key} is {}, usually it is between {low} and {high} {unit}",
                brief(value)
            ),
            Self::Unsuitable { key, reason, value, limit, unit } => {
                let [value, limit] = [value, limit].map(brief);
                let text = format!("{key}: {reason} ({value}; the limit is {limit} {unit}");
                write!(f, "{})", text.trim_end())
            }
            Self::InBone { organ, volume_ml } => write!(
                f,
                "the heart overlaps organ {}, which attenuates more, by {} mL and replaces it there (organ 5 of [chest] is the spine); change [pose]",
                organ + 1,
                brief(volume_ml)
            ),
            Self::Aliased { pitch_cm, fwhm_cm, error } => {
                let (pitch, error) = (brief(pitch_cm), brief(100.0 * error));
                write!(
                    f,
                    "samples are values at the centres of bins with a pitch of {pitch} cm"
                )?;
                if fwhm_cm > 0.0 {
                    write!(f, ", and the response has a FWHM of {} cm", brief(fwhm_cm))?;
                }
                write!(
                    f,
                    ": they differ from averages over bins by up to {error} % of the largest sample in the first view; camera.samples = \"averages\" computes these"
                )
            }
            Self::UnevenAngles { off_degrees } => write!(
                f,
                "the gates have uneven angles, up to {off_degrees:.3} degrees from the even steps that the projection format stores; \
                 report.json and other formats contain each angle"
            ),
            Self::Unused { key, reason } => write!(f, "{key} has no effect: {reason}"),
            Self::UntimedCounts { shortest_s, longest_s } => write!(
                f,
                "views take {} to {} s, but their counts do not depend on it; noise.counts = \"expected\" with a section [counting] includes the times",
                brief(shortest_s),
                brief(longest_s)
            ),
            Self::NoActivity => f.write_str("nothing in the scene is active: all samples are zero"),
            Self::SteepTwist => f.write_str(
                "the twist changes by more than 2.9 degrees within 1/256 of the size of the heart: there the boundaries of defects are less accurate than the tolerances state",
            ),
        }
    }
}

/// The fields with the message.
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct WithMessage {
            #[serde(flatten, with = "Warning")]
            fields: Warning,
            message: String,
        }
        let (fields, message) = (*self, self.to_string());
        WithMessage { fields, message }.serialize(to)
    }
}
