//! Errors: the given value and the allowed values.

/// Invalid input, detected before any work.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RevolveError {
    /// A count is below its minimum.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// The counted quantity.
        what: &'static str,
        /// Number given.
        given: usize,
        /// Smallest number allowed.
        least: usize,
    },
    /// A direction of length zero.
    #[error("the direction of a ray is (0, 0, 0), which points nowhere")]
    NoDirection,
    /// Planes across lines that are not parallel.
    #[error("only parallel rays can be cut into slabs by planes")]
    NotParallel,
    /// An image along a list of lines.
    #[error("an image needs parallel rays or rays between two rasters")]
    NotRaster,
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
    /// A NaN or infinite value of a function.
    #[error("the curve at s = {s:?} is ({x:?}, {r:?}); it must be finite")]
    NotFiniteAt {
        /// The parameter.
        s: f64,
        /// The axial coordinate.
        x: f64,
        /// The radius.
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
    /// A tolerance needs more pieces than can be stored.
    #[error("tolerance {tolerance:?} needs more than {most} pieces")]
    TooFine {
        /// The tolerance given.
        tolerance: f64,
        /// Most pieces allowed.
        most: usize,
    },
    /// The meridian encloses no volume, or crosses itself and the volumes of its parts cancel.
    #[error(
        "the meridian encloses no volume ({volume:?}): it is a line, or crosses itself and the volumes of its parts cancel"
    )]
    NoVolume {
        /// The volume found.
        volume: f64,
    },
    /// A number is not finite.
    #[error("{what} must be finite, got {given:?}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number is not positive.
    #[error("{what} must be positive, got {given:?}")]
    NotPositive {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number is negative.
    #[error("{what} must not be negative, got {given:?}")]
    Negative {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A number is outside its range.
    #[error("{what} must be from {least:?} to {most:?}, got {given:?}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// The smallest value allowed.
        least: f64,
        /// The largest value allowed.
        most: f64,
    },
    /// More samples than can be addressed or allocated.
    #[error("{samples:e} {what} do not fit into memory")]
    TooLarge {
        /// The counted quantity.
        what: &'static str,
        /// Their number.
        samples: f64,
    },
    /// The body does not have the layer.
    #[error("there is no layer {given}: the body has {layers}, counted from 0")]
    NoSuchLayer {
        /// The layer given.
        given: usize,
        /// Number of layers.
        layers: usize,
    },
    /// A range of indices is descending or leaves its axis.
    #[error("{what} {start}..{end} must be ascending and within 0..{len}")]
    BadRange {
        /// Which range.
        what: &'static str,
        /// Its first index.
        start: usize,
        /// One past its last index.
        end: usize,
        /// Length of the axis.
        len: usize,
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
    /// Two curves do not bound a wall: lines between points of equal parameter cross, or a radius is negative.
    #[error("no wall at s = {s:?}: radius {r:?}, area for each unit of s and t {jacobian:?}")]
    Folded {
        /// The parameter.
        s: f64,
        /// Radius at the worse end of the line.
        r: f64,
        /// Signed area per unit of s and per unit of the way from the inner to the outer curve.
        jacobian: f64,
    },
    /// An inner layer extends outside the layer around it.
    #[error(
        "layer {layer} reaches {depth:?} outside the layer around it at (x, r) = ({x:?}, {r:?})"
    )]
    NotNested {
        /// Index of the inner layer.
        layer: usize,
        /// Largest distance outside.
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

/// Sizes whose volume is a number.
pub(crate) const SIZES: [f64; 2] = [1e-100, 1e100];

/// `Ok` if the number is finite and in its range.
pub(crate) fn within(
    what: &'static str,
    given: f64,
    [least, most]: [f64; 2],
) -> Result<f64, RevolveError> {
    if (least..=most).contains(&finite(what, given)?) {
        return Ok(given);
    }
    Err(RevolveError::OutOfRange {
        what,
        given,
        least,
        most,
    })
}

/// `Ok` if the range of indices is ascending and ends within `len`.
pub(crate) fn check_range(
    what: &'static str,
    range: &std::ops::Range<usize>,
    len: usize,
) -> Result<(), RevolveError> {
    let std::ops::Range { start, end } = *range;
    match start <= end && end <= len {
        true => Ok(()),
        false => Err(RevolveError::BadRange {
            what,
            start,
            end,
            len,
        }),
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

/// `Ok` if the count is at least the minimum.
pub(crate) fn at_least(what: &'static str, given: usize, least: usize) -> Result<(), RevolveError> {
    if given >= least {
        Ok(())
    } else {
        Err(RevolveError::TooFew { what, given, least })
    }
}

/// `Ok` if the number is at most the largest one.
pub(crate) fn at_most(what: &'static str, given: usize, most: usize) -> Result<(), RevolveError> {
    length(what, most, given.max(most))
}

/// Returns the product of positive counts if that many samples with scratch memory can be addressed.
pub(crate) fn countable(what: &'static str, counts: &[usize]) -> Result<(), RevolveError> {
    let mut samples = 1.0;
    for &n in counts {
        at_least(what, n, 1)?;
        samples *= n as f64;
    }
    // Half the address space (limit of Rust allocations) and 32 bytes per sample.
    if samples <= isize::MAX as f64 / 32.0 {
        Ok(())
    } else {
        Err(RevolveError::TooLarge { what, samples })
    }
}

/// Returns an empty list with capacity `len`, or the error of the allocation.
pub(crate) fn room<T>(what: &'static str, len: usize) -> Result<Vec<T>, RevolveError> {
    let mut room: Vec<T> = Vec::new();
    if room.try_reserve_exact(len).is_err() {
        let samples = len as f64;
        return Err(RevolveError::TooLarge { what, samples });
    }
    Ok(room)
}

/// Returns `len` zeros, or the error of the allocation.
pub(crate) fn zeros<T: Copy + Default>(
    what: &'static str,
    len: usize,
) -> Result<Vec<T>, RevolveError> {
    // Reserves first, because `vec!` aborts the process on failure; `vec!` alone does not touch the memory.
    drop(room::<T>(what, len)?);
    Ok(vec![T::default(); len])
}
