//! Newton's iteration with a line search on any system of equations.

use crate::error::NewtonError;

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

/// When to stop and how to search.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonOptions {
    /// Converged when the scaled residual is at most this.
    pub residual_tolerance: f64,
    /// Converged after a full step whose scaled size is at most this (the error left is of the
    /// order of its square).
    pub step_tolerance: f64,
    /// Give up after this many iterations.
    pub max_iterations: usize,
    /// Whether steps are shortened, and how often a step may be halved.
    pub line_search: LineSearch,
}

/// How the length of a Newton step is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineSearch {
    /// Always the full step.
    FullStep,
    /// Halve the step until the next correction, estimated with the tangent at hand, is smaller
    /// than this one: the natural monotonicity test (Deuflhard, Newton Methods for Nonlinear
    /// Problems, 2004, section 3.3), which does not depend on how the equations are scaled.
    Natural {
        /// Most halvings in one iteration.
        max_halvings: usize,
    },
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            residual_tolerance: 1e-13,
            step_tolerance: 1e-9,
            max_iterations: 50,
            line_search: LineSearch::Natural { max_halvings: 12 },
        }
    }
}

impl NewtonOptions {
    /// The same with other tolerances on the scaled residual and the scaled step.
    pub fn with_tolerances(mut self, residual: f64, step: f64) -> Self {
        self.residual_tolerance = residual;
        self.step_tolerance = step;
        self
    }

    /// The same with another limit on the iterations.
    pub fn with_max_iterations(mut self, max_iterations: usize) -> Self {
        self.max_iterations = max_iterations;
        self
    }

    /// The same with another line search.
    pub fn with_line_search(mut self, line_search: LineSearch) -> Self {
        self.line_search = line_search;
        self
    }
}

/// What a solve did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NewtonReport {
    /// Newton steps taken.
    pub iterations: usize,
    /// Factorisations of the tangent.
    pub factorisations: usize,
    /// Evaluations of the residual.
    pub residual_calls: usize,
    /// Scaled residual at the result.
    pub residual: f64,
    /// Scaled size of the last step, infinite if none was taken.
    pub step: f64,
    /// Scaled residual before the first step and after each.
    pub history: Vec<f64>,
}

/// Solves r(x) = 0 from the given x, which is overwritten.
///
/// # Errors
/// [`NewtonError::NotConverged`] with the report; errors of the system.
///
/// # Panics
/// `x` has not the length of the system.
pub fn newton(
    system: &mut impl ResidualSystem,
    x: &mut [f64],
    options: &NewtonOptions,
) -> Result<NewtonReport, NewtonError> {
    let n = system.len();
    assert_eq!(x.len(), n, "unknowns");
    let (mut residual, mut trial) = (vec![0.0; n], vec![0.0; n]);
    let (mut step, mut correction) = (vec![0.0; n], vec![0.0; n]);
    let mut report = NewtonReport {
        step: f64::INFINITY,
        ..Default::default()
    };

    system.residual_into(x, &mut residual)?;
    report.residual_calls = 1;
    report.residual = system.residual_norm(&residual);
    report.history.push(report.residual);
    while report.residual > options.residual_tolerance {
        if report.iterations == options.max_iterations {
            return Err(NewtonError::NotConverged { report });
        }
        system.factor(x)?;
        report.factorisations += 1;
        step.copy_from_slice(&residual);
        system.solve_in_place(&mut step);
        let full = system.step_norm(&step);

        let mut length = 1.0;
        let mut halvings_left = match options.line_search {
            LineSearch::FullStep => 0,
            LineSearch::Natural { max_halvings } => max_halvings,
        };
        loop {
            for i in 0..n {
                trial[i] = x[i] - length * step[i];
            }
            let defined = system.residual_into(&trial, &mut residual);
            report.residual_calls += 1;
            if defined.is_ok() && (halvings_left == 0 || length * full <= options.step_tolerance) {
                break;
            }
            if defined.is_ok() {
                correction.copy_from_slice(&residual);
                system.solve_in_place(&mut correction);
                if system.step_norm(&correction) <= (1.0 - 0.25 * length) * full {
                    break;
                }
            } else if halvings_left == 0 {
                defined?;
            }
            halvings_left -= 1;
            length *= 0.5;
        }
        x.copy_from_slice(&trial);
        report.iterations += 1;
        report.residual = system.residual_norm(&residual);
        report.step = full * length;
        report.history.push(report.residual);
        if !(report.residual.is_finite() && full.is_finite()) {
            return Err(NewtonError::NotConverged { report });
        }
        if length == 1.0 && full <= options.step_tolerance {
            break;
        }
    }
    Ok(report)
}
