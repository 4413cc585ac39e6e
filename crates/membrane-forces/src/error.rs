//! The error type of the crate: given values and allowed ranges.

pub(crate) type Result<T, E = MembraneError> = std::result::Result<T, E>;

/// An error of building a membrane or of evaluating its forces.
///
/// Every variant contains the given values and the violated limit, if any.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MembraneError {
    /// A number is out of range.
    #[error("{what} is {given:?}; it must be {}", allowed(*least, *most))]
    OutOfRange {
        /// The argument's name.
        what: &'static str,
        /// The given value.
        given: f64,
        /// Smallest value allowed; [`f64::MIN`] for any finite one.
        least: f64,
        /// Largest value allowed; [`f64::MAX`] for any finite one.
        most: f64,
    },
    /// The stiffness of springs, or the thickness of rubber, is zero, negative, NaN or infinite somewhere.
    #[error("{what} is {given:?} at s = {s:?}; it must be positive and finite")]
    BadProfile {
        /// Stiffness or thickness.
        what: &'static str,
        /// Material coordinate of the offending value.
        s: f64,
        /// The value there.
        given: f64,
    },
    /// Fewer points, nodes or samples than the construction needs.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// Name of the count.
        what: &'static str,
        /// The given count.
        given: usize,
        /// The smallest allowed count.
        least: usize,
    },
    /// More nodes, degrees or elements than any machine has room for.
    #[error("{what}: {given} given, at most {most} allowed")]
    TooMany {
        /// Name of the count.
        what: &'static str,
        /// The given count.
        given: usize,
        /// The largest allowed count.
        most: usize,
    },
    /// A list, a state or a matrix has a wrong size.
    #[error("{what}: {given} given, {expected} needed")]
    WrongLength {
        /// Name of the list, or of the rows or diagonals of a matrix.
        what: &'static str,
        /// The given size.
        given: usize,
        /// The required size.
        expected: usize,
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
    /// Breakpoints must be strictly ascending inside (0, 1).
    #[error("breakpoint {index} is {given:?}: breakpoints must rise strictly inside (0, 1)")]
    BadBreakpoint {
        /// Position in the list.
        index: usize,
        /// The value there.
        given: f64,
    },
    /// Breakpoints of reference configuration, stiffness or thickness that polynomials cannot tell apart.
    #[error(
        "breakpoints at s = {s:?} and {apart:e} beyond it: polynomials need the same breakpoint or {least:e} between two"
    )]
    CloseBreakpoints {
        /// Material coordinate of the first.
        s: f64,
        /// The distance to the next.
        apart: f64,
        /// The least distance.
        least: f64,
    },
    /// Two neighbouring points of the curve coincide or are NaN, so it has no direction there.
    #[error("the curve has no direction at point {index}: its neighbours coincide or are NaN")]
    CoincidentPoints {
        /// Index of the point.
        index: usize,
    },
    /// A given derivative of a reference configuration does not match its positions or first derivatives.
    #[error(
        "derivative {order} of the reference configuration is {given:?} at s = {s:?}; its differences there are {found:?}"
    )]
    WrongDerivative {
        /// 1 or 2.
        order: usize,
        /// Material coordinate.
        s: f64,
        /// The given derivative.
        given: [f64; 2],
        /// Central difference of the positions or first derivatives.
        found: [f64; 2],
    },
    /// The first derivative of a reference configuration jumps where no breakpoint is given.
    #[error(
        "the first derivative of the reference configuration jumps from {before:?} to {after:?} at s = {s:?}; a breakpoint is needed there"
    )]
    Kink {
        /// Material coordinate.
        s: f64,
        /// The derivative before.
        before: [f64; 2],
        /// The derivative after.
        after: [f64; 2],
    },
    /// The fixed ends are exchanged.
    #[error(
        "the ends are fixed at {ends:?} and exchanged: those of the reference configuration are at {rest:?}"
    )]
    EndsExchanged {
        /// The given positions [x, y] of s = 0 and s = 1.
        ends: [[f64; 2]; 2],
        /// Those of the reference configuration.
        rest: [[f64; 2]; 2],
    },
    /// The curve ends on the side of the axis on which it begins, or on the axis: a part of a curve.
    #[error(
        "the curve runs from {from:?} to {to:?}; it must begin at y > 0 and end at y < 0, with both halves of the curve"
    )]
    EndsOnOneSide {
        /// Position [x, y] at s = 0.
        from: [f64; 2],
        /// Position [x, y] at s = 1.
        to: [f64; 2],
    },
    /// The reference configuration encloses a negative volume: it runs counter-clockwise.
    #[error(
        "the reference configuration encloses {volume:?} cm^3; it must run from (0, +R) over the apex at x > 0 to (0, -R)"
    )]
    InsideOut {
        /// The volume, cm^3.
        volume: f64,
    },
    /// The reference configuration crosses itself.
    #[error("the reference configuration crosses itself: segment {first} meets segment {second}")]
    SelfCrossing {
        /// Index of the earlier segment of the sampled curve.
        first: usize,
        /// Index of the later one.
        second: usize,
    },
    /// Pressure per current length at or past the value at which the equilibrium runs to infinity.
    #[error("no equilibrium: the pressure is {pressure:?}, must stay below {limit:?} in size")]
    PastBlowUp {
        /// The given force per unit of current length.
        pressure: f64,
        /// The bound: 2 pi over the integral of 1 / lambda.
        limit: f64,
    },
    /// Rubber stretched beyond its limit, or to zero.
    #[error(
        "stretches {} and {} are not between zero and the limit of the rubber, l1^2 + l2^2 + l3^2 < {limit:?}", given[0], given[1]
    )]
    PastStretch {
        /// Along the meridian and around the axis.
        given: [f64; 2],
        /// Upper limit of the sum of the squares of all three stretches.
        limit: f64,
    },
    /// Rubber makes a body of revolution: reference configuration, thickness and ends must be mirror images about the axis.
    #[error("a membrane of rubber must be its own mirror image about the axis")]
    NotMirrored,
    /// Rubber allows only the law of a pressure, force per current area.
    #[error("the pressure law of a membrane of rubber must be that per current length")]
    LawOfRubber,
    /// The quantity is defined for the other material only.
    #[error("{what}: defined for a membrane of {needs} only")]
    OtherMaterial {
        /// The requested quantity.
        what: &'static str,
        /// The material that it needs, springs or rubber.
        needs: &'static str,
    },
}

