//! Means over time as means over volumes: how long a beat stays near each of some heights of its curve.
//!
//! What a camera that stands still sees of a heart depends on its volume alone, so that the mean over a time is one over the
//! volumes that it holds, each as long as it lasts. Between neighbouring levels `l_i` of the height `h` it is taken as linear:
//!
//! ```text
//! mean = sum_i w_i F(l_i),    w_i = integral of hat_i(h(t)) dt / integral of dt
//! ```
//!
//! `hat_i` is 1 at its own level and 0 at its neighbours. The weights are those of the curve itself, to rounding, however often or
//! briefly it goes up and down: all that is left to err is the interpolation, which knows nothing of the curve.

use super::view_time::TimeSeen;
use crate::model::Height;
use std::f64::consts::FRAC_PI_2;

/// A span of heights, or a time as a share of what is seen, that is rounding.
const NOTHING: f64 = 1e-9;
/// Points and weights of Gauss and Legendre on [-1, 1]: exact to degree 5, where a cubic of time, times time, has 4.
pub(super) const GAUSS: [[f64; 2]; 3] = [
    [-0.774_596_669_241_483_4, 5.0 / 9.0],
    [0.0, 8.0 / 9.0],
    [0.774_596_669_241_483_4, 5.0 / 9.0],
];

/// Heights of a curve that stand for all others.
#[derive(Debug, Clone)]
pub(crate) struct Levels<'a> {
    height: &'a Height,
    gate: [f64; 2],
    /// Ascending; every second one, from the first to the last, is a level of the coarse rule, too.
    levels: Vec<f64>,
    /// Heights at which the curve stands still for long: that time is theirs alone. Ascending.
    still: Vec<f64>,
    /// Time and first moment of each in one whole beat.
    beat: Vec<[f64; 2]>,
}

impl<'a> Levels<'a> {
    /// For what is seen, with as many levels as a beat of `points` steps has on its way up or down.
    pub(crate) fn new(height: &'a Height, seen: &TimeSeen, points: usize) -> Self {
        let whole = seen.beats >= 1.0;
        let ends = if whole { [0.0, 1.0] } else { seen.ends };
        let mut made = Self {
            height,
            gate: seen.gate,
            levels: Vec::new(),
            still: Vec::new(),
            beat: Vec::new(),
        };
        let mut stretches = Vec::new();
        let mut beat = ends[0].floor();
        while beat < ends[1] {
            stretches.extend(made.stretches(beat, ends));
            beat += 1.0;
        }
        let heights = |[a, b]: [f64; 2]| [height.at(a), height.at(b)];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for h in stretches.iter().copied().flat_map(heights) {
            (low, high) = (low.min(h), high.max(h));
        }
        made.levels = levels_between([low, high], points);
        if made.levels.len() > 1 {
            let cells = (made.levels.len() - 1) as f64;
            made.still = long_stays(&stretches, heights, cells);
        }
        if whole {
            made.beat = vec![[0.0; 2]; made.len()];
            let mut sums = std::mem::take(&mut made.beat);
            made.add(0.0, ends, &mut sums);
            made.beat = sums;
        }
        made
    }

    /// Number of levels.
    pub(crate) fn len(&self) -> usize {
        self.levels.len() + self.still.len()
    }

    /// The height of a level.
    pub(crate) fn height(&self, k: usize) -> f64 {
        (self.levels.get(k)).map_or_else(|| self.still[k - self.levels.len()], |height| *height)
    }

    /// How many beats of a time belong to each level, and their first moment about beat 0.
    pub(crate) fn times(&self, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
        let mut sums = vec![[0.0; 2]; self.len()];
        let (first, last) = (from.floor(), to.floor());
        self.add(first, [from, to], &mut sums);
        if last > first {
            let whole = last - first - 1.0;
            if whole > 0.0 {
                for (sum, [time, moment]) in sums.iter_mut().zip(&self.beat) {
                    sum[0] += whole * time;
                    sum[1] += whole * (moment + 0.5 * (first + last) * time);
                }
            }
            self.add(last, [from, to], &mut sums);
        }
        sums
    }

    /// The same for the coarse rule, which has every second level, from that of the fine one: a hat of its is linear between any two
    /// levels, so that each gives its time to its neighbours.
    pub(crate) fn coarse(&self, times: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut coarse = times.to_vec();
        for k in (1..self.levels.len()).step_by(2) {
            let [low, here, high] = [k - 1, k, k + 1].map(|k| self.levels[k]);
            let up = (here - low) / (high - low);
            coarse[k] = [0.0; 2];
            for a in 0..2 {
                coarse[k - 1][a] += (1.0 - up) * times[k][a];
                coarse[k + 1][a] += up * times[k][a];
            }
        }
        coarse
    }

