//! Options of Newton's iteration.

use crate::constraint::check;
use crate::error::{BELOW_ZERO, NewtonError};

/// Options of Newton's iteration.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NewtonOptions {
    /// Converged when the scaled residual is at most this.
    pub residual_tolerance: f64,
    /// Converged when the scaled error left in the unknowns, estimated from the last two
    /// corrections, is at most this, or when the step itself is.
    pub step_tolerance: f64,
    /// Give up after this many iterations.
    pub max_iterations: usize,
    /// How the length of a step is chosen.
    pub line_search: LineSearch,
    /// When the tangent is factored again.
    pub refactor: Refactor,
    /// When Newton fails from where it starts, or finds what is not on the branch of the start, the
    /// solver raises the control in steps instead (continuation), at most this many; 0 turns that
    /// off. These steps are taken by full steps under the natural monotonicity test, whatever
    /// `line_search` is.
    pub max_load_steps: usize,
}

/// The rule for the length of a Newton step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LineSearch {
    /// Always the full step, and nothing but it: the textbook iteration.
    FullStep,
    /// Halve the step until the next correction, estimated with the tangent at hand, is smaller
    /// than this one: the natural monotonicity test (Deuflhard, Newton Methods for Nonlinear
    /// Problems, 2004, section 3.3), which does not depend on how the equations are scaled.
    Natural {
        /// Most halvings in one iteration.
        max_halvings: usize,
    },
}

/// The rule for factoring the tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Refactor {
    /// For each step, at the current unknowns.
    EachIteration,
    /// When a step contracts by no more than this factor, or leads nowhere. Between that the last factorisation serves, also from one solve to
    /// the next with the same scratch ([`NewtonScratch`](crate::NewtonScratch)): for equations that change little, such as those of time
    /// steps. 0.05 costs about two more solves where it saves a factorisation.
    WhenContractionAbove(f64),
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            residual_tolerance: 1e-15,
            step_tolerance: 1e-14,
            max_iterations: 30,
            line_search: LineSearch::Natural { max_halvings: 10 },
            refactor: Refactor::EachIteration,
            max_load_steps: 100,
        }
    }
}

impl NewtonOptions {
    /// Sets the tolerances on the scaled residual and the scaled step; a solve rejects those that are negative or not finite
    /// ([`NewtonError::OutOfRange`]).
    #[must_use]
    pub fn with_tolerances(mut self, residual: f64, step: f64) -> Self {
        self.residual_tolerance = residual;
        self.step_tolerance = step;
        self
    }

    /// Rejects tolerances that are negative or not finite.
    pub(crate) fn check(&self) -> Result<(), NewtonError> {
        for (what, value) in [
            ("residual tolerance", self.residual_tolerance),
            ("step tolerance", self.step_tolerance),
        ] {
            check(what, value, BELOW_ZERO)?;
        }
        Ok(())
    }

    /// Sets the largest number of iterations.
    #[must_use]
    pub fn with_max_iterations(mut self, max_iterations: usize) -> Self {
        self.max_iterations = max_iterations;
        self
    }

    /// Sets the line search.
    #[must_use]
    pub fn with_line_search(mut self, line_search: LineSearch) -> Self {
        self.line_search = line_search;
        self
    }

    /// Sets the rule for factorisations.
    #[must_use]
    pub fn with_refactor(mut self, refactor: Refactor) -> Self {
        self.refactor = refactor;
        self
    }

    /// Sets the largest number of continuation steps.
    #[must_use]
    pub fn with_max_load_steps(mut self, max_load_steps: usize) -> Self {
        self.max_load_steps = max_load_steps;
        self
    }
}
