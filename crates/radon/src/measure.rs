//! What an image says within a mask: mean, spread, distance from the truth.

use crate::error::{RadonError, length};
use crate::{ImageGrid, Sample};
use rayon::prelude::*;

/// Sums are taken over blocks of this many samples and added in order, so that the result has the
/// same bits for any number of threads.
const BLOCK: usize = 1 << 14;

/// The pixels of `grid` whose centre is at most `radius` from the origin, about which the views
/// turn; index order `[y][x]`.
///
/// With `radius = (n / 2 - 1) * spacing` on a centred square grid this is the inscribed circle less
/// one pixel, outside of which not every view sees the object.
///
/// ```
/// let grid = radon::ImageGrid::square(4, 1.0)?;
/// let disc = radon::disc_mask(&grid, 1.6);
/// assert_eq!(disc.iter().filter(|&&inside| inside).count(), 12); // all but the corners
/// # Ok::<(), radon::RadonError>(())
/// ```
pub fn disc_mask(grid: &ImageGrid, radius: f64) -> Vec<bool> {
    (0..grid.ny())
        .flat_map(|iy| (0..grid.nx()).map(move |ix| (ix, iy)))
        .map(|(ix, iy)| {
            let [x, y] = grid.pixel_centre(ix, iy);
            x.hypot(y) <= radius
        })
        .collect()
}

/// Count, sum, mean, standard deviation and root mean square of the samples within a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskedStats {
    /// Number of samples in the mask.
    pub count: usize,
    /// Their sum.
    pub sum: f64,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation (of the population: divided by `count`).
    pub std: f64,
    /// Their root mean square.
    pub rms: f64,
}

impl MaskedStats {
    /// Statistics of `values` where `mask` is set; `None` if it is set nowhere.
    ///
    /// A mask shorter than the values is repeated: the mask of a slice serves a stack
    /// `[slice][y][x]`. Sums are kept in `f64`; two passes, so that a small spread about a large
    /// mean is not lost. Same bits for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::WrongLength`] if the mask is empty or its length does not divide that of the
    /// values.
    ///
    /// ```
    /// let stats = radon::MaskedStats::of(&[1.0f32, 9.0, 3.0, 9.0], &[true, false])?.unwrap();
    /// assert_eq!((stats.count, stats.mean, stats.std), (2, 2.0, 1.0));
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    pub fn of<T: Sample>(values: &[T], mask: &[bool]) -> Result<Option<Self>, RadonError> {
        let repeats = repeats(values.len(), mask.len())?;
        let count = repeats * mask.iter().filter(|&&set| set).count();
        if count == 0 {
            return Ok(None);
        }
        let n = count as f64;
        let sum = sum_where(values.len(), mask, |i| values[i].f64());
        let mean = sum / n;
        let variance = sum_where(values.len(), mask, |i| (values[i].f64() - mean).powi(2)) / n;
        let square = sum_where(values.len(), mask, |i| values[i].f64().powi(2)) / n;
        Ok(Some(Self {
            count,
            sum,
            mean,
            std: variance.sqrt(),
            rms: square.sqrt(),
        }))
    }
}

/// Root mean square of `values - truth` where `mask` is set; `None` if it is set nowhere. The mask
/// is repeated as in [`MaskedStats::of`].
///
/// # Errors
/// [`RadonError::WrongLength`] if the arrays differ in length or the mask's does not divide it.
pub fn rmse_within<T: Sample>(
    values: &[T],
    truth: &[T],
    mask: &[bool],
) -> Result<Option<f64>, RadonError> {
    length("truth", truth.len(), values.len())?;
    let count = repeats(values.len(), mask.len())? * mask.iter().filter(|&&set| set).count();
    let sum = sum_where(values.len(), mask, |i| {
        (values[i].f64() - truth[i].f64()).powi(2)
    });
    Ok((count > 0).then(|| (sum / count as f64).sqrt()))
}

/// How often the mask fits into the values.
fn repeats(values: usize, mask: usize) -> Result<usize, RadonError> {
    if mask > 0 && values.is_multiple_of(mask) {
        Ok(values / mask)
    } else {
        Err(RadonError::WrongLength {
            name: "mask",
            given: mask,
            expected: values,
        })
    }
}

/// Sum of `term(i)` over the samples `i < len` in the mask, in a fixed order.
fn sum_where(len: usize, mask: &[bool], term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let blocks: Vec<f64> = (0..len.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let range = block * BLOCK..((block + 1) * BLOCK).min(len);
            let mut j = range.start % mask.len(); // there are no blocks without a mask
            let mut sum = 0.0;
            for i in range {
                if mask[j] {
                    sum += term(i);
                }
                j = if j + 1 == mask.len() { 0 } else { j + 1 };
            }
            sum
        })
        .collect();
    blocks.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_plain_sums() {
        let values: Vec<f64> = (0..50_000).map(|i| (i as f64 * 0.37).sin() + 1e6).collect();
        let mask: Vec<bool> = (0..500).map(|i| i % 3 != 0).collect();
        let picked: Vec<f64> = values
            .iter()
            .enumerate()
            .filter(|(i, _)| mask[i % 500])
            .map(|(_, &v)| v)
            .collect();
        let n = picked.len() as f64;
        let mean = picked.iter().sum::<f64>() / n;
        let std = (picked.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
        let stats = MaskedStats::of(&values, &mask).unwrap().unwrap();
        assert_eq!(stats.count, picked.len());
        // Summing 33 300 terms of 1e6 in another order moves the mean by a few ulps of 1e6.
        assert!((stats.mean - mean).abs() < 1e-8 && (stats.std - std).abs() < 1e-8);
        let shifted: Vec<f64> = values.iter().map(|v| v - 0.5).collect();
        let rmse = rmse_within(&values, &shifted, &mask).unwrap().unwrap();
        assert!((rmse - 0.5).abs() < 1e-9);
    }

    #[test]
    fn wrong_masks_are_errors_and_empty_ones_none() {
        assert!(MaskedStats::of(&[1.0f32; 6], &[true; 4]).is_err());
        assert!(MaskedStats::of(&[1.0f32; 6], &[]).is_err());
        assert_eq!(MaskedStats::of(&[1.0f32; 6], &[false; 3]).unwrap(), None);
        assert_eq!(rmse_within(&[1.0f32; 2], &[1.0; 2], &[false]), Ok(None));
        assert!(rmse_within(&[1.0f32; 2], &[1.0; 3], &[true]).is_err());
    }
}
