//! Back-projection of one tile of pixels for a block of slices: the inner loop.

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::registers::Registers;
use crate::simd::vector::{RUN, Truncated, Vector, WINDOW};

/// Views whose part of a tile is accumulated in registers.
const GROUP: usize = 8;
/// Runs of a tile of one slice, at most.
pub(crate) const ALONE: usize = 128;

/// Position of pixel `(ix, iy)` in the filtered row of a view: sample `first + ix * dx + iy * dy`, margin included.
#[derive(Clone, Debug)]
pub(crate) struct ViewStep<T> {
    first: f64,
    dx: f64,
    dy: f64,
    /// Displacement from the first pixel of a run to the one with the smallest position.
    least_dx: f64,
    /// `l * dx` for the pixels of a run.
    lane_dx: [T; RUN],
    /// Whether a run's samples lie within `WINDOW`.
    narrow: bool,
}

impl<T: Scalar> ViewStep<T> {
    pub(crate) fn new(first: f64, dx: f64, dy: f64) -> Self {
        Self {
            first,
            dx,
            dy,
            least_dx: (dx * (RUN - 1) as f64).min(0.0),
            lane_dx: std::array::from_fn(|l| T::of(l as f64 * dx)),
            narrow: dx.abs() * (RUN as f64) < (WINDOW - 3) as f64,
        }
    }

    /// Returns the position of a run whose first pixel is `(ix, iy)`: base sample, position of the first pixel relative to it, and the
    /// largest position that reads a sample of the row. Positions beyond either end are moved to two zeros.
    #[inline(always)]
    fn place(&self, ix: f64, iy: f64, n: usize) -> (i32, T, T) {
        let u = self.first + iy * self.dy + ix * self.dx;
        let least = u + self.least_dx;
        let most = n as f64 + 3.0;
        let least = if least > 0.0 { least } else { 0.0 };
        let least = if least < most { least } else { most };
        // SAFETY: a plan limits rows to far less than 2^31 samples, and NaN has become 0.
        let base: i32 = unsafe { least.to_int_unchecked() };
        let from = f64::from(base);
        (base, T::of(u - from), T::of(most - from))
    }
}

/// A tile: `runs` runs of pixels per row from `(ix, iy)`, and the samples that are summed.
#[derive(Debug)]
pub struct Tile<'a, T> {
    pub(crate) views: &'a [ViewStep<T>],
    /// `[view][sample][lane]`, with margins.
    pub(crate) filtered: &'a [T],
    pub(crate) row_len: usize,
    /// Samples of a row without margins.
    pub(crate) n: usize,
    pub(crate) ix: usize,
    pub(crate) iy: usize,
    pub(crate) runs: usize,
}

/// Adds all views to the sums of a tile, `[row][pixel][lane]`.
pub(super) fn add_views<T: Registers>(
    set: InstructionSet,
    lanes: usize,
    tile: &Tile<'_, T>,
    sums: &mut [T],
) {
    assert_eq!(tile.filtered.len(), tile.views.len() * tile.row_len * lanes);
    // From the largest base, n + 3, a run's window lies within the row. So do the samples at a position that was rounded up to the
    // precision of T, by at most 16 in rows of 2^28 samples.
    assert!(tile.row_len >= tile.n + 3 + WINDOW && (lanes > 1 || sums.len() <= ALONE * RUN));
    // SAFETY: a plan contains a set only after `is_available`.
    unsafe { add_tile(set, lanes, tile, sums) }
}

