//! The error type of the crate: variants contain the given values and the allowed ones.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

/// Invalid input to a plan, a geometry or a run, with the measured or given value. Messages write large and small numbers as powers of ten.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RadonError {
    /// A number is NaN or infinite.
    #[error("{what} must be finite, got {given:?}")]
    NotFinite {
        /// Name of the parameter.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number that must be greater than zero is not.
    #[error("{what} must be greater than zero, got {given:?}")]
    NotPositive {
        /// Name of the parameter.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A count is too small.
    #[error("{what} must be at least {least}, got {given}")]
    TooFew {
        /// Name of the count.
        what: &'static str,
        /// The value given.
        given: usize,
        /// The least value allowed.
        least: usize,
    },
    /// A number lies outside its interval.
    #[error("{what} must lie in {}, got {given:?}", interval(*least, *most))]
    OutOfRange {
        /// Name of the parameter.
        what: &'static str,
        /// The value given.
        given: f64,
        /// The least value allowed.
        least: f64,
        /// The greatest value allowed.
        most: f64,
    },
    /// An array does not have the length of the geometry.
    #[error("{what} must hold {expected} samples, got {given}")]
    WrongLength {
        /// Name of the array.
        what: &'static str,
        /// The length given.
        given: usize,
        /// The length that was expected.
        expected: usize,
    },
    /// A stored sample is NaN or infinite.
    #[error("sample {index} of {what} is {given:?}; it must be finite")]
    BadSample {
        /// Name of the array.
        what: &'static str,
        /// Index of the first bad sample.
        index: usize,
        /// Its value.
        given: f64,
    },
    /// A stored sample is negative where only values >= 0 are valid.
    #[error("sample {index} of {what} is {given:?}; it must not be negative")]
    NegativeSample {
        /// Name of the array.
        what: &'static str,
        /// Index of the first negative sample.
        index: usize,
        /// Its value.
        given: f64,
    },
    /// The product of array sizes exceeds the address space, the memory or the range of the indices.
    #[error("{what}: {a} x {b} samples exceed the memory or the range of the indices")]
    TooLarge {
        /// Name of the array.
        what: &'static str,
        /// First factor.
        a: usize,
        /// Second factor.
        b: usize,
    },
    /// The views leave a wedge of directions unmeasured and the policy was [`ArcPolicy::Complete`](crate::ArcPolicy::Complete).
    #[error(
        "views leave a gap of {} rad between neighbouring directions, {} times the mean of the others (at most {most:?} allowed){}",
        three(*gap), three(*ratio), hint(*furthest)
    )]
    ShortArc {
        /// The largest gap between neighbouring directions modulo pi, in radians.
        gap: f64,
        /// This gap divided by the average of the other gaps.
        ratio: f64,
        /// The largest ratio that counts as complete.
        most: f64,
        /// The largest absolute angle, in radians.
        furthest: f64,
    },
    /// An arc has more turns than allowed: most likely it is in degrees.
    #[error(
        "an arc of {} rad is {} turns (at most {most:?} allowed); if it is in degrees, use `f64::to_radians`",
        three(*arc), three(*turns)
    )]
    LongArc {
        /// The arc given, in radians.
        arc: f64,
        /// Number of turns.
        turns: f64,
        /// Largest allowed number of turns.
        most: f64,
    },
    /// A list of angles has more turns than allowed, more than half a turn of whole numbers or a turn of multiples of 1/32: most likely it is
    /// in degrees.
    #[error(
        "{n_views} angles span {} rad (at most {:?} turns allowed, half a turn of whole numbers, one turn of multiples of 1/32); if they are in degrees, use `from_degrees`, otherwise `from_radians`",
        three(*arc), crate::geometry::MOST_TURNS
    )]
    LikeDegrees {
        /// Number of angles.
        n_views: usize,
        /// Largest angle minus the smallest one, in radians.
        arc: f64,
    },
    /// An index range is empty, reversed or leaves the array.
    #[error("{what}: range {start}..{end} must be non-empty and lie within 0..{len}")]
    BadRange {
        /// Name of the range.
        what: &'static str,
        /// First index.
        start: usize,
        /// One past the last index.
        end: usize,
        /// Length of the axis.
        len: usize,
    },
    /// The machine does not support the requested instruction set.
    #[error("this machine does not run {given:?}")]
    InstructionSetMissing {
        /// The set given.
        given: crate::InstructionSet,
    },
    /// The memory budget is below the requirement of the smallest slab, which grows with the number of threads.
    #[error("the smallest slab needs {least} bytes, the budget is {given}")]
    BudgetTooSmall {
        /// Bytes that the smallest slab needs.
        least: usize,
        /// Bytes allowed.
        given: usize,
    },
    /// The corners do not bound an area: fewer than three, collinear, or edges that cross.
    #[error("polygon of {corners} corners and signed area {area:?} is not simple")]
    DegeneratePolygon {
        /// Number of corners.
        corners: usize,
        /// Signed area of the closed line through them.
        area: f64,
    },
    /// The three axes are not perpendicular unit vectors.
    #[error("axes differ from perpendicular unit vectors by {deviation:?} (at most 1e-9 allowed)")]
    NotOrthonormal {
        /// Largest deviation of their scalar products from 0 and 1.
        deviation: f64,
    },
    /// A plan of filtered back-projection whose transpose is not implemented.
    #[error("the adjoint of filtered back-projection needs {what}")]
    NoAdjoint {
        /// The option that the adjoint requires.
        what: &'static str,
    },
    /// An error of the caller's own [`LinearOperator`](crate::LinearOperator): [`RadonError::user`].
    #[error(transparent)]
    User(UserError),
    /// An iterative solver ended before a rule that was set was met. The message contains the value of each rule in the last entry of the history.
    #[error("no stopping rule was met in {} iterations{}", report.iterations, report.unmet())]
    NotConverged {
        /// The iterations that were made.
        report: Box<crate::IterativeReport>,
    },
}

