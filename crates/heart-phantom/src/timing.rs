//! When a view is taken, and the quadrature over that time.

use crate::acquire::Acquisition;
use crate::camera::Rotation;
use crate::error::{PhantomError, check, check_count};
use crate::{Camera, Cycle};
use std::collections::BTreeMap;

/// Most quadrature points a cycle, and intervals in one view.
pub(crate) const MAX_POINTS: usize = 65536;
/// Most points of all views together: each is a view of the heart, and is kept until its view is taken.
pub(crate) const MAX_POINTS_OF_ALL: usize = 1 << 24;
/// Intervals over the arc of a view of a turning camera while the heart stands still, at least.
const ARC_INTERVALS: f64 = 8.0;
/// Steps a cycle at which the curve of the volume is taken as known.
const FINE: usize = 4096;
/// A rest of a beat shorter than this share of a cycle is rounding.
const NO_TIME: f64 = 1e-9;

/// One point of the quadrature over a view, equal ones merged.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Volume gain of the cavity.
    pub(crate) gain: f64,
    /// Share of the view's interval that has passed.
    pub(crate) share: f64,
    /// Weight in the even and in the odd half of the rule.
    pub(crate) weights: [f64; 2],
}

/// A stretch of time within a view: phase and share run evenly from the first to the second.
struct Stretch {
    phases: [f64; 2],
    shares: [f64; 2],
    weight: f64,
}

/// The points over which a view is averaged, and how many phases of the cycle they see.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nodes {
    pub(crate) nodes: Vec<Node>,
    pub(crate) phases: Vec<f64>,
}

impl Nodes {
    /// Mean over the view of the cavity's volume, in units of that at rest.
    fn mean_volume(&self) -> f64 {
        let mean = |node: &Node| (node.weights[0] + node.weights[1]) * (1.0 + node.gain);
        self.nodes.iter().map(mean).sum()
    }
}

/// The cavity's volume, in units of that at rest, summed from phase 0 on: means over any time without its shapes.
pub(crate) struct MeanVolume {
    /// Sums up to each of [`FINE`] + 1 equally spaced phases, in cycles.
    sums: Vec<f64>,
}

impl MeanVolume {
    pub(crate) fn new(cycle: &Cycle) -> Self {
        let volume = |k: usize| 1.0 + cycle.gain(k as f64 / FINE as f64);
        let steps = (0..FINE).map(|k| 0.5 * (volume(k) + volume(k + 1)) / FINE as f64);
        let sums = steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        });
        Self {
            sums: std::iter::once(0.0).chain(sums).collect(),
        }
    }

    /// From phase 0 to a phase of any beat.
    fn up_to(&self, phase: f64) -> f64 {
        let at = phase.rem_euclid(1.0) * FINE as f64;
        let k = (at as usize).min(FINE - 1);
        let [from, to] = [self.sums[k], self.sums[k + 1]];
        phase.floor() * self.sums[FINE] + from + (at - k as f64) * (to - from)
    }

    /// How far the sum over the nodes of a view is from the mean volume over its time, as a share of that.
    pub(crate) fn error(
        &self,
        acquisition: &Acquisition,
        (cycle, camera): (&Cycle, &Camera),
        view_idx: usize,
        nodes: &Nodes,
    ) -> f64 {
        let mean = |[from, to]: [f64; 2]| match to > from {
            true => (self.up_to(to) - self.up_to(from)) / (to - from),
            false => 1.0 + cycle.gain(from),
        };
        let stretches = acquisition.stretches(cycle, camera, view_idx);
        let known: f64 = (stretches.iter())
            .map(|stretch| stretch.weight * mean(stretch.phases))
            .sum();
        (nodes.mean_volume() / known - 1.0).abs()
    }
}

impl Acquisition {
    /// Whether all views see the same phases with the same weights.
    pub(crate) fn same_for_all_views(&self, camera: &Camera) -> bool {
        match self {
            Acquisition::Static { .. } => true,
            Acquisition::WholeCycle { .. } | Acquisition::Gate { .. } => {
                camera.rotation() == Rotation::StepAndShoot
            }
            Acquisition::Instants { .. } | Acquisition::Exposure { .. } => false,
        }
    }

