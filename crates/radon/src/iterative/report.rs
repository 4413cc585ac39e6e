//! Reports of the iterative solvers.

/// One iteration: residual, gradient and log-likelihood of the image before the step, and the size of the step. [`cgls`](crate::cgls) computes
/// residual and gradient from the image in the first entry and in that of a met rule, and by recurrence in the others.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Iteration {
    /// ‖A x - b‖ / ‖b‖ before the step; ‖A x‖ if b = 0.
    pub residual: f64,
    /// ‖Aᵀ(b - A x)‖ / ‖Aᵀ b‖ before the step (CGLS).
    pub gradient: Option<f64>,
    /// Poisson log-likelihood Σ b ln(A x + s) - (A x + s), without the term of b alone, before the step (MLEM, OSEM).
    pub log_likelihood: Option<f64>,
    /// ‖Δx‖ / ‖x‖ of the step, with the image x after it; `None` when a rule was met before it.
    pub change: Option<f64>,
}

impl Iteration {
    /// The entry of an image with a known residual.
    pub(super) fn at(residual: f64) -> Self {
        Self {
            residual,
            gradient: None,
            log_likelihood: None,
            change: None,
        }
    }
}

/// The reason why a solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// All iterations were made, and no rule was set.
    MaxIterations,
    /// The observer stopped it.
    Observer,
    /// The residual rule.
    Residual,
    /// The gradient rule (CGLS).
    Gradient,
    /// The change rule.
    Change,
    /// No step remains: the gradient is zero, or rounding prevents its reduction (CGLS).
    Solved,
}

/// Iterations and history of a solver.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct IterativeReport {
    /// Steps made.
    pub iterations: usize,
    /// Why it stopped; `None` when a rule was set and not met.
    pub stopped_by: Option<StopReason>,
    /// The rules that were set, with their bounds; empty if it stopped for a reason.
    pub unmet_rules: Vec<(StopReason, f64)>,
    /// One entry per step, and one for the last image if it met the residual or gradient rule or its gradient is zero.
    pub history: Vec<Iteration>,
}

impl IterativeReport {
    /// Lists the unmet rules with the values in the last entry of the history.
    pub(crate) fn unmet(&self) -> String {
        let value = |rule: &StopReason| match (self.history.last()?, rule) {
            (last, StopReason::Change) => last.change,
            (last, StopReason::Gradient) => last.gradient,
            (last, _) => Some(last.residual),
        };
        let rule = |(rule, bound): &(StopReason, f64)| {
            let (name, value) = (format!("{rule:?}"), value(rule).unwrap_or(f64::NAN));
            format!("; {} {value:.3e} (rule {bound:?})", name.to_lowercase())
        };
        self.unmet_rules.iter().map(rule).collect()
    }
}
