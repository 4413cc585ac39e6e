//! Levels of the cavity volume, or of the respiratory fraction, between which views are interpolated.

use crate::model::Height;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// Coordinates that differ by less are equal.
const NOTHING: f64 = 1e-9;
/// Coordinates are rounded to `2^-39`, so that equal levels of different gates are bitwise identical and share a shape: half a coordinate
/// is on the grid of phases of a [`Cycle`](crate::Cycle).
const GRID: f64 = (1u64 << 39) as f64;

/// An interval of time in which a height rises, falls or is constant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) heights: [f64; 2],
    pub(super) seconds: f64,
}

/// The interpolation of views between levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// Piecewise linear, for samples that depend on volume like the root of a distance where rays touch a surface.
    Linear,
    /// The polynomial through all levels, for samples that a response makes smooth.
    Polynomial,
}

/// The coordinate of a height from 0 to 1 in which views are interpolated.
#[derive(Debug, Clone, Copy)]
pub(super) enum Scale {
    /// `arccos(1 - 2 h) / pi`, linear in time over half a period of a sinusoid: equally spaced levels are the trapezoidal rule.
    Phase,
    /// The height itself. The spacing of levels is the mean of an equal and a sinusoidal spacing, because curves are slow at their extrema.
    Height,
}

impl Scale {
    pub(super) fn of(curve: &Height) -> Self {
        match curve {
            Height::Sinusoid => Self::Phase,
            Height::Power(_) | Height::Monotone(_) => Self::Height,
        }
    }

    /// The coordinate of a height, accurate at both ends.
    pub(super) fn coordinate(self, height: f64) -> f64 {
        let lower = |height: f64| FRAC_2_PI * height.max(0.0).sqrt().asin();
        match self {
            Self::Phase if height < 0.5 => lower(height),
            Self::Phase => 1.0 - lower(1.0 - height),
            Self::Height => height,
        }
    }

    /// The coordinate of a level from the fraction of the levels below it; Chebyshev points for a polynomial.
    fn level(self, [low, high]: [f64; 2], u: f64, interpolation: Interpolation) -> f64 {
        let chebyshev = (FRAC_PI_2 * u).sin().powi(2);
        let along = match (self, interpolation) {
            (Self::Phase, Interpolation::Linear) => u,
            (Self::Height, Interpolation::Linear) => 0.5 * (u + chebyshev),
            (_, Interpolation::Polynomial) => chebyshev,
        };
        ((low + (high - low) * along) * GRID).round() / GRID
    }
}

/// Heights between which all others are interpolated.
#[derive(Debug, Clone)]
pub(super) struct Levels {
    pub(super) scale: Scale,
    interpolation: Interpolation,
    /// Coordinates of the levels that are interpolated, ascending, an odd number; none if the height is constant.
    graded: Vec<f64>,
    /// Heights at which a curve is constant for long, ascending; this time belongs to no other level.
    still: Vec<f64>,
}

impl Levels {
    /// The only level of a constant height.
    pub(super) fn constant(height: f64) -> Self {
        Self {
            scale: Scale::Height,
            interpolation: Interpolation::Linear,
            graded: Vec::new(),
            still: vec![height],
        }
    }

    /// The levels of some stretches, for as many steps per cycle: half of them from 0 to 1.
    pub(super) fn new(
        stretches: &[Stretch],
        (points, interpolation): (usize, Interpolation),
        scale: Scale,
    ) -> Self {
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for height in stretches.iter().flat_map(|stretch| stretch.heights) {
            (low, high) = (low.min(height), high.max(height));
        }
        let mut levels = Self {
            scale,
            interpolation,
            graded: Vec::new(),
            still: vec![low],
        };
        if high - low > NOTHING {
            let ends = [low, high].map(|height| scale.coordinate(height));
            let pairs = 0.25 * points as f64 * (ends[1] - ends[0]);
            let cells = 2 * (pairs - NOTHING).ceil().max(1.0) as usize;
            let level = |k: usize| scale.level(ends, k as f64 / cells as f64, interpolation);
            levels.graded = (0..=cells).map(level).collect();
            levels.still = match interpolation {
                Interpolation::Linear => levels.long_stays(stretches),
                Interpolation::Polynomial => Vec::new(),
            };
        }
        levels
    }

