//! The error type of the crate: given values, allowed ranges and time.

use membrane_newton::{MembraneError, NewtonError};

use crate::report::Evolution;
use crate::scheme::Scheme;

pub(crate) type Result<T, E = ImplicitError> = std::result::Result<T, E>;

/// An error in setting up or continuing a motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplicitError {
    /// A number is out of range, a list has a wrong length, the membrane cannot be discretised, or its material is not that of the call.
    #[error(transparent)]
    Membrane(#[from] MembraneError),
    /// The forces are not defined in a state of the motion: neighbouring nodes coincide, or rubber is stretched beyond its limit.
    #[error("no forces at t = {time:?}: nodes coincide, or rubber is stretched beyond its limit")]
    Forces {
        /// Time of the error.
        time: f64,
        /// Error of the forces.
        #[source]
        error: MembraneError,
    },
    /// The equations of a step were not solved.
    #[error("no step from t = {time:?} with dt = {dt:?}")]
    Step {
        /// Time at the start of the step.
        time: f64,
        /// Time step.
        dt: f64,
        /// Error of the solve.
        #[source]
        error: NewtonError,
    },
    /// A run without stops has no end.
    #[error("no stops are given; a run needs at least one")]
    NoStops,
    /// Two membranes cannot be a pair: [`Pair::check`](membrane_newton::Pair::check).
    #[error(transparent)]
    Pair(NewtonError),
    /// A given state moves a fixed node.
    #[error("node {node} is at {given:?}; it is fixed at {fixed:?}")]
    FixedNode {
        /// Index of the node.
        node: usize,
        /// The given position [x, y], cm.
        given: [f64; 2],
        /// The position at which it is fixed; a node on the axis only in y.
        fixed: [f64; 2],
    },
    /// The curve encloses no body under a prescribed volume, or in an equilibrium: walls intersect, or it is inside out
    /// ([`collapse`](membrane_newton::membrane_forces::collapse)). The state is that before the step. Under other loads a curve may do so on its way.
    #[error(
        "collapsed at t = {time:?}: walls of the membrane meet or are inside out near s = {s:?}"
    )]
    Collapsed {
        /// Time at the end of the step.
        time: f64,
        /// Material coordinate of a node where the walls meet, or of the apex.
        s: f64,
    },
    /// The load gave a value that is not finite, or a negative volume.
    #[error("the load gives {given:?} at t = {time:?}")]
    BadLoad {
        /// Time of the evaluation.
        time: f64,
        /// Value given.
        given: f64,
    },
    /// The prescribed volume differs from the initial volume of the membrane.
    #[error(
        "at t = {time:?} the load prescribes {prescribed:?} cm^3, the membrane encloses {actual:?}"
    )]
    VolumeMismatch {
        /// Time of the start.
        time: f64,
        /// Volume prescribed.
        prescribed: f64,
        /// Volume of the initial shape.
        actual: f64,
    },
    /// The rate of the prescribed volume differs from that of the initial state. [`Scheme::Midpoint`] does not damp the impulse of the first
    /// step: begin with a flow of zero, such as 1 - cos(6 t), or use [`Scheme::TrBdf2`].
    #[error(
        "at t = {time:?} the prescribed volume changes by {prescribed:?} cm^3/s, that of the membrane by {actual:?}; Scheme::Midpoint needs equal rates"
    )]
    VolumeRateMismatch {
        /// Time of the start.
        time: f64,
        /// V' prescribed, cm^3/s.
        prescribed: f64,
        /// V' of the initial state, cm^3/s.
        actual: f64,
    },
    /// The scheme does not support the load, the law, the material or adaptive steps ([`Scheme`]).
    #[error("Scheme::{scheme:?} does not support {what}")]
    Unsupported {
        /// The scheme.
        scheme: Scheme,
        /// The load, the law, the material or the kind of steps.
        what: &'static str,
    },
    /// The state of a pair consists of two membranes; one of them cannot be set.
    #[error("the state of a pair cannot be set from that of one membrane")]
    StateOfPair,
    /// The motion diverges: the scheme is unstable at this step, or the load has no equilibrium. The state is that before the step.
    #[error(
        "step {step}, from t = {time:?} with dt = {dt:?}, is unstable: the {what} of node {node} is {value:e}"
    )]
    Unstable {
        /// Number of the step, from 1.
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
    /// The norm of the forces exceeds the tolerance after the largest number of steps.
    #[error("norm of the forces is {:e}, {:e} at the start, after {} steps", evolution.residual(), evolution.norms.first().copied().unwrap_or(f64::NAN), evolution.steps)]
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

/// Returns `given` if it is finite and positive.
pub(crate) fn positive(what: &'static str, given: f64) -> Result<f64> {
    Ok(MembraneError::within(
        what,
        given,
        f64::MIN_POSITIVE,
        f64::MAX,
    )?)
}
