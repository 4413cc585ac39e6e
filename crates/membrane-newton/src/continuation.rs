//! Raising the control in steps when Newton cannot take it at once.

use crate::error::NewtonError;
use crate::newton::{NewtonScratch, ResidualSystem, newton_with};
use crate::options::{NewtonOptions, NewtonReport};

/// Solves for control value `to` from `state`; if that fails, walks from value `from`, where `state`
/// is near an equilibrium, to `to`: each step starts from the straight line through the last two
/// equilibria, is halved when Newton fails and doubled when it does not.
pub(crate) fn solve<S: ResidualSystem>(
    system: &mut S,
    state: &mut [f64],
    (from, to): (f64, f64),
    set: impl Fn(&mut S, f64),
    options: &NewtonOptions,
) -> Result<NewtonReport, NewtonError> {
    let mut scratch = NewtonScratch::default();
    let mut total = NewtonReport::default();
    let start = state.to_vec();
    set(system, to);
    let direct = attempt(system, state, options, &mut scratch, &mut total);
    if direct.is_ok() || options.max_load_steps == 0 {
        return finish(direct, total);
    }
    // careful steps only: within a continuation a failing one is cheaper cut off early
    let careful = options
        .clone()
        .with_max_iterations(options.max_iterations.min(10));
    state.copy_from_slice(&start);
    let mut last = start;
    let (mut here, mut before) = (0.0, 0.0);
    let mut width: f64 = 0.25;
    let mut outcome = direct;
    while here < 1.0 && total.load_steps < options.max_load_steps {
        let next = (here + width).min(1.0);
        let solved = state.to_vec();
        if here > before {
            let reach = (next - here) / (here - before);
            for (x, last) in state.iter_mut().zip(&last) {
                *x += reach * (*x - last);
            }
        }
        set(system, from + next * (to - from));
        total.load_steps += 1;
        outcome = attempt(system, state, &careful, &mut scratch, &mut total);
        if outcome.is_ok() {
            (before, here, last) = (here, next, solved);
            width *= 2.0;
        } else {
            state.copy_from_slice(&solved);
            width *= 0.5;
            if width < (1e-4 * here).max(1e-9) {
                break;
            }
        }
    }
    if here > 0.0 && here < 1.0 {
        return Err(NewtonError::LimitPoint {
            reached: from + here * (to - from),
            wanted: to,
            report: total,
        });
    }
    finish(outcome, total)
}

fn attempt(
    system: &mut impl ResidualSystem,
    state: &mut [f64],
    options: &NewtonOptions,
    scratch: &mut NewtonScratch,
    total: &mut NewtonReport,
) -> Result<(), NewtonError> {
    let outcome = newton_with(system, state, options, scratch);
    let mut report = scratch.report().clone();
    report.add_earlier(total);
    *total = report;
    outcome
}

/// The outcome with the report of everything that was tried.
fn finish(
    outcome: Result<(), NewtonError>,
    total: NewtonReport,
) -> Result<NewtonReport, NewtonError> {
    match outcome {
        Ok(()) => Ok(total),
        Err(NewtonError::NotConverged { .. }) => Err(NewtonError::NotConverged { report: total }),
        Err(error) => Err(error),
    }
}