/// Describes the finite numbers from `least` to `most`. If `least` is the number next to an integer, that integer is an exclusive bound.
fn allowed(least: f64, most: f64) -> String {
    let is_positive = least > 0.0 && least <= f64::MIN_POSITIVE;
    match (least, most) {
        (f64::MIN, f64::MAX) => "finite".into(),
        (0.0, f64::MAX) => "finite and not negative".into(),
        (_, f64::MAX) if is_positive => "finite and positive".into(),
        (_, most) if is_positive => format!("positive and at most {most:?}"),
        (least, f64::MAX) if least.fract() != 0.0 && least.next_down().fract() == 0.0 => {
            format!("finite and greater than {:?}", least.next_down())
        }
        (least, f64::MAX) => format!("finite and at least {least:?}"),
        (least, most) => format!("between {least:?} and {most:?}"),
    }
}

impl MembraneError {
    /// Returns `given` if it is finite and from `least` to `most`.
    ///
    /// ```
    /// use membrane_forces::MembraneError;
    /// let error = MembraneError::within("damping", -0.5, 0.0, f64::MAX).unwrap_err();
    /// assert_eq!(error.to_string(), "damping is -0.5; it must be finite and not negative");
    /// ```
    ///
    /// # Errors
    /// [`MembraneError::OutOfRange`].
    pub fn within(what: &'static str, given: f64, least: f64, most: f64) -> Result<f64> {
        if given.is_finite() && given >= least && given <= most {
            Ok(given)
        } else {
            Err(Self::OutOfRange {
                what,
                given,
                least,
                most,
            })
        }
    }

    /// Rejects a size `given` other than `expected`.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`].
    pub fn length(what: &'static str, given: usize, expected: usize) -> Result<()> {
        if given == expected {
            Ok(())
        } else {
            Err(Self::WrongLength {
                what,
                given,
                expected,
            })
        }
    }
}

/// `given` if it is finite.
pub(crate) fn finite(what: &'static str, given: f64) -> Result<f64> {
    MembraneError::within(what, given, f64::MIN, f64::MAX)
}

/// `given` if it is finite and not negative.
pub(crate) fn not_negative(what: &'static str, given: f64) -> Result<f64> {
    MembraneError::within(what, given, 0.0, f64::MAX)
}

/// `given` if it is finite and positive.
pub(crate) fn positive(what: &'static str, given: f64) -> Result<f64> {
    MembraneError::within(what, given, 0f64.next_up(), f64::MAX)
}

/// Rejects fewer than `least`.
pub(crate) fn at_least(what: &'static str, given: usize, least: usize) -> Result<()> {
    if given >= least {
        Ok(())
    } else {
        Err(MembraneError::TooFew { what, given, least })
    }
}

/// Rejects more than `most`.
pub(crate) fn at_most(what: &'static str, given: usize, most: usize) -> Result<()> {
    if given <= most {
        Ok(())
    } else {
        Err(MembraneError::TooMany { what, given, most })
    }
}

/// Rejects breakpoints that are not strictly ascending inside (0, 1).
pub(crate) fn rising(breakpoints: &[f64]) -> Result<()> {
    let mut last = 0.0;
    for (index, &given) in breakpoints.iter().enumerate() {
        if !(given > last && given < 1.0) {
            return Err(MembraneError::BadBreakpoint { index, given });
        }
        last = given;
    }
    Ok(())
}