    /// What of one beat is between two times and in the gate, in phases, cut at the knots.
    fn stretches(&self, beat: f64, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
        let from = (from - beat).max(self.gate[0]);
        let to = (to - beat).min(self.gate[1]);
        if to <= from {
            return Vec::new();
        }
        let mut cuts = vec![from];
        cuts.extend(self.height.knots_between(from, to));
        cuts.push(to);
        cuts.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// Adds what of one beat is between two times.
    fn add(&self, beat: f64, ends: [f64; 2], sums: &mut [[f64; 2]]) {
        for [a, b] in self.stretches(beat, ends) {
            let [from, to] = [a, b].map(|phase| self.height.at(phase));
            let time = b - a;
            let mut alone = |k: usize| {
                sums[k][0] += time;
                sums[k][1] += time * (beat + 0.5 * (a + b));
            };
            if self.levels.len() == 1 {
                alone(0);
            } else if let Some(k) = (from == to).then(|| self.stays(from)).flatten() {
                alone(self.levels.len() + k);
            } else {
                let mut start = a;
                for level in self.between(from, to) {
                    let end = self.crossing([start, b], level, from < to);
                    self.share(beat, [start, end], sums);
                    start = end;
                }
                self.share(beat, [start, b], sums);
            }
        }
    }

    /// Which of the long stays a height is.
    fn stays(&self, height: f64) -> Option<usize> {
        (self.still)
            .binary_search_by(|still| still.total_cmp(&height))
            .ok()
    }

    /// The levels that a curve crosses on its way from one height to another.
    fn between(&self, from: f64, to: f64) -> Vec<f64> {
        let first = self.levels.partition_point(|level| *level <= from.min(to));
        let last = self.levels.partition_point(|level| *level < from.max(to));
        let mut crossed = self.levels[first..last.max(first)].to_vec();
        if from > to {
            crossed.reverse();
        }
        crossed
    }

    /// When a stretch on which the height rises or falls is at a level. What is wrong with it in the last digits is of second
    /// order: both hats meet there.
    fn crossing(&self, [mut a, mut b]: [f64; 2], level: f64, rising: bool) -> f64 {
        for _ in 0..40 {
            let middle = 0.5 * (a + b);
            if (self.height.at(middle) < level) == rising {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    }

    /// Shares a stretch within one cell out to the two levels of that.
    fn share(&self, beat: f64, [a, b]: [f64; 2], sums: &mut [[f64; 2]]) {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let above = self
            .levels
            .partition_point(|l| *l <= self.height.at(middle));
        let above = above.clamp(1, self.levels.len() - 1);
        let [low, high] = [self.levels[above - 1], self.levels[above]];
        for [x, weight] in GAUSS {
            let phase = middle + half * x;
            let up = (self.height.at(phase) - low) / (high - low);
            for (k, hat) in [(above - 1, 1.0 - up), (above, up)] {
                sums[k][0] += half * weight * hat;
                sums[k][1] += half * weight * hat * (beat + phase);
            }
        }
    }
}

/// Levels from the lowest to the highest height, an even number of steps with as many as a beat of `points` steps has on its way up or
/// down; one alone where nothing is between.
pub(super) fn levels_between([low, high]: [f64; 2], points: usize) -> Vec<f64> {
    if high - low <= NOTHING {
        return vec![low];
    }
    let cells = 2.0
        * (0.25 * points as f64 * (high - low) - NOTHING)
            .ceil()
            .max(1.0);
    // Half as equal steps of volume, half as those of a sinusoid: a beat is longest where it turns round.
    let at = |u: f64| low + (high - low) * 0.5 * (u + (FRAC_PI_2 * u).sin().powi(2));
    (0..=cells as usize).map(|j| at(j as f64 / cells)).collect()
}

/// Heights at which the curve stays for at least a share `1 / (2 cells)` of all the time.
fn long_stays(
    stretches: &[[f64; 2]],
    heights: impl Fn([f64; 2]) -> [f64; 2],
    cells: f64,
) -> Vec<f64> {
    let mut stays: Vec<[f64; 2]> = (stretches.iter())
        .filter_map(|&[a, b]| {
            let [from, to] = heights([a, b]);
            (from == to).then_some([from, b - a])
        })
        .collect();
    stays.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let all: f64 = stretches.iter().map(|[a, b]| b - a).sum();
    (stays.chunk_by(|a, b| a[0] == b[0]))
        .filter(|same| same.iter().map(|stay| stay[1]).sum::<f64>() >= all / (2.0 * cells))
        .map(|same| same[0][0])
        .collect()
}
