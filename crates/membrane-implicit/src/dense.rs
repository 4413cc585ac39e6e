//! The shape within the last step.

use crate::error::{ImplicitError, within};
use crate::stepper::Stepper;

/// Cubic Hermite interpolation of positions (from velocities) and velocities (from accelerations).
pub(crate) fn at_into(
    stepper: &Stepper,
    time: f64,
    points: &mut [[f64; 2]],
    velocities: &mut [[f64; 2]],
) -> Result<(), ImplicitError> {
    let (old, now) = (&stepper.old, stepper.now());
    within("time", time, old.time, now.time)?;
    let n = now.nodes.len() / 2;
    assert_eq!((points.len(), velocities.len()), (n, n), "nodes");
    let dt = now.time - old.time;
    let t = if dt > 0.0 {
        (time - old.time) / dt
    } else {
        1.0
    };
    let s = 1.0 - t;
    // 1 - 3 t^2 + 2 t^3 and its fellows
    let (h00, h10) = (s * s * (1.0 + 2.0 * t), dt * t * s * s);
    let (h01, h11) = (t * t * (1.0 + 2.0 * s), -dt * t * t * s);
    let mix = |out: &mut [f64], a: &[f64], da: &[f64], b: &[f64], db: &[f64]| {
        for i in 0..out.len() {
            out[i] = h00 * a[i] + h10 * da[i] + h01 * b[i] + h11 * db[i];
        }
    };
    mix(
        points.as_flattened_mut(),
        &old.nodes,
        &old.velocity,
        &now.nodes,
        &now.velocity,
    );
    mix(
        velocities.as_flattened_mut(),
        &old.velocity,
        &old.acceleration,
        &now.velocity,
        &now.acceleration,
    );
    Ok(())
}
