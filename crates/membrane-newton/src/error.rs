//! The error type of the crate.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

use membrane_forces::MembraneError;

use crate::report::{NewtonReport, StopReason};

pub(crate) type Result<T, E = NewtonError> = std::result::Result<T, E>;

/// An error of a solve, with the report of the attempts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonError {
    /// A membrane, control or option is out of range, a vector or matrix has a wrong size, or forces are not defined for the membrane or its state.
    #[error(transparent)]
    Membrane(#[from] MembraneError),
    /// An error of the caller's own [`ResidualSystem`](crate::ResidualSystem): [`NewtonError::user`].
    #[error(transparent)]
    User(UserError),
    /// Solving requires a factorisation.
    #[error("no tangent has been factored; solving requires a factorisation")]
    NotFactored,
    /// A pivot is zero, so small that its reciprocal overflows, or not finite. A singular matrix may have pivots that are nonzero by rounding,
    /// without this error.
    #[error("singular matrix: pivot {pivot:?} in row {row}")]
    Singular {
        /// Row of the vanishing pivot.
        row: usize,
        /// Its value.
        pivot: f64,
    },
    /// The outer membrane of a pair does not enclose more volume than the inner one, or a fixed end in the same plane or the apex of the inner
    /// one is outside it.
    #[error(
        "the {what} of the inner membrane is {inner:?}, of the outer one {outer:?}: the outer one must enclose the inner one"
    )]
    NotEnclosed {
        /// The quantity with its unit: the volume, the distance of an end from the axis, or the largest x.
        what: &'static str,
        /// Its value for the inner membrane.
        inner: f64,
        /// Its value for the outer membrane.
        outer: f64,
    },
    /// The membranes of a solved pair cross. Crossings between two nodes of the inner one may not be found.
    #[error(
        "the inner membrane is {depth:?} cm outside the outer one at x = {x:?} cm, r = {r:?} cm: the membranes cross"
    )]
    Crossed {
        /// Largest distance of the inner membrane outside the outer one, cm.
        depth: f64,
        /// Position there along the axis, cm.
        x: f64,
        /// Distance from the axis there, cm.
        r: f64,
    },
    /// The force intensities of the two membranes of a pair have different units.
    #[error("the inner membrane is of {inner}, the outer one of {outer}; both must be of one kind")]
    MixedPair {
        /// Material and kind of load of the inner membrane.
        inner: &'static str,
        /// Material and kind of load of the outer membrane.
        outer: &'static str,
    },
    /// The control was raised from the start but did not reach `wanted`. If [`NewtonReport::stopped_by`] is [`StopReason::LoadSteps`], the load
    /// steps are used up and the branch of equilibria continues. Otherwise no step past `reached` succeeds, down to about 1e-4 of it: the branch
    /// turns back, the enclosed volume falls to zero, or Newton's method does not converge in double precision, as under pressures just below the
    /// limit of [`PastBlowUp`](MembraneError::PastBlowUp). Another control, often area or volume, may continue. For a pressure of rubber,
    /// `reached` is the first maximum of the pressure along the branch from the start, to rounding. Rubber that stiffens, such as that of Gent,
    /// has equilibria at higher pressures beyond it ([`Solver::solve_from`](crate::Solver::solve_from)).
    #[error("no equilibrium found beyond {reached:?}, {wanted:?} wanted; {quantity}, {} load steps{}", report.load_steps, used_up(report))]
    LimitPoint {
        /// The quantity of the control with its unit; a volume for a volume gain.
        quantity: &'static str,
        /// Last solved value of the control, in the unit of the control; a volume for a volume gain.
        reached: f64,
        /// The requested value, in the same unit.
        wanted: f64,
        /// Report of the attempts.
        report: Box<NewtonReport>,
    },
    /// The finest polynomials do not meet the tolerance.
    #[error(
        "not resolved: the last coefficients are {tail:e} of the length, tolerance {tolerance:e}"
    )]
    Unresolved {
        /// Twice the degree times the last two coefficients, over the length of the curve; the largest of any element.
        tail: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// Newton converged to an equilibrium that no change of the control reaches from the start: past a limit point, or with more loops.
    /// Occurs only without load steps ([`NewtonOptions::max_load_steps`](crate::NewtonOptions::max_load_steps)) or if none leaves the
    /// start; [`NewtonReport::stopped_by`] is [`StopReason::LoadSteps`] if they are used up.
    #[error("not on the branch of the start: {} iterations, {} load steps{}", report.iterations, report.load_steps, used_up(report))]
    OtherBranch {
        /// Report of the attempts.
        report: Box<NewtonReport>,
    },
    /// Rubber is compressed along the meridian, in the result or on the way to it. A membrane has no such equilibrium.
    #[error("slack: the tension along the meridian falls to {tension:?} times the shear modulus")]
    Slack {
        /// Least tension, dW/dl1 over l1 and the shear modulus.
        tension: f64,
    },
    /// The curve encloses no body: walls intersect, or it is inside out ([`collapse`](membrane_forces::collapse), between the nodes by lines).
    /// The condition is that of the plane curve. A membrane without mirror symmetry may bend to one side of the axis without this error; its
    /// upper half then crosses the axis before the apex, and its volume of revolution has no meaning.
    #[error("collapsed: walls of the membrane meet or are inside out near s = {s:?}")]
    Collapsed {
        /// Material coordinate of a node where the walls meet, or of the apex.
        s: f64,
    },
    /// An eigenvalue within rounding, or one for which inverse iteration does not converge.
    #[error("the lowest eigenvalue does not settle near {eigenvalue:?}")]
    Unsettled {
        /// The last estimate.
        eigenvalue: f64,
    },
    /// Newton stopped before residual or step met their tolerances. The number of iterations is that of all attempts, each with at most
    /// [`NewtonOptions::max_iterations`](crate::NewtonOptions::max_iterations).
    #[error("not converged after {} iterations in all attempts: {}; scaled residual {:e}, scaled step {:e}", report.iterations, failure(report.stopped_by), report.residual, report.step)]
    NotConverged {
        /// Report of the attempts. [`NewtonReport::stopped_by`] is the cause of the failure; `None` if the tolerances are met, but not the
        /// control to 1e-9.
        report: Box<NewtonReport>,
        /// The last error of the residual that shortened a step of the line search, if any.
        source: Option<Box<NewtonError>>,
    },
}