    /// Checks what does not depend on the view.
    pub(crate) fn validate(&self, cycle: &Cycle, camera: &Camera) -> Result<(), PhantomError> {
        let check_points = |points: usize| {
            check_count("quadrature points", points, 2, MAX_POINTS)?;
            if points.is_multiple_of(2) {
                Ok(())
            } else {
                Err(PhantomError::Odd {
                    what: "quadrature points",
                    given: points,
                })
            }
        };
        match *self {
            Acquisition::Static { phase } => {
                check("phase", phase, -1e9, 1e9)?;
            }
            Acquisition::Instants { interval } => {
                check("interval", interval, 0.0, 1e9)?;
            }
            Acquisition::Exposure {
                interval,
                window,
                points,
            } => {
                check("interval", interval, 0.0, 1e9)?;
                check("window", window, 0.0, interval)?;
                check_points(points)?;
            }
            Acquisition::WholeCycle { points } => check_points(points)?,
            Acquisition::Gate {
                gate,
                gates,
                points,
            } => {
                check_count("gates", gates, 1, MAX_POINTS)?;
                check_count("gate", gate, 0, gates - 1)?;
                check_points(points)?;
            }
        }
        if let (
            Acquisition::WholeCycle { .. } | Acquisition::Gate { .. },
            Rotation::Continuous { interval },
        ) = (self, camera.rotation())
        {
            // Else there are views in which no beat begins.
            check(
                "interval of a turning camera",
                interval,
                cycle.period(),
                1e9,
            )?;
        }
        let points = self.points_of_all(cycle, camera);
        let what = "quadrature points of all views";
        check_count(what, points as usize, 0, MAX_POINTS_OF_ALL).map(drop)
    }

    /// Points of all views together, before equal ones are merged.
    fn points_of_all(&self, cycle: &Cycle, camera: &Camera) -> f64 {
        let n_views = if self.same_for_all_views(camera) {
            1
        } else {
            camera.n_views()
        };
        // Beats in a view, and shares of each that are sampled.
        let beats = match (camera.rotation(), self) {
            (_, Acquisition::Static { .. } | Acquisition::Instants { .. }) => return 0.0,
            (Rotation::Continuous { .. }, Acquisition::Exposure { window, .. }) => {
                window / cycle.period()
            }
            (Rotation::StepAndShoot, Acquisition::Exposure { window, .. }) => {
                // Whole beats share their phases, the rest has its own.
                (window / cycle.period()).min(2.0)
            }
            (Rotation::Continuous { interval }, _) => interval / cycle.period(),
            (Rotation::StepAndShoot, _) => 1.0,
        };
        let points = match *self {
            Acquisition::Gate { gates, points, .. } => (points as f64 / gates as f64).max(2.0),
            _ => self.points() as f64,
        };
        n_views as f64 * beats * points
    }

    /// Steps a cycle; none where nothing is averaged.
    fn points(&self) -> usize {
        match *self {
            Acquisition::Static { .. } | Acquisition::Instants { .. } => 0,
            Acquisition::Exposure { points, .. }
            | Acquisition::WholeCycle { points }
            | Acquisition::Gate { points, .. } => points,
        }
    }

