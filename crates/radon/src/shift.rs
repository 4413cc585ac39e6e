//! Shifts of views on the detector, which compensate a rigid displacement of the object.

use crate::error::{finite, length, product};
use crate::{RadonError, Sample};

/// Adds `weight` times a view `[row][bin]`, shifted by `shift` = [bins, rows], to another: the sample at bin b and row j moves to b -
/// `shift[0]` and j - `shift[1]`.
///
/// A displacement D of the object shifts the view at the angle theta by `D . (cos theta, sin theta, 0)` along the bins and by `D_z` along
/// the rows; a shift of the same size, divided by the pitches, undoes it. Shifts by whole bins and rows are exact. Others interpolate
/// linearly: the error is at most an eighth of the pitch squared times the second derivative, or half of the jump at an edge. Samples from
/// beyond the edges are zero. Samples that are NaN or infinite are not rejected.
///
/// ```
/// let view = [0.0_f64, 1.0, 3.0, 0.0];
/// let mut moved = [0.0; 4];
/// radon::add_shifted(&view, [4, 1], [1.0, 0.0], 1.0, &mut moved)?;
/// assert_eq!(moved, [1.0, 3.0, 0.0, 0.0]);
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// [`RadonError::WrongLength`] unless view and sum have bins x rows samples; [`RadonError::NotFinite`] for the shift or the weight.
pub fn add_shifted<T: Sample>(
    view: &[T],
    [bins, rows]: [usize; 2],
    shift: [f64; 2],
    weight: f64,
    sum: &mut [T],
) -> Result<(), RadonError> {
    let expected = product("samples of a view", bins, rows)?;
    length("view", view.len(), expected)?;
    length("sum", sum.len(), expected)?;
    finite("shift along the bins", shift[0])?;
    finite("shift along the rows", shift[1])?;
    finite("weight", weight)?;
    let along = shift.map(|by| (by.floor(), by - by.floor()));
    for (row, out) in sum.chunks_mut(bins.max(1)).enumerate() {
        for (down, of_row) in neighbours(row, along[1], rows) {
            let from = &view[down * bins..][..bins];
            for (bin, value) in out.iter_mut().enumerate() {
                for (at, of_bin) in neighbours(bin, along[0], bins) {
                    *value += T::of(weight * of_row * of_bin * from[at].f64());
                }
            }
        }
    }
    Ok(())
}

/// Returns the existing neighbours of a shifted position, with their weights.
fn neighbours(
    at: usize,
    (whole, part): (f64, f64),
    n: usize,
) -> impl Iterator<Item = (usize, f64)> {
    let low = at as f64 + whole;
    [(low, 1.0 - part), (low + 1.0, part)]
        .into_iter()
        .filter(move |(at, weight)| *weight > 0.0 && *at >= 0.0 && *at < n as f64)
        .map(|(at, weight)| (at as usize, weight))
}
