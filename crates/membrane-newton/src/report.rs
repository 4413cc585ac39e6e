//! The report of a solve.

/// The report of a solve. Numbers that are not finite are `null` in JSON, and read as infinite.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NewtonReport {
    /// Newton iterations: steps of the unknowns; the second correction of [`LineSearch::Natural`](crate::LineSearch::Natural) belongs to its step.
    pub iterations: usize,
    /// Factorisations of the tangent.
    pub factorisations: usize,
    /// Evaluations of the residual.
    pub residual_calls: usize,
    /// Continuation steps tried in all continuations, 0 if Newton needed none.
    pub load_steps: usize,
    /// Scaled residual at the result; before the last step if [`LineSearch::FullStep`](crate::LineSearch::FullStep) ended by the estimated
    /// error.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "stored::number"))]
    pub residual: f64,
    /// Scaled size of the last step, infinite if none was computed.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "stored::number"))]
    pub step: f64,
    /// Estimated error of Newton's iteration: the sum of the steps that would follow, from the contraction of the last ones. It assumes that
    /// [`ResidualSystem::factor`](crate::ResidualSystem::factor) factors the derivative of the residual at x or, if reused, at an earlier x;
    /// before the first step that at x, and before the second a regular root. With a reused tangent near a singular root the error may be
    /// larger. With an approximate tangent, steps in directions of fast convergence can hide a slower one: the error may then exceed the estimate,
    /// and the step tolerance, by any factor, which a tolerance on the residual does not. It does not include that of the discretisation
    /// ([`Equilibrium::discretisation_error`](crate::Equilibrium::discretisation_error)). For membranes it includes the rounding of the
    /// equations, estimated with the last factorisation; [`newton`](crate::newton) of other systems does not estimate this part.
    ///
    /// Scaled, in the norm of [`ResidualSystem::step_norm`](crate::ResidualSystem::step_norm), and at least rounding: epsilon times the norm of
    /// the unknowns. The norm of membranes is the larger of two: the largest change of a coordinate over the length of the start (or the largest
    /// coordinate), and the change of the intensity over the prescribed one, or, with a prescribed area or volume, over the larger of the
    /// intensity and that which moves the membrane by its length. At a small prescribed volume the relative error of the intensity is larger.
    /// Infinite if no contraction is known: after a single step of [`LineSearch::FullStep`](crate::LineSearch::FullStep).
    #[cfg_attr(feature = "serde", serde(deserialize_with = "stored::number"))]
    pub iteration_error: f64,
    /// The test that ended the last iteration, also of a failed solve; `None` if no iteration was started.
    pub stopped_by: Option<StopReason>,
    /// Scaled residual before the first iteration and after each.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "stored::numbers"))]
    pub history: Vec<f64>,
}

/// The test that ended a Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StopReason {
    /// The scaled residual is within its tolerance.
    Residual,
    /// The estimated error is within the step tolerance.
    Step,
    /// Steps no longer shrink because of rounding; smaller tolerances cannot be met. Steps that shrink slowly, with an approximate tangent or at
    /// a singular root, are continued.
    Rounding,
    /// The system ended the solve: [`ResidualSystem::observe`](crate::ResidualSystem::observe).
    Observer,
    /// Failure: the largest number of iterations is reached.
    Iterations,
    /// Failure: no step of the line search reduces the correction, for instance because the tangent is not the derivative of the residual.
    LineSearch,
    /// Failure: the residual or the step is NaN or infinite.
    NotFinite,
    /// Failure: the continuation steps are used up ([`NewtonError::LimitPoint`](crate::NewtonError::LimitPoint) or `OtherBranch`).
    LoadSteps,
}

#[cfg(feature = "serde")]
mod stored {
    use serde::{Deserialize, Deserializer};

    pub(super) fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        // other formats have infinity, and some of them no optional numbers
        if !from.is_human_readable() {
            return f64::deserialize(from);
        }
        Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
    }

    pub(super) fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        #[derive(Deserialize)]
        struct Number(#[serde(deserialize_with = "number")] f64);
        let numbers = Vec::<Number>::deserialize(from)?;
        Ok(numbers.into_iter().map(|number| number.0).collect())
    }
}

impl NewtonReport {
    /// Resets the report, keeping its memory.
    pub(crate) fn restart(&mut self, max_iterations: usize) {
        let mut history = std::mem::take(&mut self.history);
        history.clear();
        // limits the memory for a very large maximum
        history.reserve(max_iterations.min(1000) + 1);
        *self = Self {
            step: f64::INFINITY,
            iteration_error: f64::INFINITY,
            history,
            ..Self::default()
        };
    }

    /// The empty report of a solve that ended by this test.
    pub(crate) fn ended(stopped_by: Option<StopReason>) -> Box<Self> {
        Box::new(Self {
            stopped_by,
            ..Self::default()
        })
    }

    pub(crate) fn evaluated(&mut self, residual: f64) {
        self.residual_calls += 1;
        self.residual = residual;
        self.history.push(residual);
    }

    pub(crate) fn stepped(&mut self, step: f64, residual: f64, error: f64) {
        self.iterations += 1;
        self.step = step;
        self.iteration_error = error;
        self.residual = residual;
        self.history.push(residual);
    }

    /// Raises the estimated error to the rounding of unknowns of this norm.
    pub(crate) fn floor(&mut self, norm: f64) {
        self.iteration_error = self.iteration_error.max(f64::EPSILON * norm);
    }

    /// Adds the report of an earlier solve.
    pub(crate) fn add_earlier(&mut self, earlier: &Self) {
        self.iterations += earlier.iterations;
        self.factorisations += earlier.factorisations;
        self.residual_calls += earlier.residual_calls;
        self.load_steps += earlier.load_steps;
        self.history.splice(0..0, earlier.history.iter().copied());
    }
}
