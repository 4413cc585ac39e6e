//! What can go wrong, with the numbers that show why.

use std::path::PathBuf;

/// Every failure of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhantomError {
    /// A number is not finite or outside the range that makes sense.
    #[error("{what} is {given}, must be between {min} and {max}")]
    OutOfRange {
        /// Which quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A count is outside the range that makes sense.
    #[error("{what} is {given}, must be between {min} and {max}")]
    Count {
        /// Which quantity.
        what: &'static str,
        /// The value given.
        given: usize,
        /// Smallest value allowed.
        min: usize,
        /// Largest value allowed.
        max: usize,
    },
    /// An array has the wrong length.
    #[error("{what}: {given} values given, {expected} expected")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
}

/// `given` if it is finite and within `min..=max`.
pub(crate) fn check(
    what: &'static str,
    given: f64,
    min: f64,
    max: f64,
) -> Result<f64, PhantomError> {
    // A NaN fails both comparisons.
    if given >= min && given <= max {
        Ok(given)
    } else {
        Err(PhantomError::OutOfRange {
            what,
            given,
            min,
            max,
        })
    }
}

/// `given` if it is within `min..=max`.
pub(crate) fn check_count(
    what: &'static str,
    given: usize,
    min: usize,
    max: usize,
) -> Result<usize, PhantomError> {
    if (min..=max).contains(&given) {
        Ok(given)
    } else {
        Err(PhantomError::Count {
            what,
            given,
            min,
            max,
        })
    }
}
