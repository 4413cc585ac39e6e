//! Newton's iteration with a line search on any system of equations.

use std::ops::ControlFlow;

use membrane_forces::MembraneError;

use crate::constraint::{POSITIVE, check};
use crate::error::{NewtonError, Result};
use crate::options::{LineSearch, NewtonOptions, Refactor};
use crate::report::{NewtonReport, StopReason};

/// n equations in n unknowns whose tangent can be factored.
///
/// A system owns its workspace, so that no call allocates. Errors of membrane forces convert with `?`; other errors become
/// [`NewtonError::user`]. Solves accept trait objects.
pub trait ResidualSystem {
    /// Number of unknowns.
    fn len(&self) -> usize;

    /// Whether there are no unknowns.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// `out` = r(x).
    ///
    /// # Errors
    /// r is not defined at x. Then, as for values in `out` that are not finite, the line search takes a shorter step.
    /// [`NewtonError::User`] ends the solve.
    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<()>;

    /// Computes and factors the tangent dr/dx at x for [`ResidualSystem::solve_in_place`]. With an approximation Newton's method converges linearly,
    /// and its estimated error may be too small ([`NewtonReport::iteration_error`]).
    ///
    /// # Errors
    /// The tangent is not defined or singular.
    fn factor(&mut self, x: &[f64]) -> Result<()>;

    /// Overwrites `rhs` with (dr/dx)^-1 `rhs` using the last factorisation.
    ///
    /// # Errors
    /// [`NewtonError::NotFactored`], or any other error of solving.
    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<()>;

    /// Dimensionless norm of a residual: of order one if the equations are not met at all. A negative norm counts as NaN.
    fn residual_norm(&self, residual: &[f64]) -> f64;

    /// Dimensionless norm of a change of the unknowns, relative to the scale of the unknowns. Zero for a nonzero step is an error of the
    /// solve ([`MembraneError::OutOfRange`](membrane_forces::MembraneError::OutOfRange)); a negative norm counts as NaN.
    fn step_norm(&self, step: &[f64]) -> f64;

    /// Receives the report and x after each iteration; can end the solve ([`StopReason::Observer`]).
    fn observe(&mut self, report: &NewtonReport, x: &[f64]) -> ControlFlow<()> {
        let _ = (report, x);
        ControlFlow::Continue(())
    }
}

/// Work vectors of [`newton_with`]; reusing them avoids allocation.
#[derive(Debug, Clone, Default)]
pub struct NewtonScratch {
    residual: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
    correction: Vec<f64>,
    report: NewtonReport,
    /// The last error of the residual in the line search.
    rejected: Option<NewtonError>,
    /// Whether the last step was within rounding.
    rounding: bool,
    /// Contraction of the last step, infinite if not known.
    contraction: f64,
    /// Ratio of the last two steps if they shrink more slowly than estimated, as near a singular root; otherwise zero.
    slow: f64,
    /// The last step, before the line search shortened it, and the error after it as estimated from its own contraction; infinite before.
    last: f64,
    expected: f64,
    /// Estimated error after the last step if both of its corrections contracted; the report's estimate has a margin for other directions.
    left: f64,
    /// Whether the system has a reusable factorisation.
    factored: bool,
    /// Sum of the steps since that factorisation, infinite if an earlier solve made it.
    moved: f64,
}

/// Solves r(x) = 0 from the given x and overwrites it.
///
/// ```
/// use membrane_newton::{NewtonError, NewtonOptions, ResidualSystem, newton};
/// struct SquareRoot(f64, f64);
/// impl ResidualSystem for SquareRoot {
///     fn len(&self) -> usize { 1 }
///     fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
///         out[0] = x[0] * x[0] - self.0;
///         Ok(())
///     }
///     fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> { self.1 = 2.0 * x[0]; Ok(()) }
///     fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
///         rhs[0] /= self.1;
///         Ok(())
///     }
///     fn residual_norm(&self, r: &[f64]) -> f64 { r[0].abs() / self.0 }
///     fn step_norm(&self, step: &[f64]) -> f64 { step[0].abs() }
/// }
/// let mut x = [1.0];
/// let report = newton(&mut SquareRoot(2.0, 0.0), &mut x, &NewtonOptions::default())?;
/// assert!((x[0] - 2.0f64.sqrt()).abs() < 1e-14 && report.iterations <= 4);
/// # Ok::<(), NewtonError>(())
/// ```
///
/// # Errors
/// [`NewtonError::NotConverged`] with the report; a tolerance or an entry of `x` that is not finite; [`MembraneError::WrongLength`](membrane_forces::MembraneError::WrongLength) if the lengths of
/// `x` and the system differ; errors of the system.
pub fn newton(
    system: &mut (impl ResidualSystem + ?Sized),
    x: &mut [f64],
    options: &NewtonOptions,
) -> Result<NewtonReport> {
    let mut scratch = NewtonScratch::default();
    newton_with(system, x, options, &mut scratch)?;
    Ok(scratch.report)
}

