//! How a camera turns, for headers that know of even steps and of a detector on the axis only.

use crate::error::{PhantomError, check};
use crate::files::Projections;
use crate::text::short;

/// How the camera turns, in degrees.
pub(super) struct Turn {
    /// Angle of the first view, from 0 to 360.
    pub(super) start: f64,
    /// Number of views times the step between them.
    pub(super) extent: f64,
    /// Which way angles grow.
    pub(super) direction: Direction,
}

/// Which way a header says that the camera turns.
pub(super) enum Direction {
    Cw,
    Ccw,
}

impl Turn {
    /// # Errors
    /// [`PhantomError::OutOfRange`] if the views are not evenly spaced or the detector is not
    /// centred: there are no keys for that.
    pub(super) fn new(projections: &Projections) -> Result<Self, PhantomError> {
        Self::of(projections, projections.angles())
    }

    /// As [`Turn::new`], of some of the views.
    pub(super) fn of(projections: &Projections, angles: &[f64]) -> Result<Self, PhantomError> {
        let [_, rows, bins] = projections.shape();
        let detector = projections.detector();
        for (a, n) in [bins, rows].into_iter().enumerate() {
            let offset = detector.offset()[a] / detector.pitch()[a];
            check_centred("detector offset in bins", offset, n)?;
        }
        let gaps = (angles.len() - 1).max(1) as f64;
        let step = (angles[angles.len() - 1] - angles[0]) / gaps;
        if angles.len() > 1 {
            // The smallest step that a header in degrees is not noise for.
            check("step between views", step.abs(), [1e-9, f64::MAX])?;
        }
        for pair in angles.windows(2) {
            // Angles made by adding up steps are off by far less than this; a real unevenness is not.
            let slack = 1e-6 * step.abs();
            let (low, high) = (step - slack, step + slack);
            check("step between views", pair[1] - pair[0], [low, high])?;
        }
        Ok(Self {
            start: short(angles[0].to_degrees()).rem_euclid(360.0),
            extent: short((step.abs() * angles.len() as f64).to_degrees()),
            direction: match step < 0.0 {
                true => Direction::Cw,
                false => Direction::Ccw,
            },
        })
    }
}

/// `given` of `n` steps has to be zero up to rounding.
pub(super) fn check_centred(what: &'static str, given: f64, n: usize) -> Result<f64, PhantomError> {
    // The rounding of a centre found from n steps, far below anything that a picture shows.
    let slack = 1e-9 * n as f64;
    check(what, given, [-slack, slack])
}
