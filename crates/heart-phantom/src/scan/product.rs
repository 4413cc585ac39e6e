//! Means over real time as means over volumes and breaths: how long the heart is near each of some volumes while the breath is near each
//! of some places.
//!
//! Between neighbouring levels `l_i` of the height h of the volume and `r_j` of the breath r the view is taken as bilinear:
//!
//! ```text
//! mean = sum_ij w_ij F(l_i, r_j),    w_ij = integral of hat_i(h(t)) hat_j(r(t)) dt / integral of dt
//! ```
//!
//! over the time that the view really sees, stretch by stretch from one crossing of a level to the next. Shapes are those of the levels,
//! whatever beats and breaths do; the breath only moves them.

use super::acquisition::Acquisition;
use super::camera::Rotation;
use super::levels::{GAUSS, levels_between};
use super::nodes::Nodes;
use super::spans::{self, Span};
use super::timing::{NO_TIME, arcs, even};
use crate::{Camera, Cycle};
use std::ops::Range;

/// Arcs of any part of a view of a turning camera at least.
const FEWEST_ARCS: usize = 8;

/// The levels of volume and of breath between which views are bilinear.
#[derive(Debug, Clone)]
pub(super) struct Product<'a> {
    acquisition: Acquisition,
    cycle: &'a Cycle,
    camera: &'a Camera,
    /// Lowest and highest of what all views see, where each sees all of it.
    all: [Option<[f64; 2]>; 2],
}

impl<'a> Product<'a> {
    pub(super) fn new(acquisition: Acquisition, cycle: &'a Cycle, camera: &'a Camera) -> Self {
        let lasts = match acquisition {
            Acquisition::Instants => 0.0,
            Acquisition::Exposure { window, .. } => window,
            _ => camera.interval(),
        };
        let beat = cycle
            .rhythm()
            .map_or(cycle.period(), |rhythm| rhythm.longest());
        let breath = cycle
            .breathing()
            .map_or(0.0, |breathing| breathing.breathing().period);
        let mut made = Self {
            acquisition,
            cycle,
            camera,
            all: [None; 2],
        };
        let shared = [lasts >= beat, lasts >= breath];
        if shared != [false; 2] {
            let views = 0..camera.n_views();
            let ranges = made.ranges(&views.flat_map(|view| made.spans(view)).collect::<Vec<_>>());
            made.all = [0, 1].map(|k| shared[k].then_some(ranges[k]));
        }
        made
    }

    fn spans(&self, view_idx: usize) -> Vec<Span> {
        spans::of_view(self.acquisition, self.cycle, self.camera, view_idx)
    }

    /// Lowest and highest height and breath.
    fn ranges(&self, spans: &[Span]) -> [[f64; 2]; 2] {
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for span in spans {
            for k in 0..2 {
                let heights = span.phase.map(|phase| self.cycle.height().at(phase));
                let breaths = span.breath.map(|phase| self.breath(phase));
                for value in [heights, breaths][k] {
                    ranges[k] = [ranges[k][0].min(value), ranges[k][1].max(value)];
                }
            }
        }
        ranges
    }

    fn breath(&self, phase: f64) -> f64 {
        (self.cycle.breathing()).map_or(0.0, |breathing| breathing.at_phase(phase))
    }

    /// The points of one view.
    pub(super) fn view(&self, view_idx: usize) -> Nodes {
        let start = self.camera.view_start(view_idx);
        let spans = self.spans(view_idx);
        let [seconds, _] = spans::seen(&spans, start);
        if seconds == 0.0 {
            return self.moment(start);
        }
        let points = self.acquisition.points();
        let ranges = self.ranges(&spans);
        let levels = [0, 1].map(|k| levels_between(self.all[k].unwrap_or(ranges[k]), points));
        let n_arcs = match self.camera.rotation() {
            Rotation::StepAndShoot => 1,
            Rotation::Continuous => {
                let share = seconds / self.camera.interval();
                even(share * arcs(points) as f64).max(FEWEST_ARCS)
            }
        };
        let fine: Vec<Cells> = (in_arcs(&spans, seconds, n_arcs).iter())
            .map(|spans| self.cells(spans, &levels))
            .collect();
        let coarse: Vec<Cells> = (fine.chunks(2))
            .map(|pair| {
                let mut sum = pair[0].clone();
                pair[1..].iter().for_each(|other| sum.add(other));
                sum.coarsened(&levels)
            })
            .collect();
        let mut made = Nodes::default();
        let mut add = |arcs: &[Cells], weights: [f64; 2]| {
            for (k, [time, moment]) in arcs.iter().flat_map(|cells| cells.0.iter().enumerate()) {
                if *time > NO_TIME * NO_TIME * seconds {
                    let [i, j] = [k / levels[1].len(), k % levels[1].len()];
                    let gain = self.cycle.gain_at_height(levels[0][i]);
                    let share = match self.camera.rotation() {
                        Rotation::StepAndShoot => 0.0,
                        Rotation::Continuous => (moment / time - start) / self.camera.interval(),
                    };
                    let weights = weights.map(|weight| weight * time / seconds);
                    made.add([gain, levels[1][j]], share, weights);
                }
            }
        };
        // As of means over volumes: the coarse rule is twice what the first weights make.
        add(&fine, [0.0, 1.0]);
        add(&coarse, [0.5, -0.5]);
        made.nodes.retain(|node| node.weights != [0.0; 2]);
        made.phases = made.nodes.iter().map(|node| node.gain).collect();
        made
    }

