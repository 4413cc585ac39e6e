//! Rotation of the camera for headers that support even steps and centred detectors only.

use crate::error::{PhantomError, check};
use crate::files::Projections;
use crate::text::short;

/// The rotation in degrees.
pub(super) struct Turn {
    /// Angle of the first view, from 0 to 360.
    pub(super) start: f64,
    /// Number of views times the step between them.
    pub(super) extent: f64,
    /// Whether angles increase: counter-clockwise seen from +z.
    pub(super) increases: bool,
}

impl Turn {
    /// Returns the rotation of some of the views.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] if the views are not evenly spaced or the detector is not centred, for which there are no keys.
    pub(super) fn of(projections: &Projections, angles: &[f64]) -> Result<Self, PhantomError> {
        let [_, rows, bins] = projections.shape();
        let detector = projections.detector;
        for (a, n) in [bins, rows].into_iter().enumerate() {
            let offset = detector.offset()[a] / detector.pitch()[a];
            check_centred("detector offset in bins", offset, n)?;
        }
        let gaps = (angles.len() - 1).max(1) as f64;
        let step = (angles[angles.len() - 1] - angles[0]) / gaps;
        if angles.len() > 1 {
            // The smallest step that a header in degrees resolves.
            check("step between views", step.abs(), [1e-9, f64::MAX])?;
        }
        for pair in angles.windows(2) {
            // Accumulated steps differ by far less than this, real unevenness by more.
            let slack = 1e-6 * step.abs();
            let (low, high) = (step - slack, step + slack);
            check("step between views", pair[1] - pair[0], [low, high])?;
        }
        Ok(Self {
            start: short(angles[0].to_degrees()).rem_euclid(360.0),
            extent: short((step.abs() * angles.len() as f64).to_degrees()),
            increases: step >= 0.0,
        })
    }
}

/// Checks that `given` is zero up to the rounding of `n` steps.
pub(super) fn check_centred(what: &'static str, given: f64, n: usize) -> Result<f64, PhantomError> {
    // The rounding of a centre computed from n steps, far below visible differences.
    let slack = 1e-9 * n as f64;
    check(what, given, [-slack, slack])
}
