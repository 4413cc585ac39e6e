//! The quadrature over time: time averages as averages over volumes and respiratory fractions.
//!
//! A view depends on time through the height h of the volume curve, the respiratory fraction r and, in continuous rotation, the angle. Between
//! [`Levels`] `l_i` of h and `m_j` of r the view is interpolated in their coordinates ([`Scale`]), by products of piecewise linear functions or
//! Lagrange polynomials `L_i`:
//!
//! ```text
//! average = sum_ij w_ij F(l_i, m_j),    w_ij = integral of L_i(h(t)) L_j(r(t)) dt / integral of dt
//! ```
//!
//! over the time of the view, from one crossing of a level to the next. Only the interpolation has an error, however short or frequent
//! the features of a curve are.
//!
//! Rays that touch the surface have a square root of time, so that the linear rule is of order 3/2: the error falls by 2.8 when the points
//! double. In continuous rotation it divides the time into arcs, in each of which a pair of levels is projected from its mean angle.
//!
//! Behind a response, and if the camera rotates little during a view, samples are analytic functions of volume, respiratory fraction and
//! angle: the polynomial through Chebyshev points converges exponentially. The elapsed fraction of the view is a third coordinate. All gates
//! have the levels of the whole cycle and the angles of the whole view, so that each combination is projected once.
//!
//! The rule with half the points has every second level along each axis, and one arc for each pair of arcs; the difference of the two rules
//! gives the error estimate.

use super::acquisition::Acquisition;
use super::levels::{Interpolation, Levels, Scale, Stretch};
use super::nodes::{Nodes, Sphere, radius};
use super::settings::{Mode, Rotation};
use super::spans::{self, Span};
use crate::model::wrap;
use crate::{Camera, Cycle};
use std::collections::BTreeMap;

/// Smallest number of arcs of any part of a view: a base parallel to the rays appears only briefly.
const FEWEST_ARCS: f64 = 8.0;
/// Shorter parts, as a fraction of the view, have fewer than [`FEWEST_ARCS`], because the camera hardly rotates.
const SHORTEST_PART: f64 = 1e-3;
/// Smaller fractions of a view are rounding.
const NO_TIME: f64 = 1e-18;
/// Most repetitions of a beat over which the weights of angles are averaged; more are represented by as many evenly spaced ones.
const MOST_REPEATS: f64 = 256.0;
/// Weights of one half, relative to the other, below this are rounding.
const NO_WEIGHT: f64 = 1e-12;
/// Parts of a span between knots for exact averages of chords.
const PARTS: usize = 16;
/// Points and weights of Gauss and Legendre on [-1, 1].
const GAUSS: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 128.0 / 225.0],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

/// The quadrature of the views of a gated projection set.
pub(crate) struct TimeRule<'a> {
    acquisition: Acquisition,
    cycle: &'a Cycle,
    camera: &'a Camera,
    /// The rotation of the camera, or step and shoot if its angles do not matter.
    rotation: Rotation,
    /// Levels of volume and respiratory position common to all views, if each view covers the whole cycle.
    shared: [Option<Levels>; 2],
    /// Largest respiratory displacement of the heart, relative to the radius of a sphere with the volume of the cavity.
    shift: f64,
    /// Elapsed fractions of a view at whose angles it is projected; 0 alone for a stationary camera and for arcs.
    shares: Levels,
}

