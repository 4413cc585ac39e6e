//! Continuation: raising the control in steps if Newton fails, without a change of branch.

use crate::constraint::Quantity;
use crate::error::{NewtonError, Result};
use crate::nested_system::NestedSystem;
use crate::newton::{NewtonScratch, ROUNDING, ResidualSystem, newton_with};
use crate::options::{LineSearch, NewtonOptions};
use crate::report::{NewtonReport, StopReason};
use crate::resolution::swept_by_mean_radius;
use crate::route::Route;
use crate::turning::Reach;

/// Tolerance on the control: about a hundred roundings of a sum over all nodes.
const MET: f64 = 1e-12;
/// Larger errors of a result are a failure: they exceed the correction below. It is also the largest tolerance of a solve, because the tests of
/// turning points compare the rates of change of equilibria.
pub(crate) const MISSED: f64 = 1e-9;

/// Largest ratio of the rates of change at the ends of a step. Towards a limit point they grow as the inverse root of the distance, so that
/// at least a sixteenth of it remains.
const UNEVEN: f64 = 4.0;

/// Largest number of iterations of a step of continuation.
pub(crate) const WALKING: usize = 6;

/// Factor on the larger of two samples of the error by rounding.
const ROUNDINGS: f64 = 4.0;

/// The position at which a walk ended early, `None` at its start, and whether its steps are used up.
type EarlyEnd = (Option<f64>, Option<StopReason>);

/// Attempts to solve a system.
pub(crate) struct Search<'a, 's> {
    pub(crate) system: &'a mut NestedSystem<'s>,
    scratch: NewtonScratch,
    /// That of all attempts, also of earlier searches.
    pub(crate) report: &'a mut NewtonReport,
}

impl<'a, 's> Search<'a, 's> {
    pub(crate) fn new(system: &'a mut NestedSystem<'s>, report: &'a mut NewtonReport) -> Self {
        Self {
            system,
            scratch: NewtonScratch::default(),
            report,
        }
    }

    /// Solves for the control value `to` and writes the result to `state`. Tries Newton from `state`, if that differs, and from `start`, which
    /// is near an equilibrium for the value `from`. If that fails, it walks from `from` to `to`: each step starts from the linear extrapolation
    /// of the last two equilibria, is halved if Newton fails and doubled if not.
    ///
    /// Newton may converge to an equilibrium that no change of the control reaches: under large loads there are curves with more loops, and a
    /// branch may turn back repeatedly. Along a branch the determinant keeps its sign up to the limit point, and the curve turns continuously.
    /// So a direct result of Newton is accepted only if the sign is that of the start and the curve turns through at most a full circle (or
    /// little more than at the start). Otherwise the walk decides.
    pub(crate) fn solve(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        values: (f64, f64),
        options: &NewtonOptions,
    ) -> Result<()> {
        self.reach(state, start, values, options)?;
        if self.system.misses(state) > MET {
            // Corrections within the rounding of the forces count as zero; the control can still be met.
            let _ = self.correct(state);
        }
        // A correction may also be small relative to a diverging shape.
        if self.system.misses(state) <= MISSED {
            return Ok(());
        }
        let (report, source) = (Box::default(), None);
        Err(NewtonError::NotConverged { report, source })
    }

    /// Raises the reported error of `state` to that by the rounding of the equations, which the inverse tangent amplifies.
    ///
    /// Two samples of it are the correction of the residual at the state, and the error of the correction that moves the state back from
    /// changes of each number by one rounding. Both use the last factorisation; the exact error of each has the same distribution.
    pub(crate) fn add_rounding(&mut self, state: &[f64]) -> Result<()> {
        let system = &mut *self.system;
        let mut bits = 1u64;
        for moves in [0.0, f64::EPSILON] {
            let moved = state.iter().map(|x| {
                // signs of Knuth's linear congruential generator
                bits = bits.wrapping_mul(6_364_136_223_846_793_005);
                bits = bits.wrapping_add(1_442_695_040_888_963_407);
                let sign = if bits >> 63 == 0 { 1.0 } else { -1.0 };
                x * (1.0 + sign * moves)
            });
            let moved: Vec<f64> = moved.collect();
            let mut step = vec![0.0; state.len()];
            system.residual_into(&moved, &mut step)?;
            system.solve_in_place(&mut step)?;
            for ((step, moved), x) in step.iter_mut().zip(&moved).zip(state) {
                *step -= moved - x;
            }
            let error = ROUNDINGS * system.step_norm(&step);
            self.report.residual_calls += 1;
            self.report.iteration_error = self.report.iteration_error.max(error);
        }
        Ok(())
    }