/// As [`newton`], in the caller's scratch: no allocation after the first solve of a system of this size (except for the report inside an
/// error).
///
/// With [`LineSearch::Natural`] every full step is followed by a second one with the same factorisation, which costs only a solve and makes
/// the convergence cubic.
///
/// # Errors
/// As [`newton`]; x is then the last accepted iterate.
pub fn newton_with(
    system: &mut (impl ResidualSystem + ?Sized),
    x: &mut [f64],
    options: &NewtonOptions,
    scratch: &mut NewtonScratch,
) -> Result<()> {
    let n = system.len();
    MembraneError::length("unknowns", x.len(), n)?;
    (x.iter()).try_for_each(|x| check("start of an unknown", *x, f64::MIN).map(drop))?;
    options.check()?;
    scratch.begin(n, options.max_iterations);
    let outcome = iterate(system, x, options, scratch);
    match outcome {
        Ok(()) => scratch.report.floor(system.step_norm(x)),
        Err(_) => scratch.forget_factorisation(),
    }
    outcome
}

fn iterate(
    system: &mut (impl ResidualSystem + ?Sized),
    x: &mut [f64],
    options: &NewtonOptions,
    scratch: &mut NewtonScratch,
) -> Result<()> {
    system.residual_into(x, &mut scratch.residual)?;
    let norm = residual_norm(system, &scratch.residual);
    scratch.report.evaluated(norm);
    while scratch.report.residual > options.residual_tolerance {
        let made = scratch.report.iterations;
        if made == options.max_iterations {
            return Err(scratch.not_converged(StopReason::Iterations));
        }
        let fresh = !scratch.factored || options.refactor == Refactor::EachIteration;
        if fresh {
            system.factor(x)?;
            scratch.report.factorisations += 1;
            scratch.factored = true;
            scratch.moved = 0.0;
        }
        scratch.step.copy_from_slice(&scratch.residual);
        system.solve_in_place(&mut scratch.step)?;
        let full = step_norm(system, &scratch.step);
        // squares of smaller steps underflow
        let moves = |step: &f64| step.abs() > f64::MIN_POSITIVE.sqrt();
        if full == 0.0 && scratch.step.iter().any(moves) {
            check("norm of a nonzero step", full, POSITIVE)?;
        }
        let error = scratch.before_step(full, options, fresh);
        if error <= options.step_tolerance {
            scratch.report.step = full;
            scratch.report.iteration_error = error;
            return scratch.end(StopReason::Step);
        }
        let taken = match options.line_search {
            _ if !full.is_finite() => Err(scratch.not_converged(StopReason::NotFinite)),
            LineSearch::FullStep => scratch.full_step(system, x, full, options.step_tolerance),
            LineSearch::Natural { max_halvings } => {
                scratch.natural_step(system, x, full, max_halvings)
            }
        };
        let contraction = match taken {
            Ok(contraction) => contraction,
            // the old tangent failed; retry with a new one from the same x
            Err(NewtonError::NotConverged { .. }) if !fresh => {
                scratch.forget_factorisation();
                system.residual_into(x, &mut scratch.residual)?;
                scratch.report.residual_calls += 1;
                continue;
            }
            Err(error) => return Err(error),
        };
        if let Refactor::WhenContractionAbove(most) = options.refactor
            && contraction > most
        {
            scratch.forget_factorisation();
        }
        if scratch.report.iterations > made && system.observe(&scratch.report, x).is_break() {
            return scratch.end(StopReason::Observer);
        }
        if scratch.rounding {
            return scratch.end(StopReason::Rounding);
        }
        if scratch.left <= options.step_tolerance {
            return scratch.end(StopReason::Step);
        }
    }
    if scratch.report.residual.is_nan() {
        return Err(scratch.not_converged(StopReason::NotFinite));
    }
    scratch.end(StopReason::Residual)
}

/// Largest step that may be rounding. (Fine spectral elements of a membrane inflated to a thousand times its size have remaining steps of 2e-9.)
pub(crate) const ROUNDING: f64 = 1e-7;
/// Part of such a step that samples the rounding.
const PART: f64 = 1.0 / 64.0;
/// Ratio of steps below which they do not shrink slowly: the last steps at regular roots have smaller ones.
const LEAST_SLOW: f64 = 0.02;

impl NewtonScratch {
    /// Returns the report of the last solve with this scratch.
    #[must_use]
    pub fn report(&self) -> &NewtonReport {
        &self.report
    }

    /// Makes the next solve factor a new tangent under [`Refactor::WhenContractionAbove`]: required if the equations have changed
    /// substantially since the last solve. A failed solve keeps no tangent.
    pub fn forget_factorisation(&mut self) {
        self.factored = false;
    }