per_set!(fn add_tile<Registers>(lanes: usize, tile: &Tile<'_, T>, sums: &mut [T]) = add_lanes);

/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn add_lanes<T: Truncated, V: Vector<T>>(lanes: usize, tile: &Tile<'_, T>, sums: &mut [T]) {
    // SAFETY: the caller's promise.
    unsafe {
        match lanes / V::WIDTH {
            _ if lanes == 1 => add_one::<T, V>(tile, sums),
            1 => add_block::<T, V, 1, 2>(tile, sums),
            2 => add_block::<T, V, 2, 2>(tile, sums),
            4 => add_block::<T, V, 4, 2>(tile, sums),
            8 => add_block::<T, V, 8, 1>(tile, sums),
            #[expect(clippy::unreachable, reason = "callers pass 1, 2, 4 or 8 vectors")]
            _ => unreachable!("{lanes} lanes"),
        }
    }
}

/// Many slices: `N` vectors of them. The sums of `PIXELS` pixels are in registers together: the second's work hides the latency
/// of the first's.
///
/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn add_block<T: Truncated, V: Vector<T>, const N: usize, const PIXELS: usize>(
    tile: &Tile<'_, T>,
    sums: &mut [T],
) {
    let lanes = N * V::WIDTH;
    for (group, views) in tile.views.chunks(GROUP).enumerate() {
        // Along the columns of one run's width, whose samples then stay in the first-level cache.
        let n_runs = sums.len() / (RUN * lanes);
        let n_rows = n_runs / tile.runs;
        for i in 0..n_runs {
            let (r, c) = (i % n_rows, i / n_rows);
            let sums = &mut sums[(r * tile.runs + c) * RUN * lanes..][..RUN * lanes];
            let mut places = [(tile.filtered.as_ptr(), [0i32; RUN], [T::ZERO; RUN]); GROUP];
            for (k, view) in views.iter().enumerate() {
                let (base, first, most) =
                    view.place((tile.ix + c * RUN) as f64, (tile.iy + r) as f64, tile.n);
                let start = ((group * GROUP + k) * tile.row_len + base as usize) * lanes;
                // SAFETY: the machine has the set; `add_views` has verified that a row is long enough for every base.
                unsafe {
                    let (index, weight) = V::locate(first, &view.lane_dx, most);
                    places[k] = (tile.filtered.as_ptr().add(start), index, weight);
                }
            }
            let places = &places[..views.len()];
            for (pair, sums) in sums.chunks_exact_mut(PIXELS * lanes).enumerate() {
                // SAFETY: a chunk has N vectors per pixel; the machine has the set; every index lies in its row, with its right neighbour.
                unsafe {
                    let at = sums.as_mut_ptr();
                    let mut acc: [[V; N]; PIXELS] = std::array::from_fn(|l| {
                        std::array::from_fn(|i| V::load(at.add((l * N + i) * V::WIDTH)))
                    });
                    for (row, index, weight) in places {
                        for l in 0..PIXELS {
                            let k = pair * PIXELS + l;
                            let sample = row.add(*index.get_unchecked(k) as usize * lanes);
                            let w1 = V::splat(*weight.get_unchecked(k));
                            let w0 = V::splat(T::ONE).minus(w1);
                            for i in 0..N {
                                let p0 = V::load(sample.add(i * V::WIDTH));
                                let p1 = V::load(sample.add((N + i) * V::WIDTH));
                                acc[l][i] = w1.multiply_add(p1, w0.multiply_add(p0, acc[l][i]));
                            }
                        }
                    }
                    for l in 0..PIXELS {
                        for i in 0..N {
                            acc[l][i].store(at.add((l * N + i) * V::WIDTH));
                        }
                    }
                }
            }
        }
    }
}

/// One slice.
///
/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn add_one<T: Truncated, V: Vector<T>>(tile: &Tile<'_, T>, sums: &mut [T]) {
    let (sums, _) = sums.as_chunks_mut::<RUN>();
    let (mut ix, mut iy) = ([0.0; ALONE], [0.0; ALONE]);
    for i in 0..sums.len() {
        ix[i] = (tile.ix + i % tile.runs * RUN) as f64;
        iy[i] = (tile.iy + i / tile.runs) as f64;
    }
    let (mut base, mut first, mut most) = ([0; ALONE], [T::ZERO; ALONE], [T::ZERO; ALONE]);
    let views = tile.views.iter();
    for (view, samples) in views.zip(tile.filtered.chunks_exact(tile.row_len)) {
        // All runs of the tile first, in a simple loop that is vectorised.
        for i in 0..sums.len() {
            (base[i], first[i], most[i]) = view.place(ix[i], iy[i], tile.n);
        }
        for (i, sums) in sums.iter_mut().enumerate() {
            // SAFETY: the machine has the set; `add_views` has verified that a row is long enough for every base.
            unsafe {
                let row = samples.as_ptr().add(base[i] as usize);
                V::add_run(sums, row, first[i], &view.lane_dx, most[i], view.narrow);
            }
        }
    }
}
