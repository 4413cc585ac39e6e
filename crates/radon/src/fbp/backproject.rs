//! Pixel-driven back-projection of a block of slices: slices innermost, tiles of pixels, views in groups.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::{ImageGrid, ParallelGeometry};
use crate::sample::Sample;

/// Slices that share the work of one index and weight, at most.
pub(crate) const LANES: usize = 128;
/// Zero samples in front of a filtered row.
pub(crate) const MARGIN: usize = 2;
/// Zero samples behind it.
const TAIL: usize = 36;
/// Pixels of a tile: one run along x, a few rows. Tiles start at multiples of these in the grid, whatever the region.
const RUN: usize = 16;
const ROWS: usize = 8;
/// Views whose part of a tile is added up in registers.
const GROUP: usize = 5;

/// Lanes of a block of `n` slices.
pub(crate) fn lanes_for(n: usize) -> usize {
    [1, 16, 32, 64]
        .into_iter()
        .find(|&l| n <= l)
        .unwrap_or(LANES)
}

/// Where each pixel falls in each filtered row.
pub(crate) struct Steps {
    views: Vec<ViewStep>,
    x: Range<usize>,
    y: Range<usize>,
    /// Samples of a filtered row without margins.
    n: usize,
}

/// `u = origin + ix * dx + iy * dy`, in samples of the filtered row.
struct ViewStep {
    origin: f64,
    dx: f64,
    dy: f64,
}

/// One run of pixels in one view.
#[derive(Clone, Copy)]
struct Place<T> {
    base: i32,
    first: T,
    most: T,
}

impl Steps {
    pub(crate) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        (x, y): (Range<usize>, Range<usize>),
        n: usize,
        upsampling: usize,
    ) -> Self {
        let up = upsampling as f64;
        let [x0, y0] = grid.pixel_centre(0, 0);
        let views = geometry
            .angles()
            .iter()
            .map(|theta| {
                let (sin, cos) = theta.sin_cos();
                let scale = up * grid.spacing() / geometry.pitch();
                ViewStep {
                    origin: up * geometry.bin_at(x0 * cos + y0 * sin),
                    dx: scale * cos,
                    dy: scale * sin,
                }
            })
            .collect();
        Self { views, x, y, n }
    }

    pub(crate) fn image_len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    pub(crate) fn row_len(&self) -> usize {
        MARGIN + self.n + TAIL
    }

    fn place<T: Sample>(&self, view: &ViewStep, ix: usize, iy: usize) -> Place<T> {
        let u = view.origin + ix as f64 * view.dx + iy as f64 * view.dy;
        let least = u.min(u + (RUN - 1) as f64 * view.dx);
        let most = self.n as f64 + 1.0;
        let base = least.floor().clamp(-(MARGIN as f64), most);
        Place {
            base: base as i32,
            first: T::of(u - base),
            most: T::of(most - base),
        }
    }
}

/// Back-projects `[view][sample][lane]` into one image a lane.
pub(crate) fn run<T: Sample>(steps: &Steps, filtered: &[T], lanes: usize, images: &mut [&mut [T]]) {
    let (width, rows) = (steps.x.len(), steps.y.clone());
    // Bands of whole tiles: (first row, the band's part of each image).
    let mut bands: Vec<(usize, Vec<&mut [T]>)> = Vec::new();
    let mut rest: Vec<&mut [T]> = images.iter_mut().map(|image| &mut **image).collect();
    let mut iy = rows.start;
    while iy < rows.end {
        let end = ((iy / ROWS + 1) * ROWS).min(rows.end);
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
    bands.into_par_iter().for_each_init(
        || vec![T::ZERO; RUN * ROWS * lanes],
        |tile, (iy, mut band)| match lanes {
            1 => band_of::<T, 1>(steps, filtered, iy, tile, &mut band),
            16 => band_of::<T, 16>(steps, filtered, iy, tile, &mut band),
            32 => band_of::<T, 32>(steps, filtered, iy, tile, &mut band),
            64 => band_of::<T, 64>(steps, filtered, iy, tile, &mut band),
            _ => band_of::<T, LANES>(steps, filtered, iy, tile, &mut band),
        },
    );
}

fn band_of<T: Sample, const B: usize>(
    steps: &Steps,
    filtered: &[T],
    iy: usize,
    tile: &mut [T],
    band: &mut [&mut [T]],
) {
    let width = steps.x.len();
    let n_rows = band[0].len() / width;
    let row_len = steps.row_len();
    let mut ix = steps.x.start / RUN * RUN;
    while ix < steps.x.end {
        let pixels = steps.x.start.max(ix) - ix..steps.x.end.min(ix + RUN) - ix;
        tile.fill(T::ZERO);
        for (group, views) in steps.views.chunks(GROUP).enumerate() {
            for r in 0..n_rows {
                let mut offset = [[0usize; RUN]; GROUP];
                let mut weight = [[T::ZERO; RUN]; GROUP];
                for (k, view) in views.iter().enumerate() {
                    let place = steps.place::<T>(view, ix, iy + r);
                    let start = ((group * GROUP + k) * row_len) as isize
                        + (place.base + MARGIN as i32) as isize;
                    for l in 0..RUN {
                        let t = (place.first + T::of(l as f64 * view.dx)).held(T::ZERO, place.most);
                        let j = t.truncated();
                        offset[k][l] = (start + j as isize) as usize * B;
                        weight[k][l] = t - T::of(j as f64);
                    }
                }
                for l in pixels.clone() {
                    let sums = &mut tile[(r * RUN + l) * B..][..B];
                    let mut acc = [T::ZERO; B];
                    acc.copy_from_slice(sums);
                    for k in 0..views.len() {
                        let w = weight[k][l];
                        let w0 = T::ONE - w;
                        let pair = &filtered[offset[k][l]..][..2 * B];
                        let (p0, p1) = pair.split_at(B);
                        for s in 0..B {
                            acc[s] = acc[s] + w0 * p0[s] + w * p1[s];
                        }
                    }
                    sums.copy_from_slice(&acc);
                }
            }
        }
        for (s, image) in band.iter_mut().enumerate() {
            for r in 0..n_rows {
                for l in pixels.clone() {
                    image[r * width + ix + l - steps.x.start] = tile[(r * RUN + l) * B + s];
                }
            }
        }
        ix += RUN;
    }
}
