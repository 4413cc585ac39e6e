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
    /// A stack `[slice][y][x]` takes the mask of a slice repeated: `mask.repeat(n_slices)`. Sums are `f64`; the spread combines the spreads about the
    /// means of blocks of samples and the spread of these means (Chan, Golub, LeVeque 1983, <https://doi.org/10.1080/00031305.1983.10483115>), so
    /// that a small spread about a large mean is accurate. Values are read once. Bitwise identical for any number of threads.
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
        let parts = blocks(values.len(), |block| {
            let count = count_in(block.clone(), mask);
            if count == 0 {
                return Part::default();
            }
            let [sum, square] = sums_where([values], block.clone(), mask, |[v]| [v, v * v]);
            let mean = sum / count as f64;
            let [spread] = sums_where([values], block, mask, |[v]| [(v - mean) * (v - mean)]);
            Part {
                count,
                sum,
                spread,
                square,
            }
        });
        let all = parts.into_iter().fold(Part::default(), Part::with);
        if all.count == 0 {
            return Ok(None);
        }
        let n = all.count as f64;
        Ok(Some(Self {
            count: all.count,
            sum: all.sum,
            mean: all.sum / n,
            std: (all.spread / n).sqrt(),
            rms: (all.square / n).sqrt(),
        }))
    }
}

/// The contribution of some samples to the statistics.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    count: usize,
    sum: f64,
    /// Sum of the squared distances from their own mean.
    spread: f64,
    square: f64,
}

impl Part {
    fn with(self, more: Part) -> Part {
        if self.count == 0 || more.count == 0 {
            return if self.count == 0 { more } else { self };
        }
        let [n, m] = [self.count as f64, more.count as f64];
        let apart = more.sum / m - self.sum / n;
        Part {
            count: self.count + more.count,
            sum: self.sum + more.sum,
            spread: self.spread + more.spread + apart * apart * (n * m / (n + m)),
            square: self.square + more.square,
        }
    }
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
    let parts = blocks(values.len(), |block| {
        let count = count_in(block.clone(), mask);
        let square = |[v, t]: [f64; 2]| [(v - t) * (v - t)];
        let [sum] = match count {
            0 => [0.0],
            _ => sums_where([values, truth], block, mask, square),
        };
        (count, sum)
    });
    let (count, sum) = (parts.into_iter()).fold((0, 0.0), |(n, a), (m, b)| (n + m, a + b));
    Ok((count > 0).then(|| (sum / count as f64).sqrt()))
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