/// An error of the caller's own equations inside a [`NewtonError`]; it is the [`source`](Error::source).
#[derive(Debug, Clone)]
pub struct UserError(Arc<dyn Error + Send + Sync>);

/// Whether both refer to the same error.
impl PartialEq for UserError {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Display for UserError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the caller's own equations failed")
    }
}

impl Error for UserError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&*self.0)
    }
}

/// Tells whether the load steps ended a walk.
fn used_up(report: &NewtonReport) -> &'static str {
    match report.stopped_by {
        Some(_) => ", which are used up",
        None => "",
    }
}

/// Describes why a solve failed.
fn failure(stopped_by: Option<StopReason>) -> &'static str {
    match stopped_by {
        Some(StopReason::Iterations) => "the iterations are used up",
        Some(StopReason::LineSearch) => {
            "no step of the line search reduces the correction: the control or the start is too far from a solution, or the tangent is not the derivative of the residual"
        }
        Some(StopReason::NotFinite) => {
            "the residual or the step is not finite, or a norm is negative"
        }
        Some(
            StopReason::Residual
            | StopReason::Step
            | StopReason::Rounding
            | StopReason::Observer
            | StopReason::LoadSteps,
        )
        | None => "the corrections are within the tolerances, but the control is not met to 1e-9",
    }
}

/// Returns 1 / `pivot` of a matrix, if both are finite.
pub(crate) fn reciprocal(row: usize, pivot: f64) -> Result<f64> {
    match 1.0 / pivot {
        inverse if pivot.is_finite() && inverse.is_finite() => Ok(inverse),
        _ => Err(NewtonError::Singular { row, pivot }),
    }
}

/// Unwraps a result of a discretisation for its own state.
#[expect(
    clippy::expect_used,
    reason = "only this crate creates states, so that the length is correct"
)]
pub(crate) fn own<T>(of_state: Result<T, MembraneError>) -> T {
    of_state.expect("a state of this discretisation")
}

impl NewtonError {
    /// Another branch, without a report yet.
    pub(crate) fn other_branch() -> Self {
        let report = Box::default();
        Self::OtherBranch { report }
    }

    /// Sets the report of the attempts, if the error has one.
    pub(crate) fn with_report(mut self, attempts: NewtonReport) -> Self {
        if let Self::LimitPoint { report, .. }
        | Self::OtherBranch { report }
        | Self::NotConverged { report, .. } = &mut self
        {
            let stopped_by = report.stopped_by;
            **report = attempts;
            report.stopped_by = stopped_by;
        }
        self
    }

    /// The error under the opposite control.
    pub(crate) fn opposite(mut self) -> Self {
        if let Self::LimitPoint {
            reached, wanted, ..
        } = &mut self
        {
            (*reached, *wanted) = (-*reached, -*wanted);
        }
        self
    }

    /// Wraps an error of the caller's own equations.
    ///
    /// ```
    /// use std::error::Error;
    /// use membrane_newton::NewtonError;
    /// let ours = "abc".parse::<f64>().unwrap_err();
    /// let error = NewtonError::user(ours.clone());
    /// assert_eq!(error.source().and_then(|e| e.downcast_ref()), Some(&ours));
    /// ```
    #[must_use]
    pub fn user(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::User(UserError(Arc::from(error.into())))
    }
}
