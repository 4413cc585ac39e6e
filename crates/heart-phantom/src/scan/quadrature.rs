//! The points over which a view is averaged.
//!
//! A sinusoid before a camera that stands still is sampled at equal steps of time, the trapezoidal rule: as means over volumes these
//! are the Gauss rule of its weight, and mirrored phases share their shapes. Everything else is a mean over [`Levels`] of volume.
//! Beats that differ, and breathing, are seen in real time, as a mean over volumes and breaths ([`Product`]).
//! While the camera turns the time of a view is cut into arcs, in each of which a level is seen from the mean angle of its time there.

use super::acquisition::Acquisition;
use super::camera::Rotation;
use super::levels::Levels;
use super::nodes::Nodes;
use super::product::Product;
use super::timing::{NO_TIME, arcs, even};
use super::view_time::TimeSeen;
use crate::{Camera, Cycle};
use std::f64::consts::PI;

/// Arcs of any part of a view of a turning camera at least: a flat base seen edge on comes and goes at once.
const FEWEST_ARCS: usize = 8;

/// The quadrature of an acquisition's views.
pub(crate) struct Quadrature<'a> {
    acquisition: Acquisition,
    cycle: &'a Cycle,
    camera: &'a Camera,
    /// The levels of all views, where each sees a whole beat.
    levels: Option<Levels<'a>>,
    /// What views are in real time.
    product: Option<Product<'a>>,
}

impl<'a> Quadrature<'a> {
    pub(crate) fn new(acquisition: Acquisition, cycle: &'a Cycle, camera: &'a Camera) -> Self {
        let seen = acquisition.seen(cycle, camera, 0);
        let whole = seen.beats >= 1.0 || acquisition.same_for_all_views(cycle, camera);
        let real = acquisition.in_real_time(cycle);
        let levels = (!real && whole && acquisition.by_volume(cycle, camera))
            .then(|| Levels::new(cycle.height(), &seen, acquisition.points()));
        Self {
            product: real.then(|| Product::new(acquisition, cycle, camera)),
            acquisition,
            cycle,
            camera,
            levels,
        }
    }

    /// The points of one view.
    pub(crate) fn view(&self, view_idx: usize) -> Nodes {
        if let Some(product) = &self.product {
            return product.view(view_idx);
        }
        let seen = self.acquisition.seen(self.cycle, self.camera, view_idx);
        let turning = match self.camera.rotation() {
            Rotation::StepAndShoot => None,
            Rotation::Continuous => Some(self.camera.interval() / self.cycle.period()),
        };
        match (self.acquisition, turning) {
            (Acquisition::Static { phase, points }, Some(_)) => self.still(phase, points),
            _ if self.acquisition.by_volume(self.cycle, self.camera) => match &self.levels {
                Some(levels) => self.by_volume(levels, &seen, turning),
                None => {
                    let (height, points) = (self.cycle.height(), self.acquisition.points());
                    self.by_volume(&Levels::new(height, &seen, points), &seen, turning)
                }
            },
            _ => self.equal_steps(&seen),
        }
    }

    /// A heart at one phase while the camera turns: equal steps of the arc.
    fn still(&self, phase: f64, points: usize) -> Nodes {
        let arcs = points.max(FEWEST_ARCS);
        let mut made = Nodes::default();
        let (phase, gain) = (self.cycle.wrapped(phase), self.cycle.gain(phase));
        for (j, weights) in trapezoidal(arcs, 1.0) {
            made.add([gain, 0.0], j as f64 / arcs as f64, weights);
        }
        made.phases.push(phase);
        made
    }

    /// Equal steps of time; whole beats share their phases, a rest of a beat has its own.
    fn equal_steps(&self, seen: &TimeSeen) -> Nodes {
        let mut made = Nodes::default();
        let [mut mean, mut exact] = [0.0; 2];
        for ([from, to], share) in stretches(seen) {
            let steps = match to > from {
                true => even((to - from) * self.acquisition.points() as f64),
                false => 0,
            };
            for (j, weights) in trapezoidal(steps, share) {
                let along = j as f64 / steps.max(1) as f64;
                let phase = self.cycle.wrapped(from + (to - from) * along);
                let gain = self.cycle.gain(phase);
                made.add([gain, 0.0], 0.0, weights);
                made.phases.push(phase);
                mean += (weights[0] + weights[1]) * (1.0 + gain);
            }
            exact += share * (1.0 + self.mean_gain([from, to]));
        }
        made.volume_error = (mean / exact - 1.0).abs();
        made
    }

