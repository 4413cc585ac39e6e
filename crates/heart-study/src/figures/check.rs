//! Input checks shared by the figures; each names the input in its error.

use rayon::prelude::*;

use super::FigureError;

/// Samples that a thread checks at a time.
const CHUNK: usize = 1 << 16;

/// At least `least` entries.
pub(super) fn at_least(what: &'static str, given: usize, least: usize) -> Result<(), FigureError> {
    if given < least {
        return Err(FigureError::TooFew { what, given, least });
    }
    Ok(())
}

/// Exactly `expected` entries.
pub(super) fn same_len(
    what: &'static str,
    given: usize,
    expected: usize,
) -> Result<(), FigureError> {
    if given != expected {
        return Err(FigureError::Mismatch {
            what,
            given,
            expected,
        });
    }
    Ok(())
}

/// Finite numbers only.
pub(super) fn finite(what: &'static str, values: &[f64]) -> Result<(), FigureError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(FigureError::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// Finite samples only.
pub(super) fn finite_samples(what: &'static str, values: &[f32]) -> Result<(), FigureError> {
    // Volumes are large: whole chunks first, the place only when there is one.
    let bad = |chunk: &[f32]| !chunk.iter().fold(true, |good, v| good & v.is_finite());
    match values.par_chunks(CHUNK).position_first(bad) {
        Some(chunk) => {
            let rest = &values[chunk * CHUNK..];
            let index = chunk * CHUNK + rest.iter().position(|v| !v.is_finite()).unwrap_or(0);
            Err(FigureError::NotFinite { what, index })
        }
        None => Ok(()),
    }
}

/// At least `least` points, all finite.
pub(super) fn points(
    what: &'static str,
    points: &[[f64; 2]],
    least: usize,
) -> Result<(), FigureError> {
    at_least(what, points.len(), least)?;
    match points
        .iter()
        .position(|p| !(p[0].is_finite() && p[1].is_finite()))
    {
        Some(index) => Err(FigureError::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// A finite number above zero.
pub(super) fn positive(what: &'static str, given: f64) -> Result<(), FigureError> {
    if given.is_finite() && given > 0.0 {
        return Ok(());
    }
    Err(FigureError::NotPositive { what, given })
}

/// An interval of positive, finite length.
pub(super) fn interval(what: &'static str, low: f64, high: f64) -> Result<(), FigureError> {
    if low < high && (high - low).is_finite() {
        return Ok(());
    }
    Err(FigureError::Interval { what, low, high })
}
