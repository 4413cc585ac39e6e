//! Where the samples of the rows' spectra lie in the spectrum of the image: on a line through the origin for each view, by the
//! projection-slice theorem.
//!
//! Row k's transform has the period of its samples, 1/pitch. What lies beyond the first half period are copies of the same numbers,
//! *replicas* m = -1, 1, -2, ..., which whatever reads rows between their bins lets through by its own response, the gains here.

use std::f64::consts::TAU;
use std::ops::Range;

use rustfft::num_complex::Complex;

use crate::error::{RadonError, room, within, zeros};
use crate::simd::DIGITS;
use crate::{ImageGrid, ParallelGeometry};

/// The line of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct PolarView {
    /// Index of the view in the geometry.
    pub(super) view: usize,
    /// Way from one frequency to the next, in cells of the image's spectrum of 2^-DIGITS each; across the columns never negative.
    pub(super) step: [i64; 2],
    /// Phase of one frequency: from the row's first bin to the image's reference pixel.
    pub(super) turn: f64,
    /// Whether the line is run through the other way round, with the complex conjugates.
    pub(super) conjugate: bool,
    /// The greatest frequency that is used, in steps.
    pub(super) most: usize,
}

/// All lines, and the two axes of the grid that they are laid out in.
#[derive(Debug)]
pub(super) struct Polar {
    /// By their direction.
    pub(super) views: Vec<PolarView>,
    /// Where each view of the geometry stands among them.
    pub(super) places: Vec<usize>,
    /// Samples after which a row repeats itself.
    pub(super) row_len: usize,
    /// Copies of the half spectrum that are used.
    pub(super) replicas: Vec<i64>,
    /// Cells of the image's spectrum along x and along y.
    pub(super) cells: [usize; 2],
}

/// Part of a view's samples on their way through some columns.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Index of the replica.
    pub(super) replica: usize,
    /// Samples of the half spectrum.
    pub(super) samples: Range<usize>,
    /// Position of the first sample; along x whole turns of the grid have been added.
    pub(super) at: [i64; 2],
    pub(super) step: [i64; 2],
    /// Whether these are the samples' mirror images through the origin, which hold the conjugates.
    pub(super) mirrored: bool,
}

/// Columns, in units of a position's last digit: of the samples themselves and of their mirror images.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) samples: Range<i64>,
    pub(super) mirrored: Range<i64>,
}

impl Polar {
    /// `row_len` samples a row; `most(view's direction)` is the greatest frequency, in units of 1/pitch. A frequency of half a period and
    /// its negative are the same number of a row. `both_ends` counts that number for each of the two, whether or not a frequency beyond
    /// them is used; otherwise the two share it if they are the greatest.
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
            let most = (most(direction) * row_len as f64) as usize;
            let mut step = [0; 2];
            for axis in 0..2 {
                let cells = direction[axis] * grid.spacing()[axis] * cells[axis] as f64 / period;
                // Positions of 2^26 cells leave one digit of 64 for a sign.
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
        // Neighbours in direction meet neighbouring cells.
        let slope = |view: &PolarView| (view.step[1] as f64).atan2(view.step[0] as f64);
        views.sort_by(|a, b| slope(a).total_cmp(&slope(b)).then(a.view.cmp(&b.view)));
        let mut places = zeros("views of a plan", views.len(), 1)?;
        for (place, view) in views.iter().enumerate() {
            places[view.view] = place;
        }
        // Those of which some frequency is within reach.
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

    /// Samples of all views and replicas.
    pub(super) fn n_used(&self) -> usize {
        let replicas = 0..self.replicas.len();
        let of = |view| replicas.clone().map(move |r| self.used(view, r).len());
        self.views.iter().flat_map(of).sum()
    }

    /// The frequency of the first sample of a replica.
    pub(super) fn first(&self, replica: usize) -> i64 {
        self.replicas[replica] * self.row_len as i64
    }

    /// Samples of a view's replica that are used.
    fn used(&self, view: &PolarView, replica: usize) -> Range<usize> {
        let (first, most) = (self.first(replica), view.most as i64);
        let last = (most - first).min(self.row_len as i64 / 2);
        let start = (-most - first).max(0);
        start as usize..(last + 1).max(start) as usize
    }

    /// All that a view has in some columns, in the same order for any columns.
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
                // Odd, so that no position is at the edge of a cell: there a mirror image would have other cells than the mirror's.
                let at = step.map(|s| s * first + sign);
                let ends = [at[0], at[0] + (n - 1) * step[0]];
                let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                // Whole turns after which some position is in the window.
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
    // Side by side, which no product has to wait for another.
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
