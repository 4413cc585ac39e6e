//! The sections of a scene that are about motion beyond the beat itself: breathing, beats that differ.

use super::fault::{Checked, Section, all_within, count, fault, within};
use super::sections::exactly;
use crate::error::PhantomError;
use crate::ranges;
use crate::text::Number;
use crate::{
    Beats, Breathing, BreathingCurve, Cycle, MaterialPoint, RespiratoryGates, RrIntervals, Twist,
};
use serde::{Deserialize, Serialize};

/// `[breathing]`: the heart moves with the breath, rigidly, and nothing around it does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BreathingSettings {
    /// Shift at end-inspiration, `[x, y, z]` in cm.
    #[serde(deserialize_with = "exactly")]
    pub shift: [f64; 3],
    /// Turn at end-inspiration about the lab's x, then y, then z, in degrees.
    #[serde(deserialize_with = "exactly")]
    pub turn_degrees: [f64; 3],
    /// Seconds of a breath.
    pub period: f64,
    /// The way there and back.
    pub curve: BreathingCurve,
    /// Phase of the breath at the start of the first view; 0 is end-expiration.
    pub start: f64,
    /// Respiratory gates; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gates: Option<RespiratoryGates>,
}

/// `[twist]`: how far the wall is turned about its axis at end-systole, in degrees, positive from body y to body z.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwistSettings {
    /// At equally spaced s from the base to the apex, of the inner membrane: two or more.
    pub inner_degrees: Vec<f64>,
    /// Of the outer membrane.
    pub outer_degrees: Vec<f64>,
}

impl TwistSettings {
    pub(super) fn twist(&self) -> Result<Twist, PhantomError> {
        Twist::sampled(&self.inner_degrees, &self.outer_degrees)
    }

    pub(super) fn check(&self) -> Checked {
        for (field, samples) in [
            ("twist.inner_degrees", &self.inner_degrees),
            ("twist.outer_degrees", &self.outer_degrees),
        ] {
            all_within(field, samples, [-360.0, 360.0])?;
            Twist::sampled(samples, samples).map_err(|error| {
                let given = format!("an array of {} values", samples.len());
                fault(field, given, error.to_string())
            })?;
        }
        Ok(())
    }
}

/// One of `[[points]]`: a material point whose motion the report has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSettings {
    /// From 0, the inner membrane, to 1, the outer one.
    pub layer: f64,
    /// From 0, the base, to 0.5, the apex: material coordinate of the membranes at rest.
    pub s: f64,
    /// Degrees about the axis, from body y to body z, of the wall without a twist.
    pub azimuth_degrees: f64,
}

impl PointSettings {
    pub(super) fn point(&self) -> MaterialPoint {
        MaterialPoint {
            layer: self.layer,
            s: self.s,
            azimuth: self.azimuth_degrees.to_radians(),
        }
    }
}

/// Numbers of all points in their ranges.
pub(super) fn points(points: &[PointSettings]) -> Checked {
    count("points", points.len(), ranges::POINTS)?;
    for (k, point) in points.iter().enumerate() {
        let section = Section(format!("points.{}", k + 1));
        section.within("layer", point.layer, ranges::LAYER)?;
        section.within("s", point.s, ranges::S)?;
        section.within("azimuth_degrees", point.azimuth_degrees, [-720.0, 720.0])?;
    }
    Ok(())
}

impl Default for BreathingSettings {
    fn default() -> Self {
        Self {
            shift: [0.0; 3],
            turn_degrees: [0.0; 3],
            period: 4.0,
            curve: BreathingCurve::Sinusoid,
            start: 0.0,
            gates: None,
        }
    }
}

impl BreathingSettings {
    pub(super) fn breathing(&self) -> Result<Breathing, PhantomError> {
        let breathing = Breathing::new(self.shift, self.period, &self.curve)?
            .with_turn(self.turn_degrees.map(f64::to_radians))?
            .with_start(self.start)?;
        match self.gates {
            None => Ok(breathing),
            Some(gates) => breathing.with_gates(gates),
        }
    }

    pub(super) fn check(&self) -> Checked {
        all_within("breathing.shift", &self.shift, ranges::SHIFT)?;
        let turns = ranges::TURN.map(f64::to_degrees);
        all_within("breathing.turn_degrees", &self.turn_degrees, turns)?;
        within("breathing.period", self.period, ranges::BREATHS)?;
        within("breathing.start", self.start, [0.0, 1.0])?;
        if let BreathingCurve::Lujan { n } = self.curve {
            count("breathing.curve.lujan.n", n, ranges::EXPONENTS)?;
        }
        if let Some(gates) = self.gates {
            let field = match gates {
                RespiratoryGates::Phase(_) => "breathing.gates.phase",
                RespiratoryGates::Amplitude(_) => "breathing.gates.amplitude",
            };
            count(field, gates.count(), ranges::RESPIRATORY_GATES)?;
        }
        // What is left: samples.
        self.breathing().map(drop).map_err(|error| {
            let given = match &self.curve {
                BreathingCurve::Sampled(samples) => format!("an array of {} values", samples.len()),
                BreathingCurve::Sinusoid | BreathingCurve::Lujan { .. } => String::new(),
            };
            fault("breathing.curve.sampled", given, error.to_string())
        })
    }
}

/// Whether the beats fit the cycle.
pub(super) fn beats(beats: &Beats, cycle: Cycle) -> Checked {
    cycle.with_beats(beats).map(drop).map_err(|error| {
        let (what, given) = match &error {
            PhantomError::OutOfRange { what, given, .. } => (*what, Number(*given).to_string()),
            PhantomError::Count { what, given, .. } => {
                (*what, format!("an array of {given} values"))
            }
            _ => ("", String::new()),
        };
        let field = match &beats.intervals {
            _ if what.contains("accepted") => "beats.accepted",
            RrIntervals::List(_) => "beats.intervals.list",
            RrIntervals::Random { .. } if what.contains("ectopic") => {
                "beats.intervals.random.ectopic"
            }
            RrIntervals::Random { .. } => "beats.intervals.random.deviation",
        };
        fault(field, given, error.to_string())
    })
}
