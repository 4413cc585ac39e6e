//! The cause of the end of a branch of rubber: compression, the end of extension, or a limit point.

use membrane_forces::MembraneError;

use crate::constraint::{Constraint, Quantity};
use crate::error::NewtonError;
use crate::nested_system::NestedSystem;
use crate::newton::ResidualSystem;

/// Compression by this fraction of the modulus is rounding, as in the reference configuration.
pub(crate) const SLACK: f64 = 1e-9;
/// Relative change of the shape within which a branch ends; continuation follows it more closely.
const NEAR: f64 = 1e-2;
/// Tension in tangents of slack rubber, over the shear modulus.
const TAUT: f64 = 1e-3;

/// Returns why no equilibrium exists between `state`, the last one, and `wanted`, if the material is the cause.
///
/// Rubber under compression along the meridian is slack. It is also slack if its rate of change towards a lower load or volume compresses
/// it near the state: tangents without tension are singular, so that continuation stops before. Rubber on the way to a volume is past its
/// extension if its rate of change exceeds it near the state.
pub(crate) fn of(
    system: &mut NestedSystem<'_>,
    state: &[f64],
    wanted: Constraint,
) -> Option<NewtonError> {
    let slack = |tension: f64| (tension < -SLACK).then_some(NewtonError::Slack { tension });
    if let Some(slack) = slack(system.tension(state)) {
        return Some(slack);
    }
    system.innermost().constraint = wanted;
    system.set_least_tension(TAUT);
    let mut rate = vec![0.0; state.len()];
    system.factor(state).ok()?;
    system.rate_into(&mut rate).ok()?;
    let left = wanted.value - system.control_value(state);
    let near = NEAR / system.shape_norm(&rate);
    let pairs = state.iter().zip(&rate);
    let ahead: Vec<f64> = pairs
        .map(|(x, rate)| x + left.clamp(-near, near) * rate)
        .collect();
    if left < 0.0 {
        return slack(system.tension(&ahead));
    }
    match (wanted.quantity, system.residual_into(&ahead, &mut rate)) {
        (
            Quantity::Measure(_),
            Err(NewtonError::Membrane(error @ MembraneError::PastStretch { limit, .. })),
        ) if limit.is_finite() => Some(error.into()),
        _ => None,
    }
}