    /// Returns the heights, other than levels, at which a curve is constant for at least half the average time of a cell.
    fn long_stays(&self, stretches: &[Stretch]) -> Vec<f64> {
        let all: f64 = stretches.iter().map(|stretch| stretch.seconds).sum();
        let long = 0.5 * all / (self.graded.len() - 1) as f64;
        let mut stays: Vec<[f64; 2]> = (stretches.iter())
            .filter(|stretch| stretch.heights[0] == stretch.heights[1])
            .map(|stretch| [stretch.heights[0], stretch.seconds])
            .collect();
        stays.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let is_level = |height: f64| {
            let own = self.scale.coordinate(height);
            (self.graded.iter()).any(|level| (level - own).abs() <= NOTHING)
        };
        (stays.chunk_by(|a, b| a[0] == b[0]))
            .filter(|same| same.iter().map(|stay| stay[1]).sum::<f64>() >= long)
            .map(|same| same[0][0])
            .filter(|height| !is_level(*height))
            .collect()
    }

    /// Returns the number of levels.
    pub(super) fn len(&self) -> usize {
        self.graded.len() + self.still.len()
    }

    /// Returns the number of intervals between neighbouring levels.
    pub(super) fn n_cells(&self) -> usize {
        self.graded.len().saturating_sub(1)
    }

    /// Returns the height of a level.
    pub(super) fn height(&self, k: usize) -> f64 {
        match (self.graded.get(k), self.scale) {
            (None, _) => self.still[k - self.graded.len()],
            (Some(phase), Scale::Phase) => Height::Sinusoid.at(0.5 * phase),
            (Some(height), Scale::Height) => *height,
        }
    }

    /// Returns the level that represents only this constant stretch, if any.
    pub(super) fn of_stay(&self, [from, to]: [f64; 2]) -> Option<usize> {
        if self.graded.is_empty() {
            return Some(0);
        }
        let of = |still: &f64| from == to && *still == from;
        let own = self.still.iter().position(of)?;
        Some(self.graded.len() + own)
    }

    /// Returns the coordinates of the levels between two heights.
    pub(super) fn between(&self, heights: [f64; 2]) -> &[f64] {
        let [from, to] = heights.map(|height| self.scale.coordinate(height));
        let first = (self.graded).partition_point(|level| *level <= from.min(to));
        let last = (self.graded).partition_point(|level| *level < from.max(to));
        &self.graded[first..last.max(first)]
    }

    /// Returns the lower of the two levels around a height.
    pub(super) fn cell(&self, height: f64) -> usize {
        let own = self.scale.coordinate(height);
        let above = self.graded.partition_point(|level| *level <= own);
        above.clamp(1, self.graded.len() - 1) - 1
    }

    /// The levels that interpolate at a height in a cell, with their weights, which sum to 1.
    pub(super) fn weights(&self, cell: usize, height: f64) -> Vec<(usize, f64)> {
        self.interpolated(cell, self.scale.coordinate(height), 1)
    }

    /// Every second level, which the coarse rule leaves out, with the levels of that rule and their weights at its coordinate.
    pub(super) fn left_out(&self) -> impl Iterator<Item = (usize, Vec<(usize, f64)>)> {
        (1..self.graded.len())
            .step_by(2)
            .map(|k| (k, self.interpolated(k / 2, self.graded[k], 2)))
    }

    /// Interpolation at a coordinate in a cell, between every `stride`-th level.
    fn interpolated(&self, cell: usize, at: f64, stride: usize) -> Vec<(usize, f64)> {
        let last = (self.graded.len() - 1) / stride;
        let distance = |k: usize| at - self.graded[k * stride];
        match self.interpolation {
            Interpolation::Linear => {
                let [below, above] = [distance(cell), distance(cell + 1)];
                let share = below / (below - above);
                vec![(cell * stride, 1.0 - share), ((cell + 1) * stride, share)]
            }
            Interpolation::Polynomial => {
                if let Some(own) = (0..=last).find(|k| distance(*k) == 0.0) {
                    return vec![(own * stride, 1.0)];
                }
                // The barycentric formula for Chebyshev points (Berrut and Trefethen, SIAM Rev. 46 (2004) 501, Eq. 5.4).
                let part = |k: usize| {
                    let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
                    let half = if k == 0 || k == last { 0.5 } else { 1.0 };
                    sign * half / distance(k)
                };
                let sum: f64 = (0..=last).map(part).sum();
                (0..=last).map(|k| (k * stride, part(k) / sum)).collect()
            }
        }
    }
}
