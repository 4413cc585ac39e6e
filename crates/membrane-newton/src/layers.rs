//! From one resolution to the next finer one, until the polynomials have converged.

use std::sync::Arc;

use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, own};
use crate::report::NewtonReport;
use crate::resolution::Resolution;

/// A finer resolution, if there is one, with the solved state carried over to it and with its start.
pub(crate) type Refined<R> = Option<Result<(R, Vec<f64>, Vec<f64>), NewtonError>>;

/// The next finer resolution, with `state` carried over to it, and with the curve to start `near` or its start.
pub(crate) fn refine(
    resolution: &Arc<Resolution>,
    state: &[f64],
    near: Option<&Equilibrium>,
) -> Refined<Arc<Resolution>> {
    Some(resolution.finer()?.map(|finer| {
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let pieces = own(resolution.discrete.pieces(nodes));
        let carried = finer.state_on(intensity, |s| {
            let piece = pieces.partition_point(|piece| piece.to < s);
            pieces[piece.min(pieces.len() - 1)].at(s).position
        });
        let start = finer.start_near(near);
        (finer, carried, start)
    }))
}

/// Solves at a resolution, then at finer ones until the polynomials have converged; each begins with
/// what the one before has found, unless that failed. `solve` works at one resolution, from its second state or, what
/// comes to the same, its third; `refine` gives the next.
pub(crate) fn solve_refining<R>(
    (mut resolution, mut start): (R, Vec<f64>),
    solve: impl Fn(&R, &mut [f64], &[f64]) -> Result<NewtonReport, NewtonError>,
    is_resolved: impl Fn(&R, &[f64]) -> Result<(), NewtonError>,
    refine: impl Fn(&R, &[f64]) -> Refined<R>,
) -> Result<(R, Vec<f64>, NewtonReport), NewtonError> {
    let mut total = NewtonReport::default();
    let mut state = start.clone();
    loop {
        let mut outcome = solve(&resolution, &mut state, &start);
        if let Some(report) = outcome.as_mut().map_or_else(NewtonError::report_mut, Some) {
            report.add_earlier(&total);
            total.clone_from(report);
        }
        let outcome = outcome.and_then(|_| is_resolved(&resolution, &state));
        let carry = match outcome {
            Ok(()) => return Ok((resolution, state, total)),
            Err(NewtonError::Unresolved { .. }) => true,
            Err(
                NewtonError::NotConverged { .. }
                | NewtonError::OtherBranch { .. }
                | NewtonError::Singular { .. },
            ) => false,
            // where the curve is resolved it is the branch that ends, not the polynomials
            Err(NewtonError::LimitPoint { .. }) if is_resolved(&resolution, &state).is_err() => {
                false
            }
            Err(error) => return Err(error),
        };
        match refine(&resolution, &state) {
            Some(finer) => (resolution, state, start) = finer?,
            None => {
                return Err(outcome
                    .err()
                    .unwrap_or(NewtonError::NotConverged { report: total }));
            }
        }
        if !carry {
            state.copy_from_slice(&start);
        }
    }
}
