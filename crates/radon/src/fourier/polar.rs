//! Positions of the samples of the rows' spectra in the spectrum of the image: by the projection-slice theorem, on a line through the
//! origin for each view.
//!
//! The transform of a row has the period 1/pitch. Beyond the first half period there are copies of the same numbers, *replicas* m = -1, 1,
//! -2, ... The response of the interpolation between bins attenuates them; the gains contain it.

use std::f64::consts::TAU;
use std::ops::Range;

use rustfft::num_complex::Complex;

use crate::error::{RadonError, room, within, zeros};
use crate::simd::DIGITS;
use crate::{ImageGrid, ParallelGeometry};

/// Largest frequency of a row in steps, and in periods of its spectrum. The gains of a plan take 8 bytes per step.
const MOST: [f64; 2] = [(1 << 24) as f64, 1024.0];

/// The line of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct PolarView {
    /// Index of the view in the geometry.
    pub(super) view: usize,
    /// Step between frequencies in units of 2^-DIGITS cells of the image's spectrum; never negative across the columns.
    pub(super) step: [i64; 2],
    /// Phase per frequency step, from the row's first bin to the image's reference pixel.
    pub(super) turn: f64,
    /// Whether the line is traversed backwards, with complex conjugates.
    pub(super) conjugate: bool,
    /// The largest used frequency, in steps.
    pub(super) most: usize,
}

/// All lines, and the grid that contains them.
#[derive(Debug)]
pub(super) struct Polar {
    /// Sorted by direction.
    pub(super) views: Vec<PolarView>,
    /// Position of each view of the geometry in `views`.
    pub(super) places: Vec<usize>,
    /// Period of a row in samples.
    pub(super) row_len: usize,
    /// Used copies of the half spectrum.
    pub(super) replicas: Vec<i64>,
    /// Cells of the image's spectrum along x and along y.
    pub(super) cells: [usize; 2],
}

/// A part of a view's samples along a path through some columns.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Index of the replica.
    pub(super) replica: usize,
    /// Samples of the half spectrum.
    pub(super) samples: Range<usize>,
    /// Position of the first sample; along x, multiples of the grid's period are added.
    pub(super) at: [i64; 2],
    pub(super) step: [i64; 2],
    /// Whether these are mirror images through the origin, whose values are complex conjugates.
    pub(super) mirrored: bool,
}

/// Columns of the samples and of their mirror images, in the finest unit of positions.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) samples: Range<i64>,
    pub(super) mirrored: Range<i64>,
}

