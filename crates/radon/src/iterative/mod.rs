//! Iterative reconstruction on any operator with an adjoint.

mod cgls;
mod em;
mod sirt;
mod vectors;

pub use cgls::{CglsOptions, cgls};
pub use em::{EmOptions, Subset, mlem, osem};
pub use sirt::{SirtOptions, sirt};

use crate::Sample;
use crate::error::{RadonError, length, within};
use vectors::check_samples;

/// A linear map A from images to data, with its adjoint; implement it for your own to use the solvers.
///
/// The solvers need <A x, y> = <x, Aᵀ y> to rounding. Lengths are checked before the first call.
///
/// ```
/// use radon::{CglsOptions, LinearOperator, RadonError, cgls};
/// struct Differences; // of three numbers
/// impl LinearOperator<f64> for Differences {
///     fn image_len(&self) -> usize { 3 }
///     fn data_len(&self) -> usize { 3 }
///     fn forward_into(&self, x: &[f64], y: &mut [f64]) -> Result<(), RadonError> {
///         y.copy_from_slice(&[x[0], x[1] - x[0], x[2] - x[1]]);
///         Ok(())
///     }
///     fn adjoint_into(&self, y: &[f64], x: &mut [f64]) -> Result<(), RadonError> {
///         x.copy_from_slice(&[y[0] - y[1], y[1] - y[2], y[2]]);
///         Ok(())
///     }
/// }
/// let mut x = vec![0.0; 3];
/// cgls(&Differences, &[1.0, 1.0, 2.0], &mut x, &CglsOptions::default().with_gradient(1e-12))?;
/// assert!((x[2] - 4.0).abs() < 1e-10);
/// # Ok::<(), RadonError>(())
/// ```
pub trait LinearOperator<T: Sample> {
    /// Number of unknowns.
    fn image_len(&self) -> usize;
    /// Number of data.
    fn data_len(&self) -> usize;
    /// Writes A x to `data`.
    ///
    /// # Errors
    /// What the operator refuses; the solver stops with it.
    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError>;
    /// Writes Aᵀ y to `image`.
    ///
    /// # Errors
    /// What the operator refuses; the solver stops with it.
    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError>;
}

/// When a solver stops. With no rule set it makes `max_iterations` and that is success; with a rule set and not met it
/// returns [`RadonError::NotConverged`], and the image holds the last iterate all the same.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    fn new() -> Self {
        Self {
            iterations: 0,
            stopped_by: None,
            history: Vec::new(),
        }
    }

    /// Ends a run: an error if a rule was set and not met.
    fn finish(mut self, any_rule: bool) -> Result<Self, RadonError> {
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
    fn check(&self) -> Result<(), RadonError> {
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

    fn any_rule(&self) -> bool {
        self.residual.is_some() || self.change.is_some()
    }
}

/// Lengths and finiteness of what every solver is given.
fn check_input<T: Sample>(
    operator: &(impl LinearOperator<T> + ?Sized),
    data: &[T],
    image: &[T],
) -> Result<(), RadonError> {
    length("data", data.len(), operator.data_len())?;
    length("image", image.len(), operator.image_len())?;
    check_samples("data", data)?;
    check_samples("image", image)
}