    /// Mean gain of a sinusoid over a time, or the gain at a moment.
    fn mean_gain(&self, [from, to]: [f64; 2]) -> f64 {
        let half = PI * (to - from);
        if half > 0.0 {
            let cosine = (PI * (from + to)).cos() * half.sin() / half;
            self.cycle.gain_at_height(0.5 - 0.5 * cosine)
        } else {
            self.cycle.gain(from)
        }
    }

    fn by_volume(&self, levels: &Levels<'_>, seen: &TimeSeen, turning: Option<f64>) -> Nodes {
        let from = seen.ends[0];
        let share = turning.map_or(1.0, |beats| seen.beats / beats);
        let arcs = turning.map_or(1, |_| {
            even(share * arcs(self.acquisition.points()) as f64).max(FEWEST_ARCS)
        });
        let ends = seen.parts(arcs);
        let fine: Vec<_> = (ends.windows(2))
            .map(|pair| levels.times([pair[0], pair[1]]))
            .collect();
        let coarse: Vec<_> = (fine.chunks(2))
            .map(|pair| {
                let mut sum = levels.coarse(&pair[0]);
                for times in &pair[1..] {
                    for (sum, time) in sum.iter_mut().zip(levels.coarse(times)) {
                        *sum = [sum[0] + time[0], sum[1] + time[1]];
                    }
                }
                sum
            })
            .collect();
        let all: f64 = fine.iter().flatten().map(|[time, _]| time).sum();
        let mut made = Nodes::default();
        let mut add = |arcs: &[Vec<[f64; 2]>], weights: [f64; 2]| {
            for times in arcs {
                for (k, [time, moment]) in times.iter().enumerate() {
                    if *time > NO_TIME * NO_TIME * all {
                        let gain = self.cycle.gain_at_height(levels.height(k));
                        let share = turning.map_or(0.0, |beats| (moment / time - from) / beats);
                        made.add(
                            [gain, 0.0],
                            share,
                            weights.map(|weight| weight * time / all),
                        );
                    }
                }
            }
        };
        // What the coarse rule has is half of its own in the first half, and is taken out of the second.
        add(&fine, [0.0, 1.0]);
        add(&coarse, [0.5, -0.5]);
        made.nodes.retain(|node| node.weights != [0.0; 2]);
        made.phases = made.nodes.iter().map(|node| node.gain).collect();
        made
    }
}

/// The ends of equal steps with what they weigh in `all`, by turns in the one half and in the other.
fn trapezoidal(steps: usize, all: f64) -> impl Iterator<Item = (usize, [f64; 2])> {
    let each = all / steps.max(1) as f64;
    (0..=steps).map(move |j| {
        let end = steps > 0 && (j == 0 || j == steps);
        let weight = if end { each / 2.0 } else { each };
        match j % 2 {
            0 => (j, [weight, 0.0]),
            _ => (j, [0.0, weight]),
        }
    })
}

/// Whole beats and the rest, with their shares of the time; a moment is a stretch of no length.
fn stretches(seen: &TimeSeen) -> Vec<([f64; 2], f64)> {
    let ([from, to], beats) = (seen.ends, seen.beats);
    let (whole, rest) = (beats.floor(), beats - beats.floor());
    match (whole >= 1.0, rest > NO_TIME) {
        (true, true) => vec![
            ([0.0, 1.0], whole / beats),
            ([from, from + rest], rest / beats),
        ],
        (true, false) => vec![([0.0, 1.0], 1.0)],
        (false, true) => vec![([from, to], 1.0)],
        (false, false) => vec![([from; 2], 1.0)],
    }
}
