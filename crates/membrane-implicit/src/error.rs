//! The one error type of the crate: what was given, what is allowed, where it failed.

use membrane_newton::{MembraneError, NewtonError};

use crate::evolution::Evolution;

/// An error of setting up or continuing a motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplicitError {
    /// The membrane could not be discretised, or neighbouring nodes coincide.
    #[error("no forces at t = {time:?}")]
    Membrane {
        /// Time at which it happened.
        time: f64,
        /// What the forces reported.
        #[source]
        error: MembraneError,
    },
    /// A linear system of a step could not be factored.
    #[error("no step from t = {time:?} with dt = {dt:?}")]
    Linear {
        /// Time at the start of the step.
        time: f64,
        /// Time step.
        dt: f64,
        /// What the factorisation reported.
        #[source]
        error: NewtonError,
    },
    /// A number lies outside the range allowed for it.
    #[error("{what} is {given:?}; it must {}", allowed(*least, *most))]
    OutOfRange {
        /// The argument's name.
        what: &'static str,
        /// What was given.
        given: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A count is below its minimum.
    #[error("{what} is {given}; it must be at least {least}")]
    TooFew {
        /// The argument's name.
        what: &'static str,
        /// What was given.
        given: usize,
        /// Smallest count allowed.
        least: usize,
    },
    /// The outer membrane of a pair does not enclose more than the inner one.
    #[error(
        "the outer membrane encloses {outer:?} cm^3, the inner one {inner:?}: the outer one must enclose the inner one"
    )]
    NotEnclosed {
        /// Volume of the inner membrane, cm^3.
        inner: f64,
        /// Volume of the outer membrane, cm^3.
        outer: f64,
    },
    /// A list has another length than the membrane has nodes.
    #[error("{what}: {given} nodes given, {expected} expected")]
    WrongLength {
        /// The argument's name.
        what: &'static str,
        /// Nodes given.
        given: usize,
        /// Nodes of the membrane.
        expected: usize,
    },
    /// The load gave a value that is not finite, or a negative volume.
    #[error("the load gives {given:?} at t = {time:?}")]
    BadLoad {
        /// Time asked for.
        time: f64,
        /// Value given.
        given: f64,
    },
    /// The prescribed volume is not the one the membrane has to begin with.
    #[error(
        "at t = {time:?} the load prescribes {prescribed:?} cm^3, the membrane encloses {actual:?}"
    )]
    VolumeMismatch {
        /// Time at the beginning.
        time: f64,
        /// Volume prescribed.
        prescribed: f64,
        /// Volume of the initial shape.
        actual: f64,
    },
    /// A splitting has no unknown pressure and cannot prescribe a volume.
    #[error("a splitting scheme cannot prescribe the volume")]
    ExplicitVolume,
    /// Rubber takes a pressure or a volume.
    #[error("the load of a motion of rubber is a total force; it must be a pressure or a volume")]
    RubberLoad,
    /// Rubber takes the scheme that conserves its energy.
    #[error("the scheme of a motion of rubber must be Scheme::Midpoint")]
    RubberScheme,
    /// A splitting takes no load that depends on the state.
    #[error("a splitting scheme takes no load that depends on the state")]
    SplitFeedback,
    /// The scheme has no error estimate to choose a step by.
    #[error("the scheme has no error estimate; its time steps must be fixed")]
    NoErrorEstimate,
    /// The state of a pair is that of two membranes; one cannot be set alone.
    #[error("the state of a pair cannot be set from that of one membrane")]
    StateOfPair,
    /// The equations of a step were not solved.
    #[error(
        "step from t = {time:?} with dt = {dt:?}: last change {change:e} cm after {iterations} iterations"
    )]
    StepNotSolved {
        /// Time at the start of the step.
        time: f64,
        /// Time step.
        dt: f64,
        /// Iterations made.
        iterations: usize,
        /// Last change of position, cm.
        change: f64,
    },
    /// The motion diverges: the scheme is unstable at this step, or the load has no equilibrium. The state is that
    /// before the step.
    #[error(
        "step {step}, from t = {time:?} with dt = {dt:?}, is unstable: the {what} of node {node} is {value:e}"
    )]
    Unstable {
        /// Which step, from 1.
        step: usize,
        /// Time at the start of the step.
        time: f64,
        /// Time step.
        dt: f64,
        /// The quantity, position or velocity.
        what: &'static str,
        /// The node.
        node: usize,
        /// Its value, cm or cm/s: beyond 1e100 or NaN.
        value: f64,
    },
    /// The norm of the forces is still above the tolerance after the largest number of steps.
    #[error("norm of the forces is {:e} after {} steps", evolution.residual(), evolution.steps)]
    NotSettled {
        /// The evolution up to the last step.
        evolution: Box<Evolution>,
    },
    /// The adaptive step fell below the resolution of the time.
    #[error("step size fell to {dt:e} at t = {time:?}")]
    StepTooSmall {
        /// Time reached.
        time: f64,
        /// Last step tried.
        dt: f64,
    },
}

/// A range in words, without the bounds that every finite number has.
fn allowed(least: f64, most: f64) -> String {
    match (least, most) {
        (f64::MIN, f64::MAX) => "be finite".into(),
        (f64::MIN_POSITIVE, f64::MAX) => "be positive and finite".into(),
        (least, f64::MAX) => format!("be at least {least:?} and finite"),
        (least, most) => format!("lie in [{least:?}, {most:?}]"),
    }
}

/// Rejects a list of `given` nodes if the membrane has `expected`.
pub(crate) fn length(
    what: &'static str,
    given: usize,
    expected: usize,
) -> Result<(), ImplicitError> {
    if given == expected {
        Ok(())
    } else {
        Err(ImplicitError::WrongLength {
            what,
            given,
            expected,
        })
    }
}

/// Rejects a count below `least`.
pub(crate) fn at_least(
    what: &'static str,
    given: usize,
    least: usize,
) -> Result<(), ImplicitError> {
    if given >= least {
        Ok(())
    } else {
        Err(ImplicitError::TooFew { what, given, least })
    }
}

/// `given` if it is finite and within [`least`, `most`].
pub(crate) fn within(
    what: &'static str,
    given: f64,
    least: f64,
    most: f64,
) -> Result<f64, ImplicitError> {
    if given.is_finite() && given >= least && given <= most {
        Ok(given)
    } else {
        Err(ImplicitError::OutOfRange {
            what,
            given,
            least,
            most,
        })
    }
}

/// `given` if it is finite and positive.
pub(crate) fn positive(what: &'static str, given: f64) -> Result<f64, ImplicitError> {
    within(what, given, f64::MIN_POSITIVE, f64::MAX)
}
