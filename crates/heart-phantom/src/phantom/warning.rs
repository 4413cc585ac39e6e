//! What is allowed and yet may surprise, with the numbers that show why.

#[cfg(feature = "scene")]
use crate::text::short;
use crate::text::{brief, enough};
#[cfg(feature = "scene")]
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::fmt;

/// Something allowed that a user may not expect; its text says what it does, with the numbers.
///
/// In `report.json` an object with a `message` and with the fields `what`, `edge`, `needed_cm`, `seen_cm`, `angle_degrees` of what is
/// truncated; `edge`, `nearest_cm` and `reach_cm` of a heart outside; `times` of one that reaches out of the torso; `view`, `radius_cm` and
/// `needed_cm` of a detector inside the body; `pitch_cm`, `fwhm_cm` and `error` of aliased samples; `off_degrees` of uneven angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The detector is too small for something.
    Truncated {
        /// What it does not see whole.
        what: Seen,
        /// Where it ends.
        edge: Edge,
        /// How long the rows would have to be, or how high the views, in cm; centred on the axis of turning.
        needed: f64,
        /// How long, or high, they are.
        seen: f64,
        /// Of bins: from where most is missing, in radians.
        angle: Option<f64>,
    },
    /// The heart is above or below all rows, so that no view sees anything of it, or all of it is farther from the axis of turning
    /// than half a row is long, so that views see it in passing at most.
    OutOfView {
        /// Which of the two: beyond the rows, or beyond the bins.
        edge: Edge,
        /// How far it is, at the nearest, from the middle row or from the axis of turning, in cm.
        nearest: f64,
        /// How far from there the views reach, in cm.
        reach: f64,
    },
    /// The heart is not all within the torso that attenuates: rays are weakened by what they pass of the torso, and by nothing of the
    /// heart outside.
    OutOfTorso {
        /// How many times as far from the torso's axis as its surface the heart reaches.
        times: f64,
    },
    /// The collimator's face, where the orbit has it, is within the body. Lines are as they are; whoever models the collimator from the
    /// headers has a detector in the patient.
    DetectorInside {
        /// The view in which it is farthest inside.
        view: usize,
        /// How far from the axis of turning it is there, in cm.
        radius: f64,
        /// How far the body reaches towards it.
        needed: f64,
    },
    /// Projections from few distinct directions: opposite and repeated ones count once.
    FewDirections {
        /// Distinct directions.
        directions: usize,
        /// Projections.
        views: usize,
    },
    /// The heart reaches into an organ that attenuates more than the heart, such as the spine, and takes its place there.
    InBone {
        /// Index of the organ, from 0.
        organ: usize,
        /// Volume in common at most, in mL.
        volume: f64,
    },
    /// Samples are line integrals through the centres of bins that are wide against the response or the heart, so that they alias.
    Aliased {
        /// Pitch of the bins in cm.
        pitch: f64,
        /// Full width at half maximum of the response where it is narrowest, in cm; 0 without one.
        fwhm: f64,
        /// The largest difference from averages over bins in the first view, relative to the largest sample.
        error: f64,
    },
    /// A turning camera sees gates from uneven angles, and the format of the projections has room for even ones only: their mean
    /// is right.
    UnevenAngles {
        /// How far a view is from where its file says it is, at most; in radians.
        off: f64,
    },
}

/// What a camera should see whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Seen {
    /// Cavity and wall, at end-diastole and end-systole, or at the one phase that is looked at.
    Heart,
    /// What surrounds the heart and is active (`[background]` of a scene, or
    /// organs).
    Background,
    /// The torso that attenuates (`[attenuation]` of a scene), or organs that
    /// do and are not active.
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
    /// How that side is called, and what gives it.
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
                seen,
                angle,
            } => {
                let streaks = "views are truncated, and reconstructions streak";
                let (name, then) = match (what, edge) {
                    (Seen::Heart, Edge::Bins) => ("the heart", streaks),
                    (Seen::Heart, Edge::Rows) => ("the heart", "its ends are in no slice"),
                    (Seen::Background, _) => ("the background", streaks),
                    (Seen::Torso, _) => (
                        "the torso that attenuates",
                        "all of it weakens the rays, but a map of it as wide as the views shows only a part",
                    ),
                };
                let ([side, size], needed, seen) = (edge.words(), enough(needed), brief(seen));
                write!(f, "{name} needs views {needed} cm {side}")?;
                if let Some(angle) = angle {
                    write!(f, " (at {:.1} degrees)", angle.to_degrees())?;
                }
                write!(f, "; {size} is {seen} cm: {then}")
            }
            Self::OutOfView {
                edge,
                nearest,
                reach,
            } => {
                let ([_, size], nearest, reach) = (edge.words(), brief(nearest), brief(reach));
                let (from, then) = match edge {
                    Edge::Rows => ("their middle row", "nothing of it is seen"),
                    Edge::Bins => ("the axis of turning", "it is seen in passing at most"),
                };
                write!(
                    f,
                    "the heart is outside the views, {nearest} cm from {from} at the nearest; half of {size} is {reach} cm: {then}"
                )
            }
            Self::OutOfTorso { times } => {
                let times = brief(times);
                write!(
                    f,
                    "the heart reaches out of the torso that attenuates, {times} times as far as its surface: what is outside weakens no ray"
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
                    "the camera's face is within the body: in view {view} it is {radius} cm from the axis of turning, and the body reaches {needed} cm towards it"
                )
            }
            Self::FewDirections { directions, views } => write!(
                f,
                "the {views} projections have {directions} distinct directions; reconstructions need more"
            ),
            Self::InBone { organ, volume } => write!(
                f,
                "the heart overlaps organ {} by {} mL, which attenuates more than the heart: the heart takes its place there; change the pose",
                organ + 1,
                brief(volume)
            ),
            Self::Aliased { pitch, fwhm, error } => {
                let (pitch, error) = (brief(pitch), brief(100.0 * error));
                write!(f, "samples are line integrals at a pitch of {pitch} cm")?;
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
                "the gates of a turning camera are seen from uneven angles, up to {:.3} degrees from where the even steps of their format put them; \
                 other formats hold each angle, and report.json does",
                off.to_degrees()
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
                seen,
                angle,
            } => {
                let what = match what {
                    Seen::Heart => "heart",
                    Seen::Background => "background",
                    Seen::Torso => "torso",
                };
                map.serialize_entry("what", what)?;
                map.serialize_entry("edge", edge.name())?;
                map.serialize_entry("needed_cm", &short(needed))?;
                map.serialize_entry("seen_cm", &short(seen))?;
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
        }
        map.serialize_entry("message", &self.to_string())?;
        map.end()
    }
}
