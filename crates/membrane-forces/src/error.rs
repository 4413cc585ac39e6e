//! The one error type of the crate: what was given, what is allowed.

/// Why a membrane could not be built or its forces not evaluated.
///
/// Every variant carries the numbers that were given and, where there is one, the limit they broke.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MembraneError {
    /// A number that must be finite is NaN or infinite.
    #[error("{quantity} must be finite, got {value:?}")]
    NotFinite {
        /// The argument's name.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// A number that must be positive is not.
    #[error("{quantity} must be positive, got {value:?}")]
    NotPositive {
        /// The argument's name.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// The stiffness is zero, negative, NaN or infinite somewhere.
    #[error("stiffness must be positive and finite, got {value:?} at s = {s:?}")]
    BadStiffness {
        /// Material coordinate of the offending value.
        s: f64,
        /// The stiffness there.
        value: f64,
    },
    /// Fewer points, nodes or samples than the construction needs.
    #[error("{quantity}: {given} given, at least {least} needed")]
    TooFew {
        /// What there is too little of.
        quantity: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        least: usize,
    },
    /// More nodes, degrees or elements than any machine has room for.
    #[error("{quantity}: {given} given, at most {most} allowed")]
    TooMany {
        /// What there is too much of.
        quantity: &'static str,
        /// How many were given.
        given: usize,
        /// How many are allowed.
        most: usize,
    },
    /// A list or a state has another length than it must have.
    #[error("{quantity}: {given} numbers given, {needed} needed")]
    WrongLength {
        /// What has it.
        quantity: &'static str,
        /// Numbers given.
        given: usize,
        /// Numbers needed.
        needed: usize,
    },
    /// A matrix entry that is not stored.
    #[error(
        "entry ({row}, {column}) is outside the band: {n} rows, {lower} diagonals below and {upper} above"
    )]
    OutsideBand {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
        /// Rows and columns of the matrix.
        n: usize,
        /// Diagonals below the main one.
        lower: usize,
        /// Diagonals above the main one.
        upper: usize,
    },
    /// Breakpoints must rise strictly inside (0, 1).
    #[error("breakpoint {index} is {value:?}: breakpoints must rise strictly inside (0, 1)")]
    BadBreakpoint {
        /// Position in the list.
        index: usize,
        /// The value there.
        value: f64,
    },
    /// Two neighbouring points of the curve coincide, so it has no direction there.
    #[error("the curve has no direction at point {index}: its neighbours coincide")]
    CoincidentPoints {
        /// Index of the point.
        index: usize,
    },
    /// The rest shape crosses itself.
    #[error("the rest shape crosses itself: segment {first} meets segment {second}")]
    SelfCrossing {
        /// Index of the earlier segment of the sampled curve.
        first: usize,
        /// Index of the later one.
        second: usize,
    },
    /// Pressure per current length at or past the value at which the equilibrium runs to infinity.
    #[error("no equilibrium: the pressure is {pressure:?}, must stay below {limit:?} in size")]
    PastBlowUp {
        /// Force per unit of current length that was asked for.
        pressure: f64,
        /// The bound: 2 pi over the integral of 1 / lambda.
        limit: f64,
    },
}

/// `value` if it is finite.
pub(crate) fn finite(quantity: &'static str, value: f64) -> Result<f64, MembraneError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(MembraneError::NotFinite { quantity, value })
    }
}

/// Refuses a list of `given` numbers where `needed` are.
pub(crate) fn length(
    quantity: &'static str,
    given: usize,
    needed: usize,
) -> Result<(), MembraneError> {
    if given == needed {
        Ok(())
    } else {
        Err(MembraneError::WrongLength {
            quantity,
            given,
            needed,
        })
    }
}

/// Refuses fewer than `least`.
pub(crate) fn at_least(
    quantity: &'static str,
    given: usize,
    least: usize,
) -> Result<(), MembraneError> {
    if given >= least {
        Ok(())
    } else {
        Err(MembraneError::TooFew {
            quantity,
            given,
            least,
        })
    }
}

/// Refuses more than `most`.
pub(crate) fn at_most(
    quantity: &'static str,
    given: usize,
    most: usize,
) -> Result<(), MembraneError> {
    if given <= most {
        Ok(())
    } else {
        Err(MembraneError::TooMany {
            quantity,
            given,
            most,
        })
    }
}

/// `value` if it is finite and positive.
pub(crate) fn positive(quantity: &'static str, value: f64) -> Result<f64, MembraneError> {
    if finite(quantity, value)? > 0.0 {
        Ok(value)
    } else {
        Err(MembraneError::NotPositive { quantity, value })
    }
}

/// Refuses breakpoints that do not rise strictly inside (0, 1).
pub(crate) fn rising(breakpoints: &[f64]) -> Result<(), MembraneError> {
    let mut last = 0.0;
    for (index, &value) in breakpoints.iter().enumerate() {
        if !(value > last && value < 1.0) {
            return Err(MembraneError::BadBreakpoint { index, value });
        }
        last = value;
    }
    Ok(())
}
