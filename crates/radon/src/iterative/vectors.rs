//! Sums and element-wise operations on long vectors: parallel, in f64, bitwise identical for any number of threads.

use crate::error::RadonError;
use crate::sample::finite_and_signal;
use crate::{Sample, parallel};

/// Sums are computed over pieces of this length, then over the pieces in order.
const PIECE: usize = 1 << 14;

/// Sum of `of(a, b)` over two arrays.
pub(super) fn sum2<T: Sample>(a: &[T], b: &[T], of: impl Fn(f64, f64) -> f64 + Sync) -> f64 {
    let pieces: Vec<f64> = parallel::collect(a.len().div_ceil(PIECE), &|k| {
        let piece = k * PIECE..a.len().min((k + 1) * PIECE);
        let pairs = a[piece.clone()].iter().zip(&b[piece]);
        pairs.map(|(a, b)| of(a.f64(), b.f64())).sum()
    });
    pieces.iter().sum()
}

/// Root of the sum of the squares of `of(a, b)`, which may under- or overflow.
pub(super) fn size2<T: Sample>(a: &[T], b: &[T], of: impl Fn(f64, f64) -> f64 + Sync) -> f64 {
    let square = sum2(a, b, |a, b| of(a, b).powi(2));
    if square.is_nan() || (1e-280..f64::INFINITY).contains(&square) {
        return square.sqrt();
    }
    let sizes = a.iter().zip(b).map(|(a, b)| of(a.f64(), b.f64()).abs());
    let most = sizes.fold(0.0, f64::max);
    if most == 0.0 || most == f64::INFINITY {
        return most;
    }
    most * sum2(a, b, |a, b| (of(a, b) / most).powi(2)).sqrt()
}

pub(super) fn norm<T: Sample>(a: &[T]) -> f64 {
    size2(a, a, |x, _| x)
}

/// Replaces each element of `a` by `of(a, b)`.
pub(super) fn update<T: Sample>(a: &mut [T], b: &[T], of: impl Fn(T, T) -> T + Sync) {
    parallel::chunks(a, PIECE, &|k, a| {
        for (a, &b) in a.iter_mut().zip(&b[k * PIECE..]) {
            *a = of(*a, b);
        }
    });
}

/// Returns `part / whole`, or `part` if the whole is zero.
pub(super) fn relative(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { part }
}

/// ‖new - old‖ / ‖new‖.
pub(super) fn relative_change<T: Sample>(new: &[T], old: &[T]) -> f64 {
    relative(size2(new, old, |a, b| a - b), norm(new))
}

pub(crate) fn check_samples<T: Sample>(
    what: &'static str,
    samples: &[T],
) -> Result<(), RadonError> {
    // The index is searched only if a bad sample exists.
    if finite_and_signal(samples).0 {
        return Ok(());
    }
    let index = samples.iter().position(|x| !x.finite()).unwrap_or(0);
    Err(RadonError::BadSample {
        what,
        index,
        given: samples[index].f64(),
    })
}

pub(crate) fn check_not_negative<T: Sample>(
    what: &'static str,
    samples: &[T],
) -> Result<(), RadonError> {
    match samples.iter().position(|&x| x < T::ZERO) {
        Some(index) => Err(RadonError::NegativeSample {
            what,
            index,
            given: samples[index].f64(),
        }),
        None => Ok(()),
    }
}