impl<'a> TimeRule<'a> {
    pub(crate) fn new(
        acquisition: Acquisition,
        cycle: &'a Cycle,
        camera: &'a Camera,
        rotation: Rotation,
        shift: f64,
    ) -> Self {
        let lasts = acquisition.lasts(camera);
        let beat = (cycle.rhythm()).map_or(cycle.period(), |rhythm| rhythm.longest());
        let breath = cycle.breathing().map(|motion| motion.breathing().period);
        let mut rule = Self {
            acquisition,
            cycle,
            camera,
            rotation,
            shared: [None, None],
            shift,
            shares: Levels::constant(0.0),
        };
        if rotation == Rotation::Continuous && !rule.has_arcs() {
            let turn = Stretch {
                heights: [0.0, lasts / camera.interval()],
                seconds: lasts,
            };
            let degree = (acquisition.points[0], acquisition.interpolation);
            rule.shares = Levels::new(&[turn], degree, Scale::Height);
        }
        let alike = acquisition.same_for_all_views(cycle, camera);
        let mut covers = [Some(beat), breath].map(|of| !alike && of.is_some_and(|of| lasts >= of));
        let mut shared = acquisition;
        if let (Interpolation::Polynomial, Mode::Gated { .. }) =
            (acquisition.interpolation, acquisition.mode)
        {
            shared.mode = Mode::WholeCycle;
            covers[0] |= alike;
        }
        if covers != [false; 2] {
            // All beats of a regular cycle are equal.
            let n_views = match acquisition.in_real_time(cycle) {
                true => camera.n_views(),
                false => 1,
            };
            let spans: Vec<Span> = (0..n_views)
                .map(|view_idx| shared.window(cycle, camera, view_idx))
                .flat_map(|window| spans::between(shared, cycle, window))
                .collect();
            rule.shared = [0, 1].map(|axis| covers[axis].then(|| rule.levels(&spans, axis)));
        }
        rule
    }

    /// Whether the camera rotates during a view, which is divided into arcs.
    fn has_arcs(&self) -> bool {
        self.rotation == Rotation::Continuous
            && self.acquisition.interpolation == Interpolation::Linear
    }

    /// Returns the height of the volume (axis 0), the respiratory fraction (axis 1) or the fraction of the view after its `start` (axis 2) at a time of
    /// a span.
    fn height(&self, axis: usize, (span, start): (&Span, f64), t: f64) -> f64 {
        match (axis, self.cycle.breathing()) {
            (0, _) => self.cycle.height().at(span.phase_at(t)),
            (1, Some(breathing)) => breathing.at_phase(span.breath_at(t)),
            (1, None) => 0.0,
            (_, _) => (t - start) / self.camera.interval(),
        }
    }

    fn levels(&self, spans: &[Span], axis: usize) -> Levels {
        let stretch = |span: &Span| Stretch {
            heights: span.time.map(|t| self.height(axis, (span, 0.0), t)),
            seconds: span.copies * span.seconds(),
        };
        let stretches: Vec<Stretch> = spans.iter().map(stretch).collect();
        let Acquisition {
            points,
            interpolation,
            ..
        } = self.acquisition;
        let scale = match (axis, self.cycle.breathing(), interpolation) {
            (0, _, Interpolation::Linear) => Scale::of(self.cycle.height()),
            (_, Some(breathing), Interpolation::Linear) => Scale::of(breathing.curve()),
            (_, _, Interpolation::Polynomial) | (_, None, _) => Scale::Height,
        };
        Levels::new(&stretches, (points[axis], interpolation), scale)
    }

    /// Returns the spans of a view, its start and its acquisition time in seconds.
    fn spans(&self, view_idx: usize) -> (Vec<Span>, [f64; 2]) {
        let [start, end] = self.acquisition.window(self.cycle, self.camera, view_idx);
        let spans = spans::between(self.acquisition, self.cycle, [start, end]);
        let [seconds, _] = spans::seen(&spans, start);
        (spans, [start, seconds])
    }

    /// Returns the levels of an axis for the spans of a view.
    fn levels_of(&self, spans: &[Span], axis: usize) -> Levels {
        let shared = self.shared[axis].as_ref();
        shared.map_or_else(|| self.levels(spans, axis), Levels::clone)
    }

