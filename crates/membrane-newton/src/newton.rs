//! Newton's iteration with a line search on any system of equations.

use crate::error::{NewtonError, length};
use crate::options::{LineSearch, NewtonOptions, NewtonReport};

/// n equations in n unknowns whose tangent can be factored.
///
/// A system owns its workspace: none of these calls needs to allocate.
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
    /// r is not defined at x.
    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError>;

    /// Computes and factors the tangent dr/dx at x for [`ResidualSystem::solve_in_place`].
    ///
    /// # Errors
    /// The tangent is not defined or singular.
    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError>;

    /// Overwrites `rhs` with (dr/dx)^-1 `rhs` by the last factorisation.
    fn solve_in_place(&mut self, rhs: &mut [f64]);

    /// Size of a residual, free of units: of order one when the equations are not met at all.
    fn residual_norm(&self, residual: &[f64]) -> f64;

    /// Size of a change of the unknowns, free of units, relative to their scale.
    fn step_norm(&self, step: &[f64]) -> f64;
}

/// Vectors that [`newton_with`] works in; reusing them makes it free of allocation.
#[derive(Debug, Clone, Default)]
pub struct NewtonScratch {
    residual: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
    correction: Vec<f64>,
    report: NewtonReport,
}

impl NewtonScratch {
    /// What the last solve with this scratch did.
    pub fn report(&self) -> &NewtonReport {
        &self.report
    }
}

/// Solves r(x) = 0 from the given x, which is overwritten.
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
///     fn solve_in_place(&mut self, rhs: &mut [f64]) { rhs[0] /= self.1 }
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
/// [`NewtonError::NotConverged`] with the report; a tolerance that is no number or infinite;
/// [`NewtonError::WrongLength`] for an `x` of another length than the system's; errors of the system.
pub fn newton(
    system: &mut impl ResidualSystem,
    x: &mut [f64],
    options: &NewtonOptions,
) -> Result<NewtonReport, NewtonError> {
    let mut scratch = NewtonScratch::default();
    newton_with(system, x, options, &mut scratch)?;
    Ok(scratch.report)
}

/// A step this small that no longer shrinks is down to rounding: were it not, the next would be
/// of the order of its square. (Fine spectral elements of a membrane blown up to a thousand times its size have
/// steps of 2e-9 left.)
const ROUNDING: f64 = 1e-7;

/// [`newton`] in the caller's scratch: no allocation once the scratch has been used with a system
/// of this size (but for the report inside an error).
///
/// With [`LineSearch::Natural`] every full step is followed by a second one with the same
/// factorisation, which costs no more than a solve and makes the convergence cubic.
///
/// # Errors
/// As [`newton`]; x is then the last accepted one.
pub fn newton_with(
    system: &mut impl ResidualSystem,
    x: &mut [f64],
    options: &NewtonOptions,
    scratch: &mut NewtonScratch,
) -> Result<(), NewtonError> {
    let n = system.len();
    length("unknowns", x.len(), n)?;
    let NewtonScratch {
        residual,
        trial,
        step,
        correction,
        report,
    } = scratch;
    for vector in [&mut *residual, trial, step, correction] {
        vector.resize(n, 0.0);
    }
    options.check()?;
    report.restart(options.max_iterations);

    system.residual_into(x, residual)?;
    report.evaluated(system.residual_norm(residual));
    while report.residual > options.residual_tolerance {
        if report.iterations == options.max_iterations {
            return Err(NewtonError::NotConverged {
                report: report.clone(),
            });
        }
        system.factor(x)?;
        report.factorisations += 1;
        step.copy_from_slice(residual);
        system.solve_in_place(step);
        let full = system.step_norm(step);
        if full <= options.step_tolerance {
            report.step = full;
            break;
        }
        if !full.is_finite() {
            return Err(NewtonError::NotConverged {
                report: report.clone(),
            });
        }

        let LineSearch::Natural { max_halvings } = options.line_search else {
            subtract(x, 1.0, step, trial);
            x.copy_from_slice(trial);
            system.residual_into(x, residual)?;
            report.stepped(full, system.residual_norm(residual));
            continue;
        };
        let mut length = 1.0;
        let mut next = f64::INFINITY;
        for halvings in 0.. {
            subtract(x, length, step, trial);
            let defined = system.residual_into(trial, residual);
            report.residual_calls += 1;
            if defined.is_ok() {
                correction.copy_from_slice(residual);
                system.solve_in_place(correction);
                next = system.step_norm(correction);
                if next <= (1.0 - 0.25 * length) * full || (length == 1.0 && full <= ROUNDING) {
                    break;
                }
            }
            if halvings == max_halvings {
                return Err(NewtonError::NotConverged {
                    report: report.clone(),
                });
            }
            length *= 0.5;
        }
        if full <= ROUNDING && next > 0.25 * full {
            if report.iterations == 0 {
                // as exact as it gets already
                report.step = full;
            } else {
                // equations that rounding leaves alone, a volume's, profit from the last step too
                x.copy_from_slice(trial);
                report.stepped(full, system.residual_norm(residual));
            }
            break;
        }
        let mut left = f64::INFINITY;
        if length == 1.0 && next <= 0.25 * full {
            subtract(trial, 1.0, correction, x);
            system.residual_into(x, residual)?;
            report.residual_calls += 1;
            // A frozen tangent contracts twice as slowly as the step that was taken with it. That
            // was one direction; another may contract by no more than what the step changed.
            left = 2.0 * next * (next / full).max(full.min(0.01));
        } else {
            x.copy_from_slice(trial);
        }
        report.stepped(length * full, system.residual_norm(residual));
        if left <= options.step_tolerance {
            break;
        }
    }
    if report.residual.is_nan() {
        return Err(NewtonError::NotConverged {
            report: report.clone(),
        });
    }
    Ok(())
}

/// `out` = x - length step
fn subtract(x: &[f64], length: f64, step: &[f64], out: &mut [f64]) {
    for ((out, x), step) in out.iter_mut().zip(x).zip(step) {
        *out = x - length * step;
    }
}
