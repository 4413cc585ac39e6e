//! Statistics of an image within a mask, and its distance from the ground truth.

use crate::error::{RadonError, finite, length, zeros};
use crate::{ImageGrid, Sample, parallel};
use std::ops::Range;

/// Sums are computed over blocks of this many samples and added in order, so that the result is bitwise identical for any number of
/// threads. A block fits in the first-level cache.
const BLOCK: usize = 1 << 12;

/// Parallel sums within a block: a single one would wait for each addition.
const LANES: usize = 8;

/// Returns the pixels of `grid` whose centre is at most `radius` from the axis of rotation, the origin; index order `[y][x]`.
///
/// With `radius = (n / 2 - 1) * spacing` on a centred square grid this is the inscribed circle less
/// one pixel; not every view covers the pixels outside.
///
/// ```
/// let grid = radon::ImageGrid::square(4, 1.0)?;
/// let disc = radon::disc_mask(&grid, 1.6)?;
/// assert_eq!(disc.iter().filter(|&&inside| inside).count(), 12); // all but the corners
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// [`RadonError::NotFinite`] for the radius, [`RadonError::TooLarge`].
pub fn disc_mask(grid: &ImageGrid, radius: f64) -> Result<Vec<bool>, RadonError> {
    finite("radius", radius)?;
    let mut mask = zeros("mask", grid.nx(), grid.ny())?;
    for (iy, row) in mask.chunks_exact_mut(grid.nx()).enumerate() {
        for (ix, inside) in row.iter_mut().enumerate() {
            let [x, y] = grid.pixel_centre(ix, iy);
            *inside = x.hypot(y) <= radius;
        }
    }
    Ok(mask)
}

/// Count, sum, mean, standard deviation and root mean square of the samples within a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
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
    /// Computes statistics of `values` where `mask` is set; `None` if it is set nowhere.
    ///
    /// A stack `[slice][y][x]` takes the mask of a slice repeated: `mask.repeat(n_slices)`. Sums are `f64`; the spread is that about the means of
    /// blocks of samples, referred to the mean of all, so that a small spread about a large mean is accurate. Values are read once, or a second
    /// time where their squares under- or overflow. If a sample in the mask is NaN or infinite, `sum`, `mean` and `rms` are NaN or infinite as
    /// sums of such numbers are, and `std` is NaN. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::WrongLength`] if values and mask differ in length.
    ///
    /// ```
    /// let stats = radon::MaskedStats::of(&[1.0f32, 9.0, 3.0, 9.0], &[true, false, true, false])?.unwrap();
    /// assert_eq!((stats.count, stats.mean, stats.std), (2, 2.0, 1.0));
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    pub fn of<T: Sample>(values: &[T], mask: &[bool]) -> Result<Option<Self>, RadonError> {
        length("mask", mask.len(), values.len())?;
        Ok(statistics([values], mask, |[v]| v))
    }
}

/// Statistics of `value` of the samples of some arrays, which is linear.
fn statistics<T: Sample, const K: usize>(
    arrays: [&[T]; K],
    mask: &[bool],
    value: impl Fn([f64; K]) -> f64 + Sync,
) -> Option<MaskedStats> {
    let plain = scaled(arrays, mask, &value, 1.0)?;
    if (1e-120..1e140).contains(&plain.rms) {
        return Some(plain);
    }
    // Squares, or those of rounding errors, may under- or overflow.
    let sizes = (0..mask.len()).map(|i| value(arrays.map(|a| a[i].f64())).abs());
    let sizes = sizes.zip(mask).filter(|(_, set)| **set);
    match sizes.fold(0.0, |most, (size, _)| size.max(most)) {
        0.0 => Some(plain),
        most => scaled(arrays, mask, &value, 1.0 / most.clamp(1e-300, f64::MAX)),
    }
}