    fn begin(&mut self, n: usize, max_iterations: usize) {
        self.factored &= self.step.len() == n;
        self.residual.resize(n, 0.0);
        self.trial.resize(n, 0.0);
        self.step.resize(n, 0.0);
        self.correction.resize(n, 0.0);
        self.rejected = None;
        self.rounding = false;
        self.contraction = f64::INFINITY;
        self.slow = 0.0;
        self.last = f64::INFINITY;
        self.expected = f64::INFINITY;
        self.left = f64::INFINITY;
        self.moved = f64::INFINITY;
        self.report.restart(max_iterations);
    }

    fn end(&mut self, ended: StopReason) -> Result<()> {
        self.report.stopped_by = Some(ended);
        Ok(())
    }

    /// Returns the estimated error of the unknowns before a step of size `full`: the sum of this step and all later ones, from the contraction of
    /// the last ones, with a margin for other directions: twice the sum, 1.5 times with a new tangent, whose error is smaller in all directions.
    fn before_step(&mut self, full: f64, options: &NewtonOptions, fresh: bool) -> f64 {
        let ratio = full / std::mem::replace(&mut self.last, full);
        let is_slow = ratio > LEAST_SLOW && left_after(full, ratio) > 2.0 * self.expected;
        self.slow = if is_slow { ratio } else { 0.0 };
        let ratio = match options.line_search {
            LineSearch::FullStep => ratio,
            LineSearch::Natural { .. } => self.slow,
        };
        let contraction = match options.refactor {
            _ if self.contraction.is_finite() => self.contraction,
            Refactor::WhenContractionAbove(most) if !fresh => most,
            _ => 0.0,
        };
        left_after(full, ratio.max(contraction)) * if fresh { 0.75 } else { 1.0 }
    }

    /// Whether `step` from x, of size `full` with this contraction, is within rounding: it contracts less than by the factor `most`, or much
    /// less than the step before, and it is within a hundred roundings of x or of the order of the rounding of the equations. To sample the
    /// latter, x is changed by a small part of the step and by one rounding of each unknown: a smooth residual changes the correction by about
    /// that part, rounding by far more, or not at all if it hides the part.
    fn is_rounding(
        &mut self,
        system: &mut (impl ResidualSystem + ?Sized),
        x: &[f64],
        [full, contraction, most]: [f64; 3],
    ) -> Result<bool> {
        let before = std::mem::replace(&mut self.contraction, contraction);
        let shrinks = contraction <= if before <= 0.25 { 0.25 } else { most };
        if full > ROUNDING || shrinks {
            return Ok(false);
        }
        if full <= 100.0 * f64::EPSILON * step_norm(system, x) {
            return Ok(true);
        }
        subtract(x, PART, &self.step, &mut self.trial);
        for (n, trial) in self.trial.iter_mut().enumerate() {
            *trial *= 1.0 + [f64::EPSILON, -f64::EPSILON][n % 2];
        }
        self.report.residual_calls += 1;
        let sampled = system.residual_into(&self.trial, &mut self.correction);
        subtract(x, 1.0, &self.step, &mut self.trial);
        match sampled {
            Ok(()) => system.solve_in_place(&mut self.correction)?,
            Err(error @ NewtonError::User(_)) => return Err(error),
            Err(_) => return Ok(true),
        }
        (self.correction.iter_mut().zip(&self.step)).for_each(|(c, step)| *c -= step);
        let change = step_norm(system, &self.correction);
        Ok(!(0.125..8.0).contains(&(change / (PART * full))))
    }

    /// Returns the contraction of any direction after a step of size `full` with this `contraction`, for the test of convergence and for the
    /// estimated error. It is at least the relative change of the tangent since its factorisation, taken as the change of the unknowns for the test
    /// and as eight times that for the estimate, so that about 1 in 1000 random systems of up to five unknowns exceeds it. Limits apply to both,
    /// because the steps did contract.
    fn slowest(&self, contraction: f64, full: f64) -> [f64; 2] {
        let moved = self.moved + full;
        [moved.min(0.01), (8.0 * moved).min(0.25)].map(|change| contraction.max(change))
    }

    fn not_converged(&mut self, why: StopReason) -> NewtonError {
        self.report.stopped_by = Some(why);
        NewtonError::NotConverged {
            report: Box::new(self.report.clone()),
            source: self.rejected.take().map(Box::new),
        }
    }