impl Polar {
    /// `row_len` samples per row; `most(direction)` is the largest frequency of a view in units of 1/pitch. The frequencies of plus and
    /// minus half a period are the same number of a row. `both_ends` counts that number for each of the two, whether or not a higher
    /// frequency is used; otherwise they divide it if they are the largest.
    pub(super) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        (row_len, cells): (usize, [usize; 2]),
        most: impl Fn([f64; 2]) -> f64,
        both_ends: bool,
    ) -> Result<Self, RadonError> {
        let one = (1_i64 << DIGITS) as f64;
        let reference = grid.pixel_centre(grid.nx() / 2, grid.ny() / 2);
        let period = row_len as f64 * geometry.pitch();
        let mut views = room("views of a plan", geometry.n_views(), 1)?;
        let mut farthest = 0;
        for (view, theta) in geometry.angles().iter().enumerate() {
            let (sin, cos) = theta.sin_cos();
            let direction = [cos, sin];
            let along = reference[0] * cos + reference[1] * sin;
            let periods = most(direction);
            within("periods of a row's spectrum", periods, 0.0, MOST[1])?;
            let most = periods * row_len as f64;
            within("frequencies of a row", most, 0.0, MOST[0])?;
            let most = most as usize;
            let mut step = [0; 2];
            for axis in 0..2 {
                let cells = direction[axis] * grid.spacing()[axis] * cells[axis] as f64 / period;
                // Positions of up to 2^26 cells leave a sign bit in 64 bits.
                let reach = cells.abs() * (most + row_len) as f64;
                within("cells of the spectrum", reach, 0.0, f64::from(1 << 25))?;
                // Even: see `segments`.
                step[axis] = 2 * (cells * one / 2.0).round() as i64;
            }
            let conjugate = step[0] < 0;
            if conjugate {
                step = step.map(|s| -s);
            }
            farthest = farthest.max(most);
            views.push(PolarView {
                view,
                step,
                turn: TAU * ((geometry.bin_centre(0) - along) / period),
                conjugate,
                most,
            });
        }
        // Neighbours in direction visit neighbouring cells.
        let slope = |view: &PolarView| (view.step[1] as f64).atan2(view.step[0] as f64);
        views.sort_by(|a, b| slope(a).total_cmp(&slope(b)).then(a.view.cmp(&b.view)));
        let mut places = zeros("views of a plan", views.len(), 1)?;
        for (place, view) in views.iter().enumerate() {
            places[view.view] = place;
        }
        // Replicas with a frequency within reach.
        let n = farthest.div_ceil(row_len) as i64;
        let half = (row_len / 2) as i64;
        let within_reach = |m: &i64| {
            let nearest = if *m < 0 {
                -m * row_len as i64 - half
            } else {
                m * row_len as i64
            };
            *m == 0 || nearest < farthest as i64 + i64::from(both_ends)
        };
        Ok(Self {
            views,
            places,
            row_len,
            replicas: (-n..=n).filter(within_reach).collect(),
            cells,
        })
    }

    /// Samples of half a spectrum.
    pub(super) fn half_len(&self) -> usize {
        self.row_len / 2 + 1
    }

    /// Returns the frequency of the first sample of a replica.
    pub(super) fn first(&self, replica: usize) -> i64 {
        self.replicas[replica] * self.row_len as i64
    }

    /// Returns the used samples of a view's replica.
    fn used(&self, view: &PolarView, replica: usize) -> Range<usize> {
        let (first, most) = (self.first(replica), view.most as i64);
        let last = (most - first).min(self.row_len as i64 / 2);
        let start = (-most - first).max(0);
        start as usize..(last + 1).max(start) as usize
    }

    /// Lists the segments of a view in some columns, in an order that does not depend on the columns.
    pub(super) fn segments(
        &self,
        view: &PolarView,
        columns: &Columns,
        mut found: impl FnMut(Segment),
    ) {
        let turn = (self.cells[0] as i64) << DIGITS;
        for replica in 0..self.replicas.len() {
            let used = self.used(view, replica);
            if used.is_empty() {
                continue;
            }
            let n = used.len() as i64;
            let first = self.first(replica) + used.start as i64;
            for (mirrored, sign, window) in
                [(false, 1, &columns.samples), (true, -1, &columns.mirrored)]
            {
                let step = view.step.map(|s| sign * s);
                // Odd, so that no position is at the edge of a cell, where a mirror image would be in another cell.
                let at = step.map(|s| s * first + sign);
                let ends = [at[0], at[0] + (n - 1) * step[0]];
                let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                // Periods after which a position is in the window.
                let turns =
                    ceil_div(window.start - most, turn)..=(window.end - 1 - least).div_euclid(turn);
                for turns in turns {
                    let at = [at[0] + turns * turn, at[1]];
                    let inside = match step[0] {
                        0 => 0..n,
                        s if s > 0 => {
                            ceil_div(window.start - at[0], s)..ceil_div(window.end - at[0], s)
                        }
                        s => {
                            (at[0] - window.end).div_euclid(-s) + 1
                                ..(at[0] - window.start).div_euclid(-s) + 1
                        }
                    };
                    let (start, end) = (inside.start.max(0), inside.end.min(n));
                    if start < end {
                        found(Segment {
                            replica,
                            samples: used.start + start as usize..used.start + end as usize,
                            at: [at[0] + start * step[0], at[1] + start * step[1]],
                            step,
                            mirrored,
                        });
                    }
                }
            }
        }
    }
}

/// The quotient, rounded up.
fn ceil_div(a: i64, b: i64) -> i64 {
    -(-a).div_euclid(b)
}

/// exp(-i k turn) for k = 0, 1, ..., some at a time.
pub(super) fn turns(turn: f64) -> impl Iterator<Item = Complex<f64>> {
    // Computed side by side, because dependent products would be slow.
    const TOGETHER: usize = 8;
    let step = Complex::cis(-turn * TOGETHER as f64);
    let mut these: [Complex<f64>; TOGETHER] =
        std::array::from_fn(|l| Complex::cis(-turn * l as f64) / step);
    std::iter::repeat_with(move || {
        these = these.map(|phase| phase * step);
        these
    })
    .flatten()
}
