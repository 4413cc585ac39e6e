//! The end of a branch of rubber: compression, the end of extension, or a maximum of the pressure.

use membrane_forces::MembraneError;

use crate::border::dot;
use crate::constraint::{Constraint, Quantity};
use crate::error::NewtonError;
use crate::nested_system::NestedSystem;
use crate::newton::ResidualSystem;
use crate::resolution::Resolution;

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
pub(crate) fn cause(
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

/// Iterations from the end of a walk, some 1e-4 of the pressure before the limit.
const ITERATIONS: usize = 30;

/// Returns the pressure at the limit point near `state`; `None` if Newton does not converge.
///
/// The state z' = dx/dV solves A z' = e, with A the symmetric derivative of the residual R(c, p) = (forces, volume), and e the unit vector
/// of the last row. At the limit the last component dp/dV vanishes. Its derivative along v is -v.w with w = D^2 R[z', z'], the third
/// derivatives of the energy, here a second difference. Newton for R = 0 and dp/dV = 0 is then
///
/// ```text
/// x += z + alpha z',     A z = -R,     alpha = (z'_p - w.z) / (w.z')
/// ```
pub(crate) fn pressure(resolution: &Resolution, state: &[f64]) -> Option<f64> {
    let last = resolution.discrete.start().len();
    let mut x = state[..=last].to_vec();
    let mut system = resolution.system(Constraint::volume(0.0));
    let n = x.len();
    let (mut z, mut rate, mut w) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let (mut moved, mut there) = (vec![0.0; n], vec![0.0; n]);
    for _ in 0..ITERATIONS {
        system.constraint = Constraint::volume(system.volume(&x));
        system.residual_into(&x, &mut z).ok()?;
        system.factor(&x).ok()?;
        w.copy_from_slice(&z);
        w.iter_mut().for_each(|w| *w *= -2.0);
        rate.fill(0.0);
        rate[last] = 1.0;
        system.solve_in_place(&mut rate).ok()?;
        // a step of 1e-4 has truncation and rounding errors of 1e-8 in the second difference
        let step = 1e-4 / system.shape_norm(&rate);
        for sign in [1.0, -1.0] {
            for ((moved, x), rate) in moved.iter_mut().zip(&x).zip(&rate) {
                *moved = x + sign * step * rate;
            }
            system.residual_into(&moved, &mut there).ok()?;
            w.iter_mut().zip(&there).for_each(|(w, r)| *w += r);
        }
        w.iter_mut().for_each(|w| *w /= step * step);
        system.solve_in_place(&mut z).ok()?;
        z.iter_mut().for_each(|z| *z = -*z);
        let alpha = (rate[last] - dot(&w, &z)) / dot(&w, &rate);
        // at most half its size per iteration
        let size = alpha.abs() * system.shape_norm(&rate);
        let alpha = alpha * (0.5 / size).min(1.0);
        let mut change = vec![0.0; n];
        for (change, (z, rate)) in change.iter_mut().zip(z.iter().zip(&rate)) {
            *change = z + alpha * rate;
        }
        x.iter_mut().zip(&change).for_each(|(x, c)| *x += c);
        let moved = system.step_norm(&change);
        if !moved.is_finite() {
            return None;
        }
        if moved <= SETTLED {
            let defined = system.residual_into(&x, &mut there).is_ok();
            return defined.then_some(x[last]);
        }
    }
    None
}

/// The pressure is stationary, so a step this small changes it by its square.
const SETTLED: f64 = 1e-9;
