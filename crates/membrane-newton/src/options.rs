//! Options of Newton's iteration.

use crate::constraint::check;
use crate::error::Result;

/// Options of Newton's iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct NewtonOptions {
    /// Tolerance on the scaled residual; default 1e-15.
    pub residual_tolerance: f64,
    /// Tolerance on the scaled error of the unknowns, estimated from the contraction of the last corrections; default 1e-14. The estimate of
    /// [`NewtonReport::iteration_error`](crate::NewtonReport::iteration_error) has a margin for directions that contract less, and may exceed
    /// it. Either tolerance suffices for convergence. A [`Solver`](crate::Solver) uses at most 1e-9 for either, and also iterates until its
    /// control is met.
    pub step_tolerance: f64,
    /// Maximum number of iterations of one Newton solve. A [`Solver`](crate::Solver) may try several: directly, in continuation steps, and
    /// with finer polynomials; the report and [`NotConverged`](crate::NewtonError::NotConverged) count the iterations of all. Default 30.
    pub max_iterations: usize,
    /// Rule for the length of a step; default natural monotonicity with 10 halvings.
    pub line_search: LineSearch,
    /// Rule for new factorisations of the tangent; default each iteration.
    pub refactor: Refactor,
    /// Maximum number of steps of one continuation, also of those that fail; 0 disables continuation. The solver raises the control in steps if
    /// Newton fails from the start or converges to another branch. A solve may need several continuations, for rubber also one by volume, and
    /// [`NewtonReport::load_steps`](crate::NewtonReport::load_steps) counts the steps of all. These are full steps under the natural monotonicity
    /// test, whatever `line_search` is. Default 100.
    pub max_load_steps: usize,
}

/// The rule for the length of a Newton step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[non_exhaustive]
pub enum LineSearch {
    /// Only full steps: the textbook iteration.
    FullStep,
    /// Halves the step until the next correction, estimated with the same tangent, is smaller than this one: the natural monotonicity test
    /// (Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3), which does not depend on the scaling of the equations. With an
    /// approximate tangent that shrinks the error to more than 3/4 per step, no step passes the test, whatever its length;
    /// [`LineSearch::FullStep`] converges with any contraction below 1.
    #[doc(alias = "affine invariant", alias = "damped Newton")]
    Natural {
        /// Maximum number of halvings per iteration.
        max_halvings: usize,
    },
}

/// The rule for factoring the tangent.
#[doc(alias = "modified Newton", alias = "chord method")]
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Refactor {
    /// For each step, at the current unknowns.
    EachIteration,
    /// When a step fails, or contracts less than by this factor. Otherwise the last factorisation is reused, also by later solves with the
    /// same scratch ([`NewtonScratch`](crate::NewtonScratch)): for equations that change little, such as those of time steps. A value of
    /// 0.05 needs about two more solves for each saved factorisation. A solve rejects a factor that is negative or not finite.
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
    /// ([`OutOfRange`](crate::MembraneError::OutOfRange)).
    #[must_use]
    pub fn with_tolerances(mut self, residual: f64, step: f64) -> Self {
        self.residual_tolerance = residual;
        self.step_tolerance = step;
        self
    }

    /// Rejects tolerances and a factor of [`Refactor`] that are negative or not finite.
    pub(crate) fn check(&self) -> Result<()> {
        for (what, value) in [
            ("residual tolerance", self.residual_tolerance),
            ("step tolerance", self.step_tolerance),
        ] {
            check(what, value, 0.0)?;
        }
        if let Refactor::WhenContractionAbove(most) = self.refactor {
            check("contraction of Refactor", most, 0.0)?;
        }
        Ok(())
    }

    /// Sets the largest number of iterations of one Newton solve.
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