impl RadonError {
    /// Wraps the error of a user-defined operator; the solver stops and returns it.
    ///
    /// ```
    /// use std::error::Error;
    /// use radon::RadonError;
    /// let ours = "abc".parse::<f64>().unwrap_err();
    /// let error = RadonError::user(ours.clone());
    /// assert_eq!(error.source().and_then(|e| e.downcast_ref()), Some(&ours));
    /// ```
    #[must_use]
    pub fn user(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::User(UserError(Arc::from(error.into())))
    }
}

/// The error of a caller's operator inside a [`RadonError`], its [`source`](Error::source).
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
        f.write_str("the caller's own operator failed")
    }
}

impl Error for UserError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        Some(&*self.0)
    }
}

/// The hint for angles of several turns, or of a turn divided by 57, that leave a gap.
fn hint(furthest: f64) -> String {
    use std::f64::consts::TAU;
    match furthest {
        far if far > 2.0 * TAU => {
            let far = three(far);
            format!("; angles are in radians and go up to {far}: are they degrees?")
        }
        near if near > 0.0 && near.to_degrees() <= TAU => format!(
            "; angles go up to {} rad: if radians were given as degrees, use `arc_radians` or `from_radians`",
            three(near)
        ),
        _ => String::new(),
    }
}

/// A number to at least three digits, of any size.
fn three(x: f64) -> String {
    if !(1e-3..1e6).contains(&x.abs()) {
        return format!("{x:?}");
    }
    let decimals = (2.0 - x.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{x:.decimals$}")
}

/// The largest number below 1.
pub(crate) const BELOW_ONE: f64 = 1.0_f64.next_down();

/// An interval, open where a bound only excludes 0, a whole number or infinity.
fn interval(least: f64, most: f64) -> String {
    let low = match least {
        f64::MIN_POSITIVE => "(0.0".to_owned(),
        f64::MIN => "(-inf".to_owned(),
        _ => format!("[{least:?}"),
    };
    match most {
        f64::MAX => low + ", inf)",
        _ if most < most.ceil() && most.next_up() == most.ceil() => {
            format!("{low}, {:?})", most.ceil())
        }
        _ => format!("{low}, {most:?}]"),
    }
}

/// `given` if it is finite.
pub(crate) fn finite(what: &'static str, given: f64) -> Result<f64, RadonError> {
    if given.is_finite() {
        Ok(given)
    } else {
        Err(RadonError::NotFinite { what, given })
    }
}

/// `given` if it is finite and greater than zero.
pub(crate) fn positive(what: &'static str, given: f64) -> Result<f64, RadonError> {
    if finite(what, given)? > 0.0 {
        Ok(given)
    } else {
        Err(RadonError::NotPositive { what, given })
    }
}

/// `Ok` if `given` is finite and lies in [`least`, `most`].
pub(crate) fn within(
    what: &'static str,
    given: f64,
    least: f64,
    most: f64,
) -> Result<(), RadonError> {
    if (least..=most).contains(&finite(what, given)?) {
        Ok(())
    } else {
        Err(RadonError::OutOfRange {
            what,
            given,
            least,
            most,
        })
    }
}

/// `Ok` if this machine runs the instruction set.
pub(crate) fn available(given: crate::InstructionSet) -> Result<(), RadonError> {
    match given.is_available() {
        true => Ok(()),
        false => Err(RadonError::InstructionSetMissing { given }),
    }
}

/// `given` if it is at least `least`.
pub(crate) fn at_least(
    what: &'static str,
    given: usize,
    least: usize,
) -> Result<usize, RadonError> {
    if given >= least {
        Ok(given)
    } else {
        Err(RadonError::TooFew { what, given, least })
    }
}

/// `Ok` if the array holds `expected` samples.
pub(crate) fn length(what: &'static str, given: usize, expected: usize) -> Result<(), RadonError> {
    if given == expected {
        Ok(())
    } else {
        Err(RadonError::WrongLength {
            what,
            given,
            expected,
        })
    }
}

/// `a * b`, or an error if the product does not fit.
pub(crate) fn product(what: &'static str, a: usize, b: usize) -> Result<usize, RadonError> {
    // Half the address space, as for any Rust allocation, and 16 bytes a sample with scratch.
    a.checked_mul(b)
        .filter(|&n| n <= isize::MAX as usize / 16)
        .ok_or(RadonError::TooLarge { what, a, b })
}

/// An empty list with room for `a * b`, or an error if there is none.
pub(crate) fn room<T>(what: &'static str, a: usize, b: usize) -> Result<Vec<T>, RadonError> {
    let mut room = Vec::new();
    match room.try_reserve_exact(product(what, a, b)?) {
        Ok(()) => Ok(room),
        Err(_) => Err(RadonError::TooLarge { what, a, b }),
    }
}

/// `a * b` zeros, or an error if there is no room for them.
pub(crate) fn zeros<T: Copy + Default>(
    what: &'static str,
    a: usize,
    b: usize,
) -> Result<Vec<T>, RadonError> {
    // Reserves first: `vec!` aborts the process if memory is lacking, and alone does not touch the memory.
    drop(room::<T>(what, a, b)?);
    Ok(vec![T::default(); a * b])
}
