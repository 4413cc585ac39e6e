//! What an iterative solver did.

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

impl Iteration {
    /// Of an image of which the residual alone is known.
    pub(super) fn at(residual: f64) -> Self {
        Self {
            residual,
            gradient: None,
            log_likelihood: None,
            change: None,
        }
    }
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
