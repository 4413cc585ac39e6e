//! Input checks shared by the figures; each names the input in its error.

use crate::StudyError;
use heart_phantom::check_value;
use rayon::prelude::*;

/// Samples that a thread checks at a time.
const CHUNK: usize = 1 << 16;

/// At least `least` entries.
pub(super) fn at_least(what: &'static str, given: usize, least: usize) -> Result<(), StudyError> {
    if given < least {
        return Err(StudyError::TooFew { what, given, least });
    }
    Ok(())
}

/// Finite numbers only.
pub(super) fn finite(what: &'static str, values: &[f64]) -> Result<(), StudyError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(StudyError::NotFinite { what, index }),
        None => Ok(()),
    }
}

pub(super) fn finite_samples(what: &'static str, values: &[f32]) -> Result<(), StudyError> {
    // Volumes are large: whole chunks first, the place only when there is one.
    let bad = |chunk: &[f32]| !chunk.iter().fold(true, |good, v| good & v.is_finite());
    match values.par_chunks(CHUNK).position_first(bad) {
        Some(chunk) => {
            let rest = &values[chunk * CHUNK..];
            let index = chunk * CHUNK + rest.iter().position(|v| !v.is_finite()).unwrap_or(0);
            Err(StudyError::NotFinite { what, index })
        }
        None => Ok(()),
    }
}

/// At least `least` points, all finite.
pub(super) fn points(
    what: &'static str,
    points: &[[f64; 2]],
    least: usize,
) -> Result<(), StudyError> {
    at_least(what, points.len(), least)?;
    match points
        .iter()
        .position(|p| !(p[0].is_finite() && p[1].is_finite()))
    {
        Some(index) => Err(StudyError::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// A finite number above zero.
pub(super) fn positive(what: &'static str, given: f64) -> Result<(), StudyError> {
    check_value(what, given, [f64::MIN_POSITIVE, f64::MAX])?;
    Ok(())
}

/// An interval of positive, finite length.
pub(super) fn interval(what: &'static str, low: f64, high: f64) -> Result<(), StudyError> {
    if low < high && (high - low).is_finite() {
        return Ok(());
    }
    Err(StudyError::Interval { what, low, high })
}
