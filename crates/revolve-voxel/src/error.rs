//! The crate's error type: what was given, what is allowed.

/// Bad input, found before any work starts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RevolveError {
    /// Fewer points than a meridian needs.
    #[error("a meridian needs at least {least} distinct points, got {given}")]
    TooFewPoints {
        /// Distinct points given.
        given: usize,
        /// Points needed.
        least: usize,
    },
    /// A count is below the least that makes sense.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        least: usize,
    },
    /// A direction of length zero.
    #[error("the direction of a ray is (0, 0, 0), which points nowhere")]
    NoDirection,
    /// A NaN or infinite coordinate.
    #[error("point {index} is not finite: ({x:?}, {r:?})")]
    NotFinitePoint {
        /// Index of the point.
        index: usize,
        /// Its axial coordinate.
        x: f64,
        /// Its radius.
        r: f64,
    },
    /// A radius below zero.
    #[error("point {index} has a negative radius {r:?}")]
    NegativeRadius {
        /// Index of the point.
        index: usize,
        /// Its radius.
        r: f64,
    },
    /// Two segments of the meridian cross or overlap.
    #[error("the meridian crosses itself: segments {first} and {second}")]
    SelfCrossing {
        /// Index of the first segment (an open base's disc counts as a segment).
        first: usize,
        /// Index of the second segment.
        second: usize,
    },
    /// Two pieces of a smooth meridian do not meet.
    #[error("piece {piece} starts {gap:?} from the end of the one before, more than {tolerance:?}")]
    Gap {
        /// Index of the second piece.
        piece: usize,
        /// Distance between the two ends.
        gap: f64,
        /// Distance allowed.
        tolerance: f64,
    },
    /// A tolerance asks for more pieces than can be held.
    #[error("tolerance {tolerance:?} needs more than {most} pieces")]
    TooFine {
        /// The tolerance given.
        tolerance: f64,
        /// Most pieces allowed.
        most: usize,
    },
    /// The meridian encloses no volume.
    #[error("the meridian encloses no volume ({volume:?})")]
    NoVolume {
        /// The volume found.
        volume: f64,
    },
    /// A number that must be finite is not.
    #[error("{what} must be finite, got {given:?}")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number that must be positive is not.
    #[error("{what} must be positive, got {given:?}")]
    NotPositive {
        /// Which number.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number that must not be negative is.
    #[error("{what} must not be negative, got {given:?}")]
    Negative {
        /// Which number.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A wedge of more than a turn.
    #[error("a wedge opens {given:?} radians, at most {most:?}")]
    TooWide {
        /// The opening given.
        given: f64,
        /// A full turn.
        most: f64,
    },
    /// More samples than can be addressed, or than the system will give memory for.
    #[error("{samples:e} {what} do not fit into memory")]
    TooLarge {
        /// Of what.
        what: &'static str,
        /// How many.
        samples: f64,
    },
    /// A layer that the body does not have.
    #[error("there is no layer {given}: the body has {layers}, counted from 0")]
    NoSuchLayer {
        /// The layer asked for.
        given: usize,
        /// How many there are.
        layers: usize,
    },
    /// A list has the wrong length.
    #[error("{what}: expected length {expected}, got {given}")]
    WrongLength {
        /// Which list.
        what: &'static str,
        /// The length needed.
        expected: usize,
        /// The length given.
        given: usize,
    },
    /// Two curves that bound no wall: lines between their points of equal parameter cross, or a radius is negative.
    #[error("no wall at s = {s:?}: radius {r:?}, area for each unit of s and t {jacobian:?}")]
    Folded {
        /// Where.
        s: f64,
        /// Radius of the worse end of the line.
        r: f64,
        /// Signed area for each unit of s and of the way from the inner to the outer curve.
        jacobian: f64,
    },
    /// An inner layer reaches outside the layer around it.
    #[error(
        "layer {layer} reaches {depth:?} outside the layer around it at (x, r) = ({x:?}, {r:?})"
    )]
    NotNested {
        /// Index of the inner layer.
        layer: usize,
        /// How far outside.
        depth: f64,
        /// Axial coordinate of the worst point.
        x: f64,
        /// Radius of the worst point.
        r: f64,
    },
}

/// `Ok` if the number is finite.
pub(crate) fn finite(what: &'static str, given: f64) -> Result<f64, RevolveError> {
    if given.is_finite() {
        Ok(given)
    } else {
        Err(RevolveError::NotFinite { what, given })
    }
}

/// `Ok` if the number is finite and positive.
pub(crate) fn positive(what: &'static str, given: f64) -> Result<f64, RevolveError> {
    if finite(what, given)? > 0.0 {
        Ok(given)
    } else {
        Err(RevolveError::NotPositive { what, given })
    }
}

/// `Ok` if the length is the expected one.
pub(crate) fn length(
    what: &'static str,
    expected: usize,
    given: usize,
) -> Result<(), RevolveError> {
    if given == expected {
        Ok(())
    } else {
        Err(RevolveError::WrongLength {
            what,
            expected,
            given,
        })
    }
}

/// `Ok` if there are at least so many.
pub(crate) fn at_least(what: &'static str, given: usize, least: usize) -> Result<(), RevolveError> {
    if given >= least {
        Ok(())
    } else {
        Err(RevolveError::TooFew { what, given, least })
    }
}

/// The product of some counts, each positive, if that many samples with scratch can be addressed.
pub(crate) fn countable(what: &'static str, counts: &[usize]) -> Result<(), RevolveError> {
    let mut samples = 1.0;
    for &n in counts {
        at_least(what, n, 1)?;
        samples *= n as f64;
    }
    // Half the address space, as for any Rust allocation, and 32 bytes a sample.
    if samples <= isize::MAX as f64 / 32.0 {
        Ok(())
    } else {
        Err(RevolveError::TooLarge { what, samples })
    }
}

/// An empty list with room for `len`, or the error that says that there is none.
pub(crate) fn room<T>(what: &'static str, len: usize) -> Result<Vec<T>, RevolveError> {
    let mut room: Vec<T> = Vec::new();
    if room.try_reserve_exact(len).is_err() {
        let samples = len as f64;
        return Err(RevolveError::TooLarge { what, samples });
    }
    Ok(room)
}

/// `len` zeros, or the error that says that there is no room for them.
pub(crate) fn zeros<T: Copy + Default>(
    what: &'static str,
    len: usize,
) -> Result<Vec<T>, RevolveError> {
    // Asked for first: `vec!` ends the process if it is refused, and alone does not touch the memory.
    drop(room::<T>(what, len)?);
    Ok(vec![T::default(); len])
}
