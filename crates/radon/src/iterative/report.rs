//! When a solver stops, what it did, and who looks on.

use std::ops::ControlFlow;

use crate::Sample;
use crate::error::{RadonError, within};

/// Sees the report so far and the image after each step, and may end the run.
pub(crate) type Observer<'a, T> = &'a mut dyn FnMut(&IterativeReport, &[T]) -> ControlFlow<()>;

/// The observer of whoever does not look.
pub(super) fn nobody<T>(_: &IterativeReport, _: &[T]) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// When a solver stops, unless its observer does so first. With no rule set it makes `max_iterations` and that is success; with a rule set and not met it
/// returns [`RadonError::NotConverged`], and the image holds the last iterate all the same.
///
/// ```
/// use radon::Stopping;
/// // The first image that explains the data to 2 %, if it takes no more than 200 steps.
/// let stopping = Stopping::default().with_max_iterations(200).with_residual(0.02);
/// assert_eq!((stopping.max_iterations, stopping.residual, stopping.change), (200, Some(0.02), None));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stopping {
    /// Most iterations.
    pub max_iterations: usize,
    /// Stop at ‖A x - b‖ <= this times ‖b‖: the discrepancy principle, when it is the relative size of the noise.
    pub residual: Option<f64>,
    /// Stop after a step with ‖Δx‖ <= this times ‖x‖.
    pub change: Option<f64>,
}

impl Default for Stopping {
    /// Fifty iterations, no rule.
    fn default() -> Self {
        Self {
            max_iterations: 50,
            residual: None,
            change: None,
        }
    }
}

/// One iteration: what was known of the image that it started from, and the step it made.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Iteration {
    /// ‖A x - b‖ / ‖b‖ before the step.
    pub residual: f64,
    /// ‖Aᵀ(b - A x)‖ / ‖Aᵀ b‖ before the step (CGLS).
    pub gradient: Option<f64>,
    /// Poisson log-likelihood Σ b ln(A x + s) - (A x + s), without the term of b alone, before the step (MLEM, OSEM).
    pub log_likelihood: Option<f64>,
    /// ‖Δx‖ / ‖x‖ of the step; `None` when a rule was met before it.
    pub change: Option<f64>,
}

/// Why a solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StoppedBy {
    /// All iterations were made and no rule was set.
    MaxIterations,
    /// The observer said so.
    Observer,
    /// The residual rule.
    Residual,
    /// The gradient rule (CGLS).
    Gradient,
    /// The change rule.
    Change,
    /// No step was left to make: the image solves the problem exactly.
    Solved,
}

/// What a solver did.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct IterativeReport {
    /// Steps made.
    pub iterations: usize,
    /// Why it stopped; `None` when a rule was set and not met.
    pub stopped_by: Option<StoppedBy>,
    /// One entry a step, and one more for the image at which the residual or gradient rule was met.
    pub history: Vec<Iteration>,
}

impl IterativeReport {
    pub(super) fn new() -> Self {
        Self {
            iterations: 0,
            stopped_by: None,
            history: Vec::new(),
        }
    }

    /// Records a step and shows the image after it to the observer; returns whether to stop.
    pub(super) fn step<T: Sample>(
        &mut self,
        entry: Iteration,
        stopping: &Stopping,
        image: &[T],
        observe: Observer<'_, T>,
    ) -> bool {
        self.history.push(entry);
        self.iterations += 1;
        let told = observe(self, image).is_break();
        let rule = stopping.change.zip(entry.change);
        self.stopped_by = self.stopped_by.or(match rule {
            Some((rule, change)) if change <= rule => Some(StoppedBy::Change),
            _ => told.then_some(StoppedBy::Observer),
        });
        self.stopped_by.is_some()
    }

    /// Ends a run: an error if a rule was set and not met.
    pub(super) fn finish(mut self, any_rule: bool) -> Result<Self, RadonError> {
        if self.stopped_by.is_none() {
            if any_rule {
                let report = Box::new(self);
                return Err(RadonError::NotConverged { report });
            }
            self.stopped_by = Some(StoppedBy::MaxIterations);
        }
        Ok(self)
    }
}

impl Stopping {
    /// The same with another number of iterations at most.
    pub fn with_max_iterations(mut self, max_iterations: usize) -> Self {
        self.max_iterations = max_iterations;
        self
    }

    /// The same with a residual rule.
    pub fn with_residual(mut self, residual: f64) -> Self {
        self.residual = Some(residual);
        self
    }

    /// The same with a change rule.
    pub fn with_change(mut self, change: f64) -> Self {
        self.change = Some(change);
        self
    }

    pub(super) fn check(&self) -> Result<(), RadonError> {
        for (name, rule) in [
            ("residual rule", self.residual),
            ("change rule", self.change),
        ] {
            if let Some(rule) = rule {
                within(name, rule, 0.0, f64::MAX)?;
            }
        }
        Ok(())
    }

    pub(super) fn any_rule(&self) -> bool {
        self.residual.is_some() || self.change.is_some()
    }
}