    /// As [`Search::solve`], except for the last digits of the control.
    fn reach(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        (from, to): (f64, f64),
        options: &NewtonOptions,
    ) -> Result<()> {
        self.system.set_control(to);
        let elsewhere = state != start;
        if elsewhere {
            // defines the sign at the start, whatever the result
            let _ = self.system.factor(start);
        }
        let mut outcome = self.attempt(state, Reach::Direct, start, options);
        if outcome.is_err() && elsewhere {
            state.copy_from_slice(start);
            self.system.set_control(to);
            outcome = self.attempt(state, Reach::Direct, start, options);
        }
        // Inflated rubber stiffens again: beyond a limit of the pressure, or of the volume where it bulges, there may be another stable
        // state, which a rising control does not reach continuously.
        let beyond = match self.system.route() {
            Route::Raise => false,
            Route::Inflate => {
                outcome.is_ok() && to / from > 1.0 && !self.near(state, start, to - from)
            }
        };
        if beyond {
            outcome = Err(NewtonError::other_branch());
        }
        let used_up = self.report.stopped_by == Some(StopReason::Iterations);
        if outcome.is_err() && options.max_load_steps > 0 {
            match self.walk(state, start, (from, to), options) {
                Ok(()) => return Ok(()),
                // the branch did not end there
                Err((Some(_), _)) if options.max_iterations < WALKING && used_up => (),
                Err((Some(reached), ended)) => {
                    let block = self.system.innermost();
                    return Err(NewtonError::LimitPoint {
                        quantity: block.constraint.quantity.name(block.route),
                        reached,
                        wanted: to,
                        report: NewtonReport::ended(ended),
                    });
                }
                Err((None, ended)) => {
                    if let Err(NewtonError::OtherBranch { report }) = &mut outcome {
                        report.stopped_by = ended;
                    }
                }
            }
        }
        outcome
    }

    /// Makes one Newton step if it is within the tolerance of Newton's result.
    fn correct(&mut self, state: &mut [f64]) -> Result<()> {
        let (system, report) = (&mut *self.system, &mut *self.report);
        let mut step = vec![0.0; state.len()];
        system.residual_into(state, &mut step)?;
        system.factor(state)?;
        system.solve_in_place(&mut step)?;
        let size = system.step_norm(&step);
        if size <= 10.0 * ROUNDING {
            for (x, step) in state.iter_mut().zip(&step) {
                *x -= step;
            }
            system.residual_into(state, &mut step)?;
            report.factorisations += 1;
            report.residual_calls += 2;
            report.stepped(size, system.residual_norm(&step), size);
            report.floor(system.step_norm(state));
        }
        Ok(())
    }

