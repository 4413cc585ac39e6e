//! Stopping rules and observers of solvers.

use std::ops::ControlFlow;

use super::report::{Iteration, IterativeReport, StopReason};
use crate::Sample;
use crate::error::{BELOW_ONE, RadonError, within};

/// A callback after each step.
pub(super) type Observer<'a, T> = &'a mut dyn FnMut(&IterativeReport, &[T]) -> ControlFlow<()>;

/// Continues: the `watch` of a solver that neither reports its progress nor ends early.
///
/// Solvers call `watch` after each step (OSEM: after each iteration through all subsets) with the report so far and the image. They end with
/// [`StopReason::Observer`] when it returns `ControlFlow::Break`.
///
/// ```
/// use std::ops::ControlFlow;
/// use radon::{EmOptions, ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector, StopReason, mlem};
/// let geometry = ParallelGeometry::half_turn(30, 16, 1.0)?;
/// let projector = Projector::new(&geometry, &ImageGrid::square(11, 1.0)?, Kernel::Strip)?;
/// let truth: Vec<f64> = (0..121).map(|i| f64::from(i % 3)).collect();
/// let counts = projector.forward(&truth)?;
/// let mut image = vec![1.0; 121];
/// // Until the largest pixel is above 1.9.
/// let report = mlem(&projector, &counts, &mut image, &EmOptions::default(), |report, image| {
///     println!("{} steps, residual {}", report.iterations, report.history[report.iterations - 1].residual);
///     match image.iter().any(|&x| x > 1.9) {
///         true => ControlFlow::Break(()),
///         false => ControlFlow::Continue(()),
///     }
/// })?;
/// assert_eq!(report.stopped_by, Some(StopReason::Observer));
/// assert!(report.iterations < 50 && image.iter().any(|&x| x > 1.9));
/// # Ok::<(), radon::RadonError>(())
/// ```
pub fn no_observer<T>(_: &IterativeReport, _: &[T]) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Stopping rules of a solver. Without a rule, `max_iterations` iterations are a success. If a rule is set and not met, the solver returns
/// [`RadonError::NotConverged`], and the image contains the last iterate.
///
/// ```
/// use radon::Stopping;
/// // The first image that fits the data to 2 %, in at most 200 steps.
/// let stopping = Stopping::default().with_max_iterations(200).with_residual(0.02);
/// assert_eq!((stopping.max_iterations, stopping.residual, stopping.change), (200, Some(0.02), None));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct Stopping {
    /// Maximum number of iterations; 50 by default.
    pub max_iterations: usize,
    /// Stop at ‖A x - b‖ <= this times ‖b‖, in [0, 1): the discrepancy principle, when it is the relative size of the noise. None by default.
    pub residual: Option<f64>,
    /// Stop after a step with ‖Δx‖ <= this times ‖x‖, with the image x after the step. None by default.
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

impl Stopping {
    setters! {
        /// Sets the maximum number of iterations.
        with_max_iterations(max_iterations: usize);
        /// Sets the residual rule.
        with_residual(residual: f64);
        /// Sets the rule for the change of the image.
        with_change(change: f64);
    }
}

/// The stopping rules of a run, its report so far, and its observer.
pub(super) struct Monitor<'a, T> {
    stopping: Stopping,
    /// The gradient rule of CGLS.
    gradient: Option<f64>,
    observe: Observer<'a, T>,
    report: IterativeReport,
}

impl<'a, T: Sample> Monitor<'a, T> {
    /// Checks the rules.
    pub(super) fn new(
        stopping: Stopping,
        gradient: Option<f64>,
        observe: Observer<'a, T>,
    ) -> Result<Self, RadonError> {
        use StopReason::{Change, Gradient, Residual};
        let mut unmet_rules = Vec::new();
        for (what, reason, rule, most) in [
            ("residual rule", Residual, stopping.residual, BELOW_ONE),
            ("change rule", Change, stopping.change, f64::MAX),
            ("gradient rule", Gradient, gradient, f64::MAX),
        ] {
            if let Some(rule) = rule {
                within(what, rule, 0.0, most)?;
                unmet_rules.push((reason, rule));
            }
        }
        Ok(Self {
            stopping,
            gradient,
            observe,
            report: IterativeReport {
                iterations: 0,
                stopped_by: None,
                unmet_rules,
                history: Vec::new(),
            },
        })
    }

    /// Whether all iterations have been made.
    pub(super) fn is_last(&self) -> bool {
        self.report.iterations == self.stopping.max_iterations
    }

    /// Whether the residual rule is set.
    pub(super) fn wants_residual(&self) -> bool {
        self.stopping.residual.is_some()
    }

    /// Whether an image with this relative residual meets the residual rule.
    pub(super) fn is_explained(&self, residual: f64) -> bool {
        self.stopping.residual.is_some_and(|rule| residual <= rule)
    }

    /// The rule that an image with this relative residual and this gradient meets; the gradient rule is relative to `scale`.
    pub(super) fn met(&self, residual: f64, gradient: f64, scale: f64) -> Option<StopReason> {
        let is_flat = self.gradient.is_some_and(|rule| gradient <= rule * scale);
        match () {
            () if self.is_explained(residual) => Some(StopReason::Residual),
            () if is_flat => Some(StopReason::Gradient),
            () if gradient == 0.0 => Some(StopReason::Solved),
            () => None,
        }
    }

    /// Ends the run at the image of `entry`, without a step.
    pub(super) fn stop_at(&mut self, entry: Iteration, why: StopReason) {
        self.report.history.push(entry);
        self.report.stopped_by = Some(why);
    }

    /// Ends the run after the next step.
    pub(super) fn stop_after(&mut self, why: StopReason) {
        self.report.stopped_by = Some(why);
    }

    /// Records a step and calls the observer with the image; returns whether to stop.
    pub(super) fn step(&mut self, entry: Iteration, image: &[T]) -> bool {
        let report = &mut self.report;
        report.history.push(entry);
        report.iterations += 1;
        let told = (self.observe)(report, image).is_break();
        let rule = self.stopping.change.zip(entry.change);
        report.stopped_by = report.stopped_by.or(match rule {
            Some((rule, change)) if change <= rule => Some(StopReason::Change),
            _ => told.then_some(StopReason::Observer),
        });
        report.stopped_by.is_some()
    }

    /// Ends a run: returns an error if a rule was set and not met.
    pub(super) fn finish(self) -> Result<IterativeReport, RadonError> {
        let mut report = self.report;
        if report.stopped_by.is_some() {
            report.unmet_rules.clear();
        } else if !report.unmet_rules.is_empty() {
            let report = Box::new(report);
            return Err(RadonError::NotConverged { report });
        } else {
            let all = report.iterations == self.stopping.max_iterations;
            report.stopped_by = Some(match all {
                true => StopReason::MaxIterations,
                false => StopReason::Solved,
            });
        }
        Ok(report)
    }
}