    /// The quadrature over one view.
    pub(crate) fn nodes(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> Nodes {
        let points = self.points();
        let mut result = Nodes::default();
        let mut known = BTreeMap::new();
        for stretch in self.stretches(cycle, camera, view_idx) {
            let ([p0, p1], [u0, u1]) = (stretch.phases, stretch.shares);
            let intervals = intervals(p1 - p0, u1 - u0, points);
            for j in 0..=intervals {
                let along = if intervals == 0 {
                    0.0
                } else {
                    j as f64 / intervals as f64
                };
                let phase = cycle.wrapped(p0 + (p1 - p0) * along);
                let (gain, share) = (cycle.gain(phase), u0 + (u1 - u0) * along);
                let mut weight = stretch.weight / intervals.max(1) as f64;
                if intervals > 0 && (j == 0 || j == intervals) {
                    weight /= 2.0;
                }
                let nodes = &mut result.nodes;
                let at = *known
                    .entry((gain.to_bits(), share.to_bits()))
                    .or_insert_with(|| {
                        nodes.push(Node {
                            gain,
                            share,
                            weights: [0.0; 2],
                        });
                        nodes.len() - 1
                    });
                result.nodes[at].weights[j % 2] += weight;
                result.phases.push(phase);
            }
        }
        result
    }

    fn stretches(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> Vec<Stretch> {
        let turning = match camera.rotation() {
            Rotation::StepAndShoot => None,
            Rotation::Continuous { interval } => Some(interval),
        };
        let whole_view = if turning.is_some() {
            [0.0, 1.0]
        } else {
            [0.5; 2]
        };
        let one = |phases, shares| {
            vec![Stretch {
                phases,
                shares,
                weight: 1.0,
            }]
        };
        let start = |interval: f64| cycle.phase(view_idx as f64 * interval);
        match *self {
            Acquisition::Static { phase } => one([phase; 2], whole_view),
            Acquisition::Instants { interval } => one([start(interval); 2], [0.5; 2]),
            Acquisition::Exposure {
                interval, window, ..
            } => {
                let (first, beats) = (start(interval), window / cycle.period());
                match turning {
                    Some(turn) => one([first, first + beats], [0.0, window / turn]),
                    None => exposure(first, beats),
                }
            }
            Acquisition::WholeCycle { .. } => beats([0.0, 1.0], cycle, turning, view_idx),
            Acquisition::Gate { gate, gates, .. } => {
                let ends = [gate, gate + 1].map(|g| g as f64 / gates as f64);
                beats(ends, cycle, turning, view_idx)
            }
        }
    }
}

/// An even number, at least 2 where anything moves.
fn intervals(beats: f64, share: f64, points: usize) -> usize {
    let moving = 2.0 * (beats * points as f64 / 2.0 - NO_TIME).ceil().max(1.0);
    match (beats > 0.0, share > 0.0) {
        (false, false) => 0,
        (false, true) => ARC_INTERVALS as usize,
        // Not more than 2^16 steps a beat: `validate` has seen the points.
        (true, _) => moving.min(1e9) as usize,
    }
}

/// A camera that stands still: whole beats share their phases, a rest of a beat has its own.
fn exposure(first: f64, beats: f64) -> Vec<Stretch> {
    let (whole, rest) = (beats.floor(), beats - beats.floor());
    let stretch = |phases, weight| Stretch {
        phases,
        shares: [0.5; 2],
        weight,
    };
    match (whole >= 1.0, rest > NO_TIME) {
        (true, true) => vec![
            stretch([0.0, 1.0], whole / beats),
            stretch([first, first + rest], rest / beats),
        ],
        (true, false) => vec![stretch([0.0, 1.0], 1.0)],
        (false, true) => vec![stretch([first, first + rest], 1.0)],
        (false, false) => vec![stretch([first; 2], 1.0)],
    }
}

/// The same phases of every beat that begins in the view.
fn beats(phases: [f64; 2], cycle: &Cycle, turning: Option<f64>, view_idx: usize) -> Vec<Stretch> {
    let Some(interval) = turning else {
        return vec![Stretch {
            phases,
            shares: [0.5; 2],
            weight: 1.0,
        }];
    };
    let per_view = interval / cycle.period();
    let first_beat = |view: usize| (view as f64 * per_view - NO_TIME).ceil();
    let (from, to) = (first_beat(view_idx), first_beat(view_idx + 1));
    let n = to - from;
    (0..n as usize)
        .map(|k| Stretch {
            phases,
            shares: phases.map(|p| (from + k as f64 + p) / per_view - view_idx as f64),
            weight: 1.0 / n,
        })
        .collect()
}
