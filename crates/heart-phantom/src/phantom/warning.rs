//! Warnings: allowed values that are probably not intended.

#[cfg(feature = "scene")]
use crate::text::short;
use crate::text::{brief, enough};
#[cfg(feature = "scene")]
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::fmt;

/// An allowed value that is probably not intended. The text contains the consequence and the numbers.
///
/// `report.json` contains an object with `message` and the fields `what`, `edge`, `needed_cm`, `available_cm`, `angle_degrees` of a
/// truncation; `edge`, `nearest_cm` and `reach_cm` of a heart outside the views; `times` of a heart outside the torso; `view`, `radius_cm` and
/// `needed_cm` of a detector inside the body; `pitch_cm`, `fwhm_cm` and `error` of aliased samples; `gap_degrees` of a short arc;
/// `off_degrees` of uneven angles; `coefficient_per_cm` of uncorrected attenuation; `key`, `value` and `usual` of an unusual value. A steep
/// twist has none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Projections are truncated.
    Truncated {
        /// The truncated object.
        what: TruncatedObject,
        /// The edge of the detector that truncates it.
        edge: Edge,
        /// Sufficient length of the rows or height of the views, centred on the axis of rotation, cm.
        needed: f64,
        /// Actual length or height, cm.
        available: f64,
        /// For `Bins`: the view angle of the largest truncation, radians.
        angle: Option<f64>,
    },
    /// The heart is above or below all rows, or farther from the axis of rotation than half the length of a row. Some or all views miss it.
    OutOfView {
        /// Beyond the rows, or beyond the bins.
        edge: Edge,
        /// Smallest distance of the heart from the middle row or from the axis of rotation, cm.
        nearest: f64,
        /// Half the height or length of the views, cm.
        reach: f64,
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
        radius: f64,
        /// Extent of the body towards it, cm.
        needed: f64,
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
        /// The largest gap between neighbouring directions modulo half a turn, radians.
        gap: f64,
    },
    /// The scene attenuates, but the reconstruction does not model it: activities inside the body are too small.
    Uncorrected {
        /// The largest attenuation coefficient, 1/cm.
        coefficient: f64,
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
    /// The heart overlaps an organ that attenuates more, such as the spine, and replaces it there.
    InBone {
        /// Index of the organ, from 0.
        organ: usize,
        /// Largest common volume, mL.
        volume: f64,
    },
    /// Samples are values at the centres of bins that are wider than half the response, or than cavity, wall or a defect, so they differ from
    /// averages over bins.
    Aliased {
        /// Pitch of the bins, or of the rows if that is larger, in cm.
        pitch: f64,
        /// Smallest full width at half maximum of the response, cm; 0 without one.
        fwhm: f64,
        /// The largest difference from averages over bins in the first view, relative to the largest sample.
        error: f64,
    },
    /// Gates of a continuously rotating camera have uneven angles, but the projection format stores even steps only. The mean angle is
    /// exact.
    UnevenAngles {
        /// Largest difference between the angle of a view and that in its file, radians.
        off: f64,
    },
    /// The twist of a wall with defects changes by more than 0.05 radians within 1/256 of the size of the heart. Boundaries of the
    /// defects are less accurate there than the tolerances state.
    SteepTwist,
}

/// An object that views may truncate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

    #[cfg(feature = "scene")]
    fn name(self) -> &'static str {
        match self {
            Self::Bins => "bins",
            Self::Rows => "rows",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Truncated {
                what,
                edge,
                needed,
                available,
                angle,
            } => {
                let name = match what {
                    TruncatedObject::Heart => "the heart",
                    TruncatedObject::Background => "the activity around the heart",
                    TruncatedObject::Torso => "the attenuating torso",
                };
                let then = match (what, edge) {
                    (TruncatedObject::Torso, _) => {
                        "projections, and osem with attenuation = true, include all of it; attenuation maps that are written end at the field of view"
                    }
                    (_, Edge::Bins) => "projections are truncated and reconstructions have streaks",
                    (_, Edge::Rows) => "slices contain only a part of it",
                };
                let ([side, size], needed, available) =
                    (edge.words(), enough(needed), brief(available));
                write!(f, "{name} needs a detector {needed} cm {side}")?;
                if let Some(angle) = angle {
                    write!(f, " (at {:.1} degrees)", angle.to_degrees())?;
                }
                write!(f, "; {size} is {available} cm: {then}")
            }
            Self::OutOfView {
                edge,
                nearest,
                reach,
            } => {
                let ([_, size], nearest, reach) = (edge.words(), brief(nearest), brief(reach));
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
                radius,
                needed,
            } => {
                let (radius, needed) = (brief(radius), enough(needed));
                write!(
                    f,
                    "the collimator face is inside the body: in view {view} it is {radius} cm from the axis of rotation, and the body extends {needed} cm towards it"
                )
            }
            Self::FewDirections { directions, views } => write!(
                f,
                "the {views} projections have only {directions} distinct directions; a reconstruction needs more"
            ),
            Self::ShortArc { gap } => write!(
                f,
                "the views leave a gap of {} degrees between neighbouring directions: osem distorts the volume along them; camera.arc is in degrees",
                brief(gap.to_degrees())
            ),
            Self::Uncorrected { coefficient } => write!(
                f,
                "the scene attenuates (up to {} /cm), but the reconstruction does not model it: activities inside the body are too small; \
                 osem with attenuation = true models it",
                brief(coefficient)
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
            Self::InBone { organ, volume } => write!(
                f,
                "the heart overlaps organ {}, which attenuates more, by {} mL and replaces it there (organ 5 of [chest] is the spine); change [pose]",
                organ + 1,
                brief(volume)
            ),
            Self::Aliased { pitch, fwhm, error } => {
                let (pitch, error) = (brief(pitch), brief(100.0 * error));
                write!(
                    f,
                    "samples are values at the centres of bins with a pitch of {pitch} cm"
                )?;
                if fwhm > 0.0 {
                    write!(f, ", and the response has a FWHM of {} cm", brief(fwhm))?;
                }
                write!(
                    f,
                    ": they differ from averages over bins by up to {error} % of the largest sample in the first view; camera.samples = \"averages\" computes these"
                )
            }
            Self::UnevenAngles { off } => write!(
                f,
                "the gates have uneven angles, up to {:.3} degrees from the even steps that the projection format stores; \
                 report.json and other formats contain each angle",
                off.to_degrees()
            ),
            Self::SteepTwist => f.write_str(
                "the twist changes by more than 2.9 degrees within 1/256 of the size of the heart: there the boundaries of defects are less accurate than the tolerances state",
            ),
        }
    }
}