    /// Returns the points of a view.
    pub(crate) fn view(&self, view_idx: usize) -> Nodes {
        let (spans, [start, seconds]) = self.spans(view_idx);
        if seconds == 0.0 {
            return self.moment(self.camera.view_start(view_idx));
        }
        let [volumes, breaths] = [0, 1].map(|axis| self.levels_of(&spans, axis));
        let levels = [volumes, breaths, self.shares.clone()];
        let [mean, _] = self.means_of(&spans, seconds);
        let fine: Vec<Cells> = (self.in_arcs(spans, seconds).iter())
            .map(|spans| self.cells(spans, start, &levels))
            .collect();
        let coarse: Vec<Cells> = (fine.chunks(2))
            .map(|pair| {
                let mut sum = pair[0].clone();
                pair[1..].iter().for_each(|other| sum.add(other));
                sum.coarsened(&levels)
            })
            .collect();
        let interval = self.camera.interval();
        let mut made = Nodes::default();
        let mut volume = 0.0;
        let mut add = |arcs: &[Cells], halves: [f64; 2]| {
            for (k, [time, moment]) in arcs.iter().flat_map(|cells| cells.0.iter().enumerate()) {
                if time.abs() <= NO_TIME * seconds {
                    continue;
                }
                let [volume_at, breath, share] =
                    [0, 1, 2].map(|axis| levels[axis].height(index_of(k, axis, &levels)));
                let gain = self.cycle.gain_at_height(volume_at);
                let share = match self.has_arcs() {
                    true => (moment / time - start) / interval,
                    false => share,
                };
                let weight = time / seconds;
                volume += (halves[0] + halves[1]) * weight * (1.0 + gain);
                let at = [gain, breath];
                made.add(at, share, halves.map(|half| half * weight));
            }
        };
        // The first half contains half of the coarse rule, which is subtracted from the second half.
        add(&fine, [0.0, 1.0]);
        add(&coarse, [0.5, -0.5]);
        made.volume_error = (volume / (1.0 + mean) - 1.0).abs();
        made.tidy(NO_WEIGHT);
        made
    }

    /// Returns volume gain and respiratory fraction averaged over the time of a view, independent of levels.
    pub(crate) fn means(&self, view_idx: usize) -> [f64; 2] {
        let (spans, [_, seconds]) = self.spans(view_idx);
        if seconds == 0.0 {
            let node = &self.moment(self.camera.view_start(view_idx)).nodes[0];
            return [node.gain, node.breath];
        }
        self.means_of(&spans, seconds)
    }

    /// The same for its spans and their duration. Knots divide a period of a sinusoid or of a power of it into 16 spans, so that five points suffice.
    fn means_of(&self, spans: &[Span], seconds: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for span in spans {
            let (middle, half) = (0.5 * (span.time[0] + span.time[1]), 0.5 * span.seconds());
            for [x, weight] in GAUSS {
                for (axis, sum) in sums.iter_mut().enumerate() {
                    let value = self.height(axis, (span, 0.0), middle + half * x);
                    *sum += span.copies * half * weight * value;
                }
            }
        }
        let [height, breath] = sums.map(|sum| sum / seconds);
        [self.cycle.gain_at_height(height), breath]
    }

    /// Returns the error of a view for rays through a sphere ([`Nodes::sphere_error`]), whose exact averages are over Gauss points in parts of the
    /// spans, independent of levels; 0 for the polynomial rule and for a single point.
    pub(crate) fn sphere_error(&self, view_idx: usize, made: &Nodes) -> f64 {
        if self.acquisition.interpolation == Interpolation::Polynomial || made.nodes.len() < 2 {
            return 0.0;
        }
        let (spans, [_, seconds]) = self.spans(view_idx);
        let range = [f64::min, f64::max].map(|of| made.gains().reduce(of).map_or(1.0, radius));
        let mut sphere = Sphere::new(range, self.shift);
        for span in &spans {
            let half = 0.5 * span.seconds() / PARTS as f64;
            for part in 0..PARTS {
                let middle = span.time[0] + (2 * part + 1) as f64 * half;
                for [x, weight] in GAUSS {
                    let [volume, breath] =
                        [0, 1].map(|axis| self.height(axis, (span, 0.0), middle + half * x));
                    sphere.add(
                        span.copies * half * weight / seconds,
                        radius(self.cycle.gain_at_height(volume)),
                        breath,
                    );
                }
            }
        }
        made.sphere_error(&sphere)
    }

    /// Returns the point of an instantaneous view.
    fn moment(&self, t: f64) -> Nodes {
        let phase = self.acquisition.mode.static_phase();
        let phase = phase.map_or_else(|| self.cycle.phase(t), wrap);
        let at = [self.cycle.gain(phase), self.cycle.breath(t)];
        let mut made = Nodes::default();
        made.add(at, 0.0, [1.0, 0.0]);
        made
    }

