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
//! the features of a curve are. In continuous rotation the time is divided into arcs, in each of which a pair of levels is projected from
//! its mean angle.
//!
//! Rays that touch the surface have a square root of time, so that the linear rule is of order 3/2: the error falls by 2.8 when the points
//! double. Behind a response samples are analytic functions of the volume: the polynomial through Chebyshev points converges exponentially, and all
//! gates have the levels of the whole cycle, so that each level is projected once. Every second level of every pair of arcs is the rule with half
//! the points, which gives the error estimate.

use super::acquisition::Acquisition;
use super::levels::{Interpolation, Levels, Scale, Stretch};
use super::nodes::Nodes;
use super::settings::Mode;
use super::settings::Rotation;
use super::spans::{self, Span};
use crate::{Camera, Cycle};

/// Smallest number of arcs of any part of a view: a base parallel to the rays appears only briefly.
const FEWEST_ARCS: f64 = 8.0;
/// Shorter parts, as a fraction of the view, have fewer than [`FEWEST_ARCS`], because the camera hardly rotates.
const SHORTEST_PART: f64 = 1e-3;
/// Smaller fractions of a view are rounding.
const NO_TIME: f64 = 1e-18;
/// Weights of one half, relative to the other, below this are rounding.
const NO_WEIGHT: f64 = 1e-12;
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
    /// Levels of volume and respiratory position common to all views, if each view covers the whole cycle.
    shared: [Option<Levels>; 2],
}