#[cfg(feature = "scene")]
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let degrees = |angle: f64| short(angle.to_degrees());
        let mut map = to.serialize_map(None)?;
        match *self {
            Self::Truncated {
                what,
                edge,
                needed,
                available,
                angle,
            } => {
                let what = match what {
                    TruncatedObject::Heart => "heart",
                    TruncatedObject::Background => "background",
                    TruncatedObject::Torso => "torso",
                };
                map.serialize_entry("what", what)?;
                map.serialize_entry("edge", edge.name())?;
                map.serialize_entry("needed_cm", &short(needed))?;
                map.serialize_entry("available_cm", &short(available))?;
                if let Some(angle) = angle {
                    map.serialize_entry("angle_degrees", &degrees(angle))?;
                }
            }
            Self::OutOfView {
                edge,
                nearest,
                reach,
            } => {
                map.serialize_entry("what", "heart-out-of-view")?;
                map.serialize_entry("edge", edge.name())?;
                map.serialize_entry("nearest_cm", &short(nearest))?;
                map.serialize_entry("reach_cm", &short(reach))?;
            }
            Self::OutOfTorso { times } => {
                map.serialize_entry("what", "heart-out-of-torso")?;
                map.serialize_entry("times", &short(times))?;
            }
            Self::DetectorInside {
                view,
                radius,
                needed,
            } => {
                map.serialize_entry("what", "detector-inside")?;
                map.serialize_entry("view", &view)?;
                map.serialize_entry("radius_cm", &short(radius))?;
                map.serialize_entry("needed_cm", &short(needed))?;
            }
            Self::FewDirections { directions, views } => {
                map.serialize_entry("what", "directions")?;
                map.serialize_entry("directions", &directions)?;
                map.serialize_entry("views", &views)?;
            }
            Self::ShortArc { gap } => {
                map.serialize_entry("what", "arc")?;
                map.serialize_entry("gap_degrees", &degrees(gap))?;
            }
            Self::Uncorrected { coefficient } => {
                map.serialize_entry("what", "attenuation")?;
                map.serialize_entry("coefficient_per_cm", &short(coefficient))?;
            }
            Self::Unusual {
                key, value, usual, ..
            } => {
                map.serialize_entry("what", "unusual")?;
                map.serialize_entry("key", key)?;
                map.serialize_entry("value", &short(value))?;
                map.serialize_entry("usual", &usual)?;
            }
            Self::InBone { organ, volume } => {
                map.serialize_entry("what", "heart-in-bone")?;
                map.serialize_entry("organ", &organ)?;
                map.serialize_entry("volume_ml", &short(volume))?;
            }
            Self::Aliased { pitch, fwhm, error } => {
                map.serialize_entry("what", "aliased")?;
                map.serialize_entry("pitch_cm", &short(pitch))?;
                map.serialize_entry("fwhm_cm", &short(fwhm))?;
                map.serialize_entry("error", &short(error))?;
            }
            Self::UnevenAngles { off } => {
                map.serialize_entry("what", "angles")?;
                map.serialize_entry("off_degrees", &degrees(off))?;
            }
            Self::SteepTwist => map.serialize_entry("what", "steep-twist")?,
        }
        map.serialize_entry("message", &self.to_string())?;
        map.end()
    }
}