    /// Divides the spans into arcs of equal time, if the rule has arcs.
    fn in_arcs(&self, spans: Vec<Span>, seconds: f64) -> Vec<Vec<Span>> {
        let (true, Some(first), Some(last)) = (self.has_arcs(), spans.first(), spans.last()) else {
            return vec![spans];
        };
        let (from, to) = (first.time[0], last.time[1] + 2.0 * last.delay);
        let parts = (to - from) / seconds.max(SHORTEST_PART * (to - from));
        let of_part = self.acquisition.arcs() * (to - from) / self.camera.interval();
        let n = 2.0 * (0.5 * of_part.max(FEWEST_ARCS * parts) - 1e-9).ceil();
        let end = |k: f64| from + (to - from) * k / n;
        (0..n as usize)
            .map(|k| [end(k as f64), end(k as f64 + 1.0)])
            .map(|arc| spans::between(self.acquisition, self.cycle, arc))
            .collect()
    }

    /// Returns the times in a span at which levels of an axis are crossed.
    fn crossings(
        &self,
        axis: usize,
        (span, start): (&Span, f64),
        levels: &Levels,
    ) -> impl Iterator<Item = f64> {
        let height = move |t: f64| self.height(axis, (span, start), t);
        let at = move |t: f64| levels.scale.coordinate(height(t));
        let crossed = levels.between(span.time.map(height)).iter();
        crossed.map(move |level| spans::root(span.time, at, *level))
    }

    /// Returns the largest error of linear interpolation along an axis (0 volume, 1 respiration), averaged over the time of some views, of a function
    /// with a kink: an eighth of the width of a cell times the fraction of time in it. The function has the slope 1 in the displacement of a
    /// surface: the cube root of the volume, or the respiratory position, relative to its range in the cycle.
    pub(crate) fn gap(&self, axis: usize, views: &[usize]) -> f64 {
        let (mut sums, mut sum) = (Vec::new(), 0.0);
        for view_idx in views {
            let gaps = self.gaps(axis, *view_idx);
            match &self.shared[axis] {
                Some(levels) => {
                    sums.resize(levels.n_cells(), 0.0);
                    (sums.iter_mut().zip(gaps)).for_each(|(sum, gap)| *sum += gap);
                }
                None => sum += gaps.into_iter().fold(0.0, f64::max),
            }
        }
        sums.into_iter().fold(sum, f64::max) / views.len() as f64
    }

    /// Returns these errors in each cell of a view.
    fn gaps(&self, axis: usize, view_idx: usize) -> Vec<f64> {
        let (spans, [_, seconds]) = self.spans(view_idx);
        if seconds == 0.0 {
            return Vec::new();
        }
        let levels = self.levels_of(&spans, axis);
        let way = |height: f64| match axis {
            0 => (1.0 + self.cycle.gain_at_height(height)).cbrt(),
            _ => height,
        };
        let per_second = 0.125 / (seconds * (way(1.0) - way(0.0)));
        let width = |k: usize| way(levels.height(k + 1)) - way(levels.height(k));
        let mut gaps = vec![0.0; levels.n_cells()];
        for span in &spans {
            let height = |t: f64| self.height(axis, (span, 0.0), t);
            if levels.of_stay(span.time.map(height)).is_some() {
                continue;
            }
            let mut cuts = span.time.to_vec();
            cuts.extend(self.crossings(axis, (span, 0.0), &levels));
            cuts.sort_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let cell = levels.cell(height(0.5 * (pair[0] + pair[1])));
                gaps[cell] += per_second * span.copies * (pair[1] - pair[0]) * width(cell);
            }
        }
        gaps
    }

    /// Returns the time of the spans of a view near each combination of levels.
    fn cells(&self, spans: &[Span], start: f64, levels: &[Levels; 3]) -> Cells {
        let n = levels.iter().map(Levels::len).product();
        let mut cells = Cells(vec![[0.0; 2]; n]);
        for span in spans {
            let height = |axis: usize, t: f64| self.height(axis, (span, start), t);
            let heights = [0, 1, 2].map(|axis| span.time.map(|t| height(axis, t)));
            let stays = [0, 1, 2].map(|axis| levels[axis].of_stay(heights[axis]));
            let mut cuts = span.time.to_vec();
            for axis in (0..3).filter(|axis| stays[*axis].is_none()) {
                cuts.extend(self.crossings(axis, (span, start), &levels[axis]));
            }
            cuts.sort_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
                if half <= 0.0 {
                    continue;
                }
                let in_cell = [0, 1, 2].map(|axis| match stays[axis] {
                    Some(_) => 0,
                    None => levels[axis].cell(height(axis, middle)),
                });
                for [x, weight] in GAUSS {
                    let t = middle + half * x;
                    let seconds = span.copies * half * weight;
                    let weights = [0, 1, 2].map(|axis| match (stays[axis], axis) {
                        (Some(k), _) => vec![(k, 1.0)],
                        (None, 2) => repeated(span, |delay| {
                            levels[2].weights(in_cell[2], height(2, t + delay))
                        }),
                        (None, _) => levels[axis].weights(in_cell[axis], height(axis, t)),
                    });
                    let at = [seconds, t + span.delay];
                    cells.add_product(&weights, at, [levels[0].len(), levels[1].len()]);
                }
            }
        }
        cells
    }
}