    /// Walks from value `from`, near `start`, to `to`, and writes the result to `state`.
    ///
    /// A step is too long if Newton needs damping or many iterations, or if the curve turns too much, has a very different rate of change,
    /// or moves farther than predicted by the rates at both ends: Newton's method may then have jumped over limit points at which the branch turns
    /// back and forth.
    fn walk(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        (from, to): (f64, f64),
        options: &NewtonOptions,
    ) -> Result<(), EarlyEnd> {
        let careful = options
            .with_max_iterations(options.max_iterations.min(WALKING))
            .with_line_search(LineSearch::Natural { max_halvings: 0 });
        // The start need not be an exact equilibrium, nor an equilibrium at all if its ends are displaced.
        state.copy_from_slice(start);
        self.system.set_control(from);
        let mut rate = vec![0.0; state.len()];
        let mut on_branch = self
            .attempt(state, Reach::Step, start, &careful)
            .and_then(|()| self.system.factor(state))
            .and_then(|()| self.system.rate_into(&mut rate))
            .is_ok();
        if !on_branch {
            state.copy_from_slice(start);
        }
        let (mut last, mut solved) = (state.to_vec(), state.to_vec());
        let mut change = vec![0.0; state.len()];
        let (mut here, mut before) = (0.0, 0.0);
        let mut width: f64 = 0.25;
        let most_steps = (self.report.load_steps).saturating_add(options.max_load_steps);
        let mut ended = None;
        while here < 1.0 {
            if self.report.load_steps == most_steps {
                ended = Some(StopReason::LoadSteps);
                break;
            }
            let next = (here + width).min(1.0);
            if here > before {
                let reach = (next - here) / (here - before);
                for (x, last) in state.iter_mut().zip(&last) {
                    *x += reach * (*x - last);
                }
            }
            self.system.set_control(from + next * (to - from));
            self.report.load_steps += 1;
            let found = self.attempt(state, Reach::Step, &solved, &careful);
            let explained = found.is_ok() && {
                let step = (next - here) * (to - from);
                self.explained(&solved, state, step, &rate, &mut change) || !on_branch
            };
            if explained {
                (before, here, on_branch) = (here, next, true);
                rate.copy_from_slice(&change);
                last.copy_from_slice(&solved);
                solved.copy_from_slice(state);
                width *= 2.0;
            } else {
                state.copy_from_slice(&solved);
                width *= 0.5;
                if width < (1e-4 * here).max(1e-9) {
                    break;
                }
            }
        }
        match here {
            1.0 => Ok(()),
            0.0 => Err((None, ended)),
            _ => Err((Some(from + here * (to - from)), ended)),
        }
    }

    /// Whether the rates of change at both ends explain the change of the shape from `before` to `after` over the `step` of the control:
    /// `rate` at the former, `rate_after`, computed here, at the latter.
    fn explained(
        &mut self,
        before: &[f64],
        after: &[f64],
        step: f64,
        rate: &[f64],
        rate_after: &mut [f64],
    ) -> bool {
        for ((change, after), before) in rate_after.iter_mut().zip(after).zip(before) {
            *change = after - before;
        }
        let system = &mut *self.system;
        let by = system.shape_norm(rate_after) / step.abs();
        let known = system.rate_into(rate_after).is_ok();
        let rates = [rate, rate_after].map(|rate| system.shape_norm(rate));
        let (least, most) = (rates[0].min(rates[1]), rates[0].max(rates[1]));
        known && most <= UNEVEN * least && by <= 1.5 * most
    }

    /// Whether the result of a direct solve is no farther from the equilibrium `start` than the rates of change at both ends explain, and than the
    /// volume swept by a shell that moves by its radius: a sphere then has stretches of 1.5; shapes beyond a limit point have at least 3.
    fn near(&mut self, state: &[f64], start: &[f64], step: f64) -> bool {
        let mut rates = [vec![0.0; state.len()], vec![0.0; state.len()]];
        let [before, after] = &mut rates;
        let system = &mut *self.system;
        let swept = system.volume(state) - system.volume(start);
        if swept.abs() > swept_by_mean_radius(&system.innermost().start) {
            return false;
        }
        match system.innermost().constraint.quantity {
            Quantity::Measure(_) => true,
            Quantity::Intensity | Quantity::TotalForce => {
                system.factor(start).is_ok()
                    && system.rate_into(before).is_ok()
                    && system.factor(state).is_ok()
                    && self.explained(start, state, step, before, after)
            }
        }
    }

    /// Solves by Newton from `state`; the result must be within `reach` of `from`.
    pub(crate) fn attempt(
        &mut self,
        state: &mut [f64],
        reach: Reach,
        from: &[f64],
        options: &NewtonOptions,
    ) -> Result<()> {
        let outcome = newton_with(self.system, state, options, &mut self.scratch);
        let mut report = self.scratch.report().clone();
        report.add_earlier(self.report);
        *self.report = report;
        outcome?;
        if self.system.keeps_sign() && self.system.within(reach, from, state) {
            Ok(())
        } else {
            Err(NewtonError::other_branch())
        }
    }
}
