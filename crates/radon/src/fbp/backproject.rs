//! Pixel-driven back-projection of a block of slices: slices innermost, tiles of pixels, views in groups.

use std::ops::Range;

use crate::error::{RadonError, room};
use crate::geometry::{ImageGrid, ParallelGeometry};
use crate::parallel;
use crate::sample::Sample;
use crate::simd::{ALONE, InstructionSet, RUN, Tile, ViewStep, WINDOW};
use crate::stack::aligned;

/// Zero samples before a filtered row.
pub(crate) const MARGIN: usize = 2;
/// Zero samples after it: read by a run of pixels beyond the end.
const TAIL: usize = WINDOW + 4;

/// Runs and rows of a tile: its sums and the samples of a group of views fit in the second-level cache, those of one run and its neighbours
/// below and above in the first-level cache.
fn tile_shape(lanes: usize) -> (usize, usize) {
    match lanes {
        1 => (ALONE / 16, 16),
        _ => (4, 16),
    }
}

/// Positions of the pixels in the filtered rows.
#[derive(Clone)]
pub(crate) struct Steps<T> {
    views: Vec<ViewStep<T>>,
    x: Range<usize>,
    y: Range<usize>,
    /// Samples of a filtered row without margins.
    n: usize,
}

impl<T: Sample> Steps<T> {
    pub(crate) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        (x, y): (Range<usize>, Range<usize>),
        n: usize,
        upsampling: usize,
    ) -> Result<Self, RadonError> {
        let up = upsampling as f64;
        let [x0, y0] = grid.pixel_centre(0, 0);
        let [dx, dy] = grid.spacing().map(|d| up * d / geometry.pitch());
        let mut views = room("views of a plan", geometry.n_views(), 1)?;
        views.extend(geometry.angles().iter().map(|theta| {
            let (sin, cos) = theta.sin_cos();
            let first = up * geometry.bin_at(x0 * cos + y0 * sin) + MARGIN as f64;
            ViewStep::new(first, dx * cos, dy * sin)
        }));
        Ok(Self { views, x, y, n })
    }

    pub(crate) fn region(&self) -> (Range<usize>, Range<usize>) {
        (self.x.clone(), self.y.clone())
    }

    pub(crate) fn image_len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    pub(crate) fn row_len(&self) -> usize {
        MARGIN + self.n + TAIL
    }
}

/// Returns the bytes of one thread's sums.
pub(crate) fn tile_bytes<T>(lanes: usize) -> usize {
    let (runs, rows) = tile_shape(lanes);
    runs * RUN * rows * lanes * size_of::<T>()
}

/// Adds `views`, filtered as `[view][sample][lane]`, to one image per lane; the first views overwrite the images.
pub(crate) fn run<T: Sample>(
    steps: &Steps<T>,
    instructions: InstructionSet,
    views: Range<usize>,
    filtered: &[T],
    lanes: usize,
    images: &mut [&mut [T]],
) {
    let first = views.start == 0;
    let (runs, rows) = tile_shape(lanes);
    let width = steps.x.len();
    // Bands of whole tiles: (first row, the band's part of each image). Tiles start at multiples of their size in the grid for any region.
    let mut bands: Vec<(usize, Vec<&mut [T]>)> = Vec::new();
    let mut rest: Vec<&mut [T]> = images.iter_mut().map(|image| &mut **image).collect();
    let mut iy = steps.y.start;
    while iy < steps.y.end {
        let end = ((iy / rows + 1) * rows).min(steps.y.end);
        let mut band = Vec::with_capacity(rest.len());
        rest = rest
            .into_iter()
            .map(|image| {
                let (head, tail) = image.split_at_mut((end - iy) * width);
                band.push(head);
                tail
            })
            .collect();
        bands.push((iy, band));
        iy = end;
    }
    let n_tiles = bands.len() * (steps.x.end - steps.x.start / RUN * RUN).div_ceil(runs * RUN);
    parallel::chunks_with(&mut bands, 1, &Vec::new, &|sums, _, bands| {
        let (iy, band) = &mut bands[0];
        let sums = aligned(sums, runs * RUN * rows * lanes);
        let n_rows = band[0].len() / width;
        let mut ix = steps.x.start / RUN * RUN;
        while ix < steps.x.end {
            let runs = runs.min((steps.x.end - ix).div_ceil(RUN));
            let sums = &mut sums[..n_rows * runs * RUN * lanes];
            let end = (ix + runs * RUN).min(steps.x.end);
            let start = ix.max(steps.x.start);
            let pixels = start - steps.x.start..end - steps.x.start;
            sums.fill(T::ZERO);
            if !first {
                for r in 0..n_rows {
                    let rows: Vec<&[T]> = band
                        .iter()
                        .map(|image| &image[r * width..][pixels.clone()])
                        .collect();
                    let sums = &mut sums[(r * runs * RUN + start - ix) * lanes..];
                    T::interleave(instructions, &rows, lanes, sums);
                }
            }
            let tile = Tile {
                views: &steps.views[views.clone()],
                filtered,
                row_len: steps.row_len(),
                n: steps.n,
                ix,
                iy: *iy,
                runs,
            };
            simd_set::unit(n_tiles);
            T::add_views(instructions, lanes, &tile, sums);
            for r in 0..n_rows {
                let mut rows: Vec<&mut [T]> = band
                    .iter_mut()
                    .map(|image| &mut image[r * width..][pixels.clone()])
                    .collect();
                let sums = &sums[(r * runs * RUN + start - ix) * lanes..];
                T::separate(instructions, sums, lanes, &mut rows);
            }
            ix = end;
        }
    });
}