    /// Applies the whole of `step`, whose size is `full`, and evaluates the residual unless the error is within `tolerance`. Returns its
    /// contraction: its size over that of the previous step.
    fn full_step(
        &mut self,
        system: &mut (impl ResidualSystem + ?Sized),
        x: &mut [f64],
        full: f64,
        tolerance: f64,
    ) -> Result<f64> {
        let contraction = full / self.report.step;
        // the first step has no predecessor to compare with
        let mut error = f64::INFINITY;
        if self.report.iterations > 0 {
            [self.left, error] = (self.slowest(contraction, full))
                .map(|slowest| left_after(full, slowest) * slowest);
            self.rounding = self.is_rounding(system, x, [full, contraction, 1.0])?;
        }
        x.iter_mut()
            .zip(&self.step)
            .for_each(|(x, step)| *x -= step);
        if self.left > tolerance && !self.rounding {
            system.residual_into(x, &mut self.residual)?;
            self.report.residual_calls += 1;
            self.report.residual = residual_norm(system, &self.residual);
        }
        let residual = self.report.residual;
        self.report.stepped(full, residual, error);
        self.moved += full;
        Ok(contraction)
    }

    /// Applies the part of `step`, whose size is `full`, that the natural monotonicity test allows, and after a whole step the correction
    /// computed by the test. Returns the contraction: the size of that correction over that of the step.
    fn natural_step(
        &mut self,
        system: &mut (impl ResidualSystem + ?Sized),
        x: &mut [f64],
        full: f64,
        max_halvings: usize,
    ) -> Result<f64> {
        let mut length = 1.0;
        let mut next = f64::INFINITY;
        for halvings in 0.. {
            subtract(x, length, &self.step, &mut self.trial);
            let defined = system.residual_into(&self.trial, &mut self.residual);
            self.report.residual_calls += 1;
            match defined {
                Ok(()) => {
                    self.correction.copy_from_slice(&self.residual);
                    system.solve_in_place(&mut self.correction)?;
                    next = step_norm(system, &self.correction);
                    if length == 1.0 {
                        self.rounding = self.is_rounding(system, x, [full, next / full, 0.75])?;
                    }
                    if self.rounding || next <= (1.0 - 0.25 * length) * full {
                        break;
                    }
                }
                Err(error @ NewtonError::User(_)) => return Err(error),
                Err(error) => self.rejected = Some(error),
            }
            if halvings == max_halvings {
                return Err(self.not_converged(StopReason::LineSearch));
            }
            length *= 0.5;
        }
        let contraction = next / full;
        self.contraction = contraction;
        if self.rounding {
            if self.report.iterations == 0 {
                // already at rounding
                self.report.step = full;
                self.report.iteration_error = full;
            } else {
                // equations with less rounding, such as a volume's, profit from the last step
                x.copy_from_slice(&self.trial);
                let norm = residual_norm(system, &self.residual);
                self.report.stepped(full, norm, next.max(full));
            }
            return Ok(contraction);
        }
        self.left = f64::INFINITY;
        let moved = length * full + next;
        let slow = left_after(moved, self.slow) * self.slow;
        if length == 1.0 && contraction <= 0.25 {
            subtract(&self.trial, 1.0, &self.correction, x);
            system.residual_into(x, &mut self.residual)?;
            self.report.residual_calls += 1;
            // a frozen tangent contracts half as fast as the step taken with it
            let [left, error] = self.slowest(contraction, full);
            self.left = slow.max(2.0 * next * left);
            self.expected = 2.5 * next * error;
        } else {
            x.copy_from_slice(&self.trial);
            self.expected = left_after(next, contraction);
        }
        let error = slow.max(self.expected);
        let norm = residual_norm(system, &self.residual);
        self.report.stepped(length * full, norm, error);
        self.moved += moved;
        Ok(contraction)
    }
}

/// The norm of the residual; NaN if an entry is not finite, whatever the system's norm makes of it, or if that is negative.
fn residual_norm(system: &(impl ResidualSystem + ?Sized), residual: &[f64]) -> f64 {
    if_valid(residual, system.residual_norm(residual))
}

/// As [`residual_norm`], of a step.
fn step_norm(system: &(impl ResidualSystem + ?Sized), step: &[f64]) -> f64 {
    if_valid(step, system.step_norm(step))
}

fn if_valid(values: &[f64], norm: f64) -> f64 {
    match norm >= 0.0 && values.iter().all(|value| value.is_finite()) {
        true => norm,
        false => f64::NAN,
    }
}

/// Returns twice the sum of all steps from one of size `step` with this `contraction`, because other directions contract less; infinite if
/// they do not shrink.
fn left_after(step: f64, contraction: f64) -> f64 {
    match contraction < 1.0 {
        true => 2.0 * step / (1.0 - contraction),
        false => f64::INFINITY,
    }
}

/// `out` = x - length step
fn subtract(x: &[f64], length: f64, step: &[f64], out: &mut [f64]) {
    for ((out, x), step) in out.iter_mut().zip(x).zip(step) {
        *out = x - length * step;
    }
}
