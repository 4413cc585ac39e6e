//! The section `[[points]]`, and the validation of `[beats]`.

use super::finding::{Check, array_of};
use crate::error::PhantomError;
use crate::ranges;
use crate::text::Number;
use crate::{Beats, Cycle, MaterialPoint, RrIntervals};
use serde::{Deserialize, Serialize};

/// One of `[[points]]`: a material point whose motion is reported.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSettings {
    /// Transmural position, from 0 (inner membrane) to 1 (outer membrane).
    pub layer: f64,
    /// Material coordinate of the reference configuration, from 0 (base) to 0.5 (apex).
    pub s: f64,
    /// Azimuth about the axis in degrees, from body y to body z, of the untwisted wall.
    pub azimuth_degrees: f64,
}

impl PointSettings {
    /// Returns the point, with its azimuth in radians.
    pub(crate) fn point(&self) -> MaterialPoint {
        MaterialPoint {
            layer: self.layer,
            s: self.s,
            azimuth: self.azimuth_degrees.to_radians(),
        }
    }
}

pub(super) fn points(points: &[PointSettings], c: &mut Check) {
    c.count("points", points.len(), ranges::POINTS);
    c.each("points", points, |c, point| {
        c.within("layer", point.layer, ranges::LAYER);
        c.within("s", point.s, ranges::S);
        c.within("azimuth_degrees", point.azimuth_degrees, [-720.0, 720.0]);
    });
}

/// Returns the cycle with the R-R intervals of `[beats]`, if they fit it.
pub(super) fn beats(beats: &Beats, cycle: Cycle, c: &mut Check) -> Option<Cycle> {
    let error = match cycle.with_beats(beats) {
        Ok(cycle) => return Some(cycle),
        Err(error) => error,
    };
    let (what, given) = match &error {
        PhantomError::OutOfRange { what, given, .. } => (*what, Number(*given).to_string()),
        PhantomError::Count { what, given, .. } => (*what, array_of(*given)),
        _ => ("", String::new()),
    };
    let (name, given) = match &beats.intervals {
        // The value that is out of range follows from the period and the curve.
        RrIntervals::Random { ectopic, .. } if what.contains("ectopic") => {
            ("intervals.random.ectopic", Number(*ectopic).to_string())
        }
        _ if what.contains("accepted") => ("accepted", given),
        RrIntervals::List(_) => ("intervals.list", given),
        RrIntervals::Random { .. } => ("intervals.random.deviation", given),
    };
    c.fault(name, given, error.to_string());
    None
}