    /// A view that sees a moment.
    fn moment(&self, t: f64) -> Nodes {
        let phase = match self.acquisition {
            Acquisition::Static { phase, .. } => self.cycle.wrapped(phase),
            _ => self.cycle.phase(t),
        };
        let mut made = Nodes::default();
        made.add(
            [self.cycle.gain(phase), self.cycle.breath(t)],
            0.0,
            [1.0, 0.0],
        );
        made.phases.push(phase);
        made
    }

    /// Time, and its moment about the start of the scan, near each pair of levels.
    fn cells(&self, spans: &[Span], levels: &[Vec<f64>; 2]) -> Cells {
        let mut cells = Cells(vec![[0.0; 2]; levels[0].len() * levels[1].len()]);
        for span in spans {
            let height = |t: f64| self.cycle.height().at(span.phase_at(t));
            let breath = |t: f64| self.breath(span.breath_at(t));
            let mut cuts = crossings(span.time, height, &levels[0]);
            cuts.extend(crossings(span.time, breath, &levels[1]));
            cuts.extend(span.time);
            cuts.sort_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
                if half <= 0.0 {
                    continue;
                }
                let [i, j] = [
                    cell(&levels[0], height(middle)),
                    cell(&levels[1], breath(middle)),
                ];
                for [x, weight] in GAUSS {
                    let t = middle + half * x;
                    for (i, in_height) in hats(&levels[0], i.clone(), height(t)) {
                        for (j, in_breath) in hats(&levels[1], j.clone(), breath(t)) {
                            let time = half * weight * in_height * in_breath;
                            let sum = &mut cells.0[i * levels[1].len() + j];
                            *sum = [sum[0] + time, sum[1] + time * t];
                        }
                    }
                }
            }
        }
        cells
    }
}

/// Time and moment near each pair of levels, breath fastest.
#[derive(Debug, Clone)]
struct Cells(Vec<[f64; 2]>);

impl Cells {
    fn add(&mut self, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(&other.0) {
            *sum = [sum[0] + value[0], sum[1] + value[1]];
        }
    }

    /// What every second level of each would have: a level in between gives its time to its neighbours.
    fn coarsened(mut self, levels: &[Vec<f64>; 2]) -> Self {
        let [n, m] = [levels[0].len(), levels[1].len()];
        for (levels, stride, others) in [
            (&levels[0], m, (0..m).collect::<Vec<_>>()),
            (&levels[1], 1, (0..n).map(|i| i * m).collect()),
        ] {
            for k in (1..levels.len()).step_by(2) {
                let up = (levels[k] - levels[k - 1]) / (levels[k + 1] - levels[k - 1]);
                for other in &others {
                    let at = |k: usize| other + k * stride;
                    let here = std::mem::take(&mut self.0[at(k)]);
                    for a in 0..2 {
                        self.0[at(k - 1)][a] += (1.0 - up) * here[a];
                        self.0[at(k + 1)][a] += up * here[a];
                    }
                }
            }
        }
        self
    }
}

/// Stretches cut into arcs of equal time.
fn in_arcs(spans: &[Span], seconds: f64, n: usize) -> Vec<Vec<Span>> {
    let each = seconds / n as f64;
    let mut arcs = vec![Vec::new(); n];
    let mut before = 0.0;
    for span in spans {
        let first = ((before / each) as usize).min(n - 1);
        let last = (((before + span.seconds()) / each) as usize).min(n - 1);
        for (k, arc) in arcs.iter_mut().enumerate().take(last + 1).skip(first) {
            // From the end of the one before to the end of this one.
            let at = |k: usize| match k == 0 || k == n {
                true => [f64::NEG_INFINITY, f64::INFINITY][usize::from(k == n)],
                false => span.time[0] + k as f64 * each - before,
            };
            arc.extend(span.part([at(k), at(k + 1)]));
        }
        before += span.seconds();
    }
    arcs
}

/// When a function that rises or falls crosses levels.
fn crossings(time: [f64; 2], at: impl Fn(f64) -> f64, levels: &[f64]) -> Vec<f64> {
    let [from, to] = time.map(&at);
    let first = levels.partition_point(|level| *level <= from.min(to));
    let last = levels.partition_point(|level| *level < from.max(to));
    (levels[first..last.max(first)].iter())
        .map(|level| spans::root(time, &at, *level))
        .collect()
}

/// The levels between which a value is, or the only one.
fn cell(levels: &[f64], value: f64) -> Range<usize> {
    if levels.len() == 1 {
        return 0..0;
    }
    let above = levels.partition_point(|level| *level <= value);
    let above = above.clamp(1, levels.len() - 1);
    above - 1..above
}

/// Two neighbouring levels with their hats.
fn hats(levels: &[f64], cell: Range<usize>, value: f64) -> Vec<(usize, f64)> {
    if cell.is_empty() {
        return vec![(cell.start, 1.0)];
    }
    let up = (value - levels[cell.start]) / (levels[cell.end] - levels[cell.start]);
    vec![(cell.start, 1.0 - up), (cell.end, up)]
}