/// Returns the average of weights over the repetitions of a span, as a function of their delay.
fn repeated(span: &Span, weights: impl Fn(f64) -> Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    if span.copies <= 1.0 {
        return weights(0.0);
    }
    let (n, beat) = (
        span.copies.min(MOST_REPEATS),
        2.0 * span.delay / (span.copies - 1.0),
    );
    let mut sums = BTreeMap::new();
    for k in 0..n as usize {
        let repeat = (k as f64 + 0.5) * span.copies / n - 0.5;
        for (level, weight) in weights(repeat * beat) {
            *sums.entry(level).or_insert(0.0) += weight / n;
        }
    }
    sums.into_iter().collect()
}

/// Returns the index along an axis of a combination of levels: shares slowest, respiration fastest.
fn index_of(k: usize, axis: usize, levels: &[Levels; 3]) -> usize {
    let [n, m] = [levels[0].len(), levels[1].len()];
    match axis {
        0 => k / m % n,
        1 => k % m,
        _ => k / (n * m),
    }
}

/// Time and its first moment near each combination of levels ([`index_of`]).
#[derive(Debug, Clone)]
struct Cells(Vec<[f64; 2]>);

impl Cells {
    fn add(&mut self, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(&other.0) {
            *sum = [sum[0] + value[0], sum[1] + value[1]];
        }
    }

    /// Adds an instant with its weights of the levels of each axis.
    fn add_product(
        &mut self,
        weights: &[Vec<(usize, f64)>; 3],
        [seconds, t]: [f64; 2],
        [n, m]: [usize; 2],
    ) {
        for (k, of_share) in &weights[2] {
            for (i, of_volume) in &weights[0] {
                for (j, of_breath) in &weights[1] {
                    let time = seconds * of_share * of_volume * of_breath;
                    let sum = &mut self.0[(k * n + i) * m + j];
                    *sum = [sum[0] + time, sum[1] + time * t];
                }
            }
        }
    }

    /// Returns the same for every second level; the time of omitted levels goes to their neighbours.
    fn coarsened(mut self, levels: &[Levels; 3]) -> Self {
        let [n, m] = [levels[0].len(), levels[1].len()];
        for (axis, stride) in [(0, m), (1, 1), (2, n * m)] {
            let others: Vec<usize> = (0..self.0.len())
                .filter(|k| index_of(*k, axis, levels) == 0)
                .collect();
            for (k, weights) in levels[axis].left_out() {
                for other in &others {
                    let at = |k: usize| other + k * stride;
                    let here = std::mem::take(&mut self.0[at(k)]);
                    for &(neighbour, part) in &weights {
                        for (sum, value) in self.0[at(neighbour)].iter_mut().zip(here) {
                            *sum += part * value;
                        }
                    }
                }
            }
        }
        self
    }
}