/// The statistics by sums of the values times `scale`.
fn scaled<T: Sample, const K: usize>(
    arrays: [&[T]; K],
    mask: &[bool],
    value: &(impl Fn([f64; K]) -> f64 + Sync),
    scale: f64,
) -> Option<MaskedStats> {
    let value = |samples: [f64; K]| value(samples.map(|x| x * scale));
    let parts = blocks(mask.len(), |block| {
        let n = count_in(block.clone(), mask) as f64;
        if n == 0.0 {
            return [0.0; 6];
        }
        let of = |samples| [value(samples), value(samples).powi(2)];
        let [sum, square] = sums_where(arrays, block.clone(), mask, of);
        let mean = sum / n;
        let of = |samples| [value(samples) - mean, (value(samples) - mean).powi(2)];
        let [shift, spread] = sums_where(arrays, block, mask, of);
        [n, sum, square, mean, shift, spread]
    });
    let [n, sum, square] = [0, 1, 2].map(|k| parts.iter().map(|part| part[k]).sum::<f64>());
    let mean = sum / n;
    // Σ (v - mean), which is zero but for rounding, and Σ (v - mean)², from those about the means of the blocks.
    let (mut shift, mut spread) = (0.0, 0.0);
    for [n, .., of_block, by, squares] in &parts {
        let apart = of_block - mean;
        shift += by + n * apart;
        spread += squares + apart * (2.0 * by + n * apart);
    }
    (n > 0.0).then(|| MaskedStats {
        count: n as usize,
        sum: sum / scale,
        mean: mean / scale,
        // Unlike `max`, `clamp` keeps NaN.
        std: ((spread - shift * shift / n).clamp(0.0, f64::INFINITY) / n).sqrt() / scale,
        rms: (square / n).sqrt() / scale,
    })
}

/// Returns the root mean square of `values - truth` where `mask` is set; `None` if it is set nowhere.
///
/// # Errors
/// [`RadonError::WrongLength`] if the arrays differ in length.
pub fn rmse_within<T: Sample>(
    values: &[T],
    truth: &[T],
    mask: &[bool],
) -> Result<Option<f64>, RadonError> {
    length("truth", truth.len(), values.len())?;
    length("mask", mask.len(), values.len())?;
    Ok(statistics([values, truth], mask, |[v, t]| v - t).map(|stats| stats.rms))
}

/// Returns `part` of each block of the samples, in order.
fn blocks<P: Send>(len: usize, part: impl Fn(Range<usize>) -> P + Sync) -> Vec<P> {
    let of = |block: usize| part(block * BLOCK..len.min((block + 1) * BLOCK));
    parallel::collect(len.div_ceil(BLOCK), &of)
}

fn count_in(block: Range<usize>, mask: &[bool]) -> usize {
    (mask[block].chunks(usize::from(u8::MAX)))
        // Summed in bytes, sixteen at once.
        .map(|few| usize::from(few.iter().map(|&set| u8::from(set)).sum::<u8>()))
        .sum()
}

/// Sums the terms of a block's samples in the mask.
fn sums_where<T: Sample, const K: usize, const N: usize>(
    arrays: [&[T]; K],
    block: Range<usize>,
    mask: &[bool],
    terms: impl Fn([f64; K]) -> [f64; N],
) -> [f64; N] {
    let mut lanes = [[0.0; LANES]; N];
    let mut add = |lane: usize, terms: [f64; N]| {
        for (sums, term) in lanes.iter_mut().zip(terms) {
            sums[lane] += term;
        }
    };
    let (arrays, mask) = (arrays.map(|a| &a[block.clone()]), &mask[block]);
    let groups = arrays.map(|a| a.as_chunks::<LANES>().0);
    let (masks, rest) = mask.as_chunks::<LANES>();
    for (g, set) in masks.iter().enumerate() {
        let group = groups.map(|a| &a[g]);
        let at = |lane: usize| terms(group.map(|a| a[lane].f64()));
        // Masks consist of long runs.
        if *set == [true; LANES] {
            (0..LANES).for_each(|lane| add(lane, at(lane)));
        } else if *set != [false; LANES] {
            let in_it = (0..LANES).filter(|&lane| set[lane]);
            in_it.for_each(|lane| add(lane, at(lane)));
        }
    }
    let done = mask.len() - rest.len();
    for (l, _) in rest.iter().enumerate().filter(|(_, set)| **set) {
        add(l, terms(arrays.map(|a| a[done + l].f64())));
    }
    lanes.map(|sums| sums.iter().sum())
}
