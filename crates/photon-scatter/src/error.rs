//! The error type of the crate.

use crate::ScatterReport;

/// Invalid input, or a tolerance that was not reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScatterError {
    /// A number or a count is not finite or out of range.
    #[error("{what} is {given:?}; it must be from {least:?} to {most:?}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: f64,
        /// The least value allowed.
        least: f64,
        /// The largest value allowed.
        most: f64,
    },
    /// The largest number of histories did not suffice.
    #[error("the largest standard error is {reached:?} after {} histories, the tolerance is {asked:?}", report.histories)]
    Tolerance {
        /// The tolerance given.
        asked: f64,
        /// The largest standard error of any bin.
        reached: f64,
        /// The work done.
        report: ScatterReport,
    },
}

/// Returns a number that is in its range.
pub(crate) fn within(what: &'static str, given: f64, range: [f64; 2]) -> Result<f64, ScatterError> {
    let [least, most] = range;
    match given >= least && given <= most {
        true => Ok(given),
        false => Err(ScatterError::OutOfRange {
            what,
            given,
            least,
            most,
        }),
    }
}

/// Returns a number of a user's source or medium that is finite and not negative.
pub(crate) fn valid(what: &'static str, given: f64) -> Result<f64, ScatterError> {
    within(what, given, [0.0, f64::MAX])
}