impl<'a> TimeRule<'a> {
    pub(crate) fn new(acquisition: Acquisition, cycle: &'a Cycle, camera: &'a Camera) -> Self {
        let lasts = acquisition.lasts(camera);
        let beat = (cycle.rhythm()).map_or(cycle.period(), |rhythm| rhythm.longest());
        let breath = cycle.breathing().map(|motion| motion.breathing().period);
        let mut rule = Self {
            acquisition,
            cycle,
            camera,
            shared: [None, None],
        };
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
                .flat_map(|view_idx| spans::of_view(shared, cycle, camera, view_idx))
                .collect();
            rule.shared = [0, 1].map(|axis| covers[axis].then(|| rule.levels(&spans, axis)));
        }
        rule
    }

    /// Returns the height of the volume (axis 0) or the respiratory fraction (axis 1) at a time of a span.
    fn height(&self, axis: usize, span: &Span, t: f64) -> f64 {
        match (axis, self.cycle.breathing()) {
            (0, _) => self.cycle.height().at(span.phase_at(t)),
            (_, Some(breathing)) => breathing.at_phase(span.breath_at(t)),
            (_, None) => 0.0,
        }
    }

    fn levels(&self, spans: &[Span], axis: usize) -> Levels {
        let stretch = |span: &Span| Stretch {
            heights: span.time.map(|t| self.height(axis, span, t)),
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
        Levels::new(&stretches, (points, interpolation), scale)
    }

    /// Returns the points of a view.
    pub(crate) fn view(&self, view_idx: usize) -> Nodes {
        let window = self.acquisition.window(self.cycle, self.camera, view_idx);
        let spans = spans::between(self.acquisition, self.cycle, window);
        let [seconds, _] = spans::seen(&spans, window[0]);
        if seconds == 0.0 {
            return self.moment(self.camera.view_start(view_idx));
        }
        let levels = [0, 1].map(|axis| match &self.shared[axis] {
            Some(shared) => shared.clone(),
            None => self.levels(&spans, axis),
        });
        let fine: Vec<Cells> = (self.in_arcs(spans, seconds).iter())
            .map(|spans| self.cells(spans, &levels))
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
                let [i, j] = [k / levels[1].len(), k % levels[1].len()];
                let gain = self.cycle.gain_at_height(levels[0].height(i));
                let share = match self.camera.rotation() {
                    Rotation::StepAndShoot => 0.0,
                    Rotation::Continuous => (moment / time - window[0]) / interval,
                };
                let weight = time / seconds;
                volume += (halves[0] + halves[1]) * weight * (1.0 + gain);
                let at = [gain, levels[1].height(j)];
                made.add(at, share, halves.map(|half| half * weight));
            }
        };
        // The first half contains half of the coarse rule, which is subtracted from the second half.
        add(&fine, [0.0, 1.0]);
        add(&coarse, [0.5, -0.5]);
        let height: f64 = fine.iter().map(|cells| cells.1).sum();
        let exact = 1.0 + self.cycle.gain_at_height(height / seconds);
        made.volume_error = (volume / exact - 1.0).abs();
        made.tidy(NO_WEIGHT);
        made
    }

    /// Returns the point of an instantaneous view.
    fn moment(&self, t: f64) -> Nodes {
        let phase = match self.acquisition.mode {
            Mode::Static { phase } => self.cycle.wrapped(phase),
            _ => self.cycle.phase(t),
        };
        let at = [self.cycle.gain(phase), self.cycle.breath(t)];
        let mut made = Nodes::default();
        made.add(at, 0.0, [1.0, 0.0]);
        made.phases.push(phase);
        made
    }

    /// Divides the spans into arcs of equal time; one arc for a stationary camera.
    fn in_arcs(&self, spans: Vec<Span>, seconds: f64) -> Vec<Vec<Span>> {
        let (Rotation::Continuous, Some(first), Some(last)) =
            (self.camera.rotation(), spans.first(), spans.last())
        else {
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

    /// Returns the time of the spans near each pair of levels.
    fn cells(&self, spans: &[Span], levels: &[Levels; 2]) -> Cells {
        let mut cells = Cells(vec![[0.0; 2]; levels[0].len() * levels[1].len()], 0.0);
        for span in spans {
            let heights = [0, 1].map(|axis| span.time.map(|t| self.height(axis, span, t)));
            let stays = [0, 1].map(|axis| levels[axis].of_stay(heights[axis]));
            let mut cuts = span.time.to_vec();
            for axis in (0..2).filter(|axis| stays[*axis].is_none()) {
                let at = |t: f64| (levels[axis].scale).coordinate(self.height(axis, span, t));
                let crossed = levels[axis].between(heights[axis]).iter();
                cuts.extend(crossed.map(|level| spans::root(span.time, at, *level)));
            }
            cuts.sort_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
                if half <= 0.0 {
                    continue;
                }
                let height = |axis: usize, t: f64| self.height(axis, span, t);
                let in_cell = [0, 1].map(|axis| match stays[axis] {
                    Some(_) => 0,
                    None => levels[axis].cell(height(axis, middle)),
                });
                for [x, weight] in GAUSS {
                    let t = middle + half * x;
                    let seconds = span.copies * half * weight;
                    let weights = [0, 1].map(|axis| match stays[axis] {
                        Some(k) => vec![(k, 1.0)],
                        None => levels[axis].weights(in_cell[axis], height(axis, t)),
                    });
                    cells.1 += seconds * height(0, t);
                    for (i, of_volume) in &weights[0] {
                        for (j, of_breath) in &weights[1] {
                            let time = seconds * of_volume * of_breath;
                            let sum = &mut cells.0[i * levels[1].len() + *j];
                            *sum = [sum[0] + time, sum[1] + time * (t + span.delay)];
                        }
                    }
                }
            }
        }
        cells
    }
}

/// Time and its first moment near each pair of levels, respiration fastest; and the integral of the volume's height.
#[derive(Debug, Clone)]
struct Cells(Vec<[f64; 2]>, f64);

impl Cells {
    fn add(&mut self, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(&other.0) {
            *sum = [sum[0] + value[0], sum[1] + value[1]];
        }
    }

    /// Returns the same for every second level; the time of omitted levels goes to their neighbours.
    fn coarsened(mut self, levels: &[Levels; 2]) -> Self {
        let [n, m] = [levels[0].len(), levels[1].len()];
        for (axis, stride, others) in [
            (0, m, (0..m).collect::<Vec<_>>()),
            (1, 1, (0..n).map(|i| i * m).collect()),
        ] {
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
