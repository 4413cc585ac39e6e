//! Levels of the cavity volume, or of the respiratory fraction, between which views are interpolated.

use crate::model::Height;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// A difference of coordinates that is rounding.
const NOTHING: f64 = 1e-9;
/// Coordinates are rounded to `2^-39`, so that equal levels of different gates are bitwise identical and share a shape: half of one is then on
/// the grid of the phases of a [`Cycle`](crate::Cycle).
const GRID: f64 = (1u64 << 39) as f64;

/// The part of a time in which a height rises, falls or stays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) heights: [f64; 2],
    pub(super) seconds: f64,
}

/// The coordinate of a height from 0 to 1 in which views are interpolated.
#[derive(Debug, Clone, Copy)]
pub(super) enum Scale {
    /// `arccos(1 - 2 h) / pi`, linear in time over half a period of a sinusoid: equally spaced levels are the trapezoidal rule.
    Phase,
    /// The height itself. Levels are spaced half as equally, half as those of a sinusoid: a curve is slowest where it turns round.
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

    /// The coordinate of a level from the fraction of the levels below it.
    fn level(self, [low, high]: [f64; 2], u: f64) -> f64 {
        let along = match self {
            Self::Phase => u,
            Self::Height => 0.5 * (u + (FRAC_PI_2 * u).sin().powi(2)),
        };
        ((low + (high - low) * along) * GRID).round() / GRID
    }
}

/// Heights that represent all others.
#[derive(Debug, Clone)]
pub(super) struct Levels {
    pub(super) scale: Scale,
    /// Coordinates of the levels with hat functions, ascending, an odd number; none if the height stays.
    graded: Vec<f64>,
    /// Heights at which a curve stays for long: that time is theirs alone. Ascending.
    still: Vec<f64>,
}

impl Levels {
    /// The levels of some stretches, for as many steps per cycle: half of them from 0 to 1.
    pub(super) fn new(stretches: &[Stretch], points: usize, scale: Scale) -> Self {
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for height in stretches.iter().flat_map(|stretch| stretch.heights) {
            (low, high) = (low.min(height), high.max(height));
        }
        let mut levels = Self {
            scale,
            graded: Vec::new(),
            still: vec![low],
        };
        if high - low > NOTHING {
            let ends = [low, high].map(|height| scale.coordinate(height));
            let pairs = 0.25 * points as f64 * (ends[1] - ends[0]);
            let cells = 2 * (pairs - NOTHING).ceil().max(1.0) as usize;
            let level = |k: usize| scale.level(ends, k as f64 / cells as f64);
            levels.graded = (0..=cells).map(level).collect();
            levels.still = levels.long_stays(stretches);
        }
        levels
    }

    /// Heights at which a curve stays for at least half the mean time of a cell, and which are no levels.
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

    /// Number of levels.
    pub(super) fn len(&self) -> usize {
        self.graded.len() + self.still.len()
    }

    /// The height of a level.
    pub(super) fn height(&self, k: usize) -> f64 {
        match (self.graded.get(k), self.scale) {
            (None, _) => self.still[k - self.graded.len()],
            (Some(phase), Scale::Phase) => Height::Sinusoid.at(0.5 * phase),
            (Some(height), Scale::Height) => *height,
        }
    }

    /// The level whose own a stretch from one height to another is, if it has one.
    pub(super) fn of_stay(&self, [from, to]: [f64; 2]) -> Option<usize> {
        if self.graded.is_empty() {
            return Some(0);
        }
        let of = |still: &f64| from == to && *still == from;
        let own = self.still.iter().position(of)?;
        Some(self.graded.len() + own)
    }

    /// The coordinates of the levels that are crossed between two heights.
    pub(super) fn between(&self, heights: [f64; 2]) -> &[f64] {
        let [from, to] = heights.map(|height| self.scale.coordinate(height));
        let first = (self.graded).partition_point(|level| *level <= from.min(to));
        let last = (self.graded).partition_point(|level| *level < from.max(to));
        &self.graded[first..last.max(first)]
    }

    /// The lower of the two levels around a height.
    pub(super) fn cell(&self, height: f64) -> usize {
        let own = self.scale.coordinate(height);
        let above = self.graded.partition_point(|level| *level <= own);
        above.clamp(1, self.graded.len() - 1) - 1
    }

    /// The hat functions, at a height, of the level of a cell and of the one above it.
    pub(super) fn hats(&self, cell: usize, height: f64) -> [(usize, f64); 2] {
        let [low, high] = [self.graded[cell], self.graded[cell + 1]];
        let up = (self.scale.coordinate(height) - low) / (high - low);
        [(cell, 1.0 - up), (cell + 1, up)]
    }

    /// Every second level, which the coarse rule leaves out, with the fraction of its time that the level above it takes over.
    pub(super) fn left_out(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.graded.windows(3).enumerate().step_by(2))
            .map(|(k, three)| (k + 1, (three[1] - three[0]) / (three[2] - three[0])))
    }
}
