//! The states of the heart whose average is the ground truth.

use super::nodes::{Node, Nodes};
use super::settings::Mode;
use super::timing::STEPS;
use super::views::evenly;
use super::whole::{Lasting, Scan};
use crate::Rotation;
use crate::error::{PhantomError, missed};
use nalgebra::Point3;
use revolve_voxel::VoxelGrid;
use std::f64::consts::TAU;

/// Largest estimated errors, as fractions of the tolerance of a voxel: of its average over time, and of that over the voxel if there is one over time.
/// Neither estimate is reached: gates of the default heart have up to two thirds of the first, static voxels up to three quarters of the second.
const OF_TIME: f64 = 0.75;
pub(crate) const OF_VOXEL: f64 = 0.5;
/// The error of an average over too few states.
pub(crate) const GROUND_TRUTH: &str = "average of the ground truth over time";
/// Most views whose spacing of states is evaluated.
const MOST_GAPS: usize = 64;
/// Points of a surface, along and around the axis, at which displacements are computed.
const ALONG: usize = 17;
const AROUND: usize = 4;

/// Returns the shortest side of a voxel.
pub(crate) fn shortest_side(grid: &VoxelGrid) -> f64 {
    grid.spacing().into_iter().fold(f64::INFINITY, f64::min)
}

impl Scan<'_> {
    /// Returns the states of the heart during all views, equal ones merged. The volume fraction of a voxel averaged over these states differs by less than
    /// the tolerance from its average over time.
    ///
    /// It is piecewise smooth in the displacement of a surface, with slopes of at most 1 per voxel and kinks where the surface enters and leaves
    /// the voxel. Linear interpolation between states that are `w` voxels apart has errors of at most `w / 8`, times the fraction of time between them,
    /// because a kink lies between one pair of states. Heart beat and respiration each have this error. Where both move a surface, positions of kinks are
    /// averaged: `w^2 / 12` replaces `w^2 / 8`, and the density of the sum of two displacements is at most that of either.
    pub(crate) fn states(&self, tolerance: f64) -> Result<Vec<Lasting>, PhantomError> {
        let voxels = match self.has_duration() {
            true => self.voxels_moved()?,
            false => [0.0; 2],
        };
        self.states_moved(voxels, tolerance)
    }

    /// Estimates the volume gains of these states without solving a shape; none if the acquisition is invalid.
    pub(crate) fn likely_gains(&self, tolerance: f64) -> impl Iterator<Item = u64> {
        let [low, high] = self.cycle.gains().map(|gain| (1.0 + gain).cbrt());
        let [length, _] = self.heart.reference_extent();
        let beat = match self.acquisition.mode {
            Mode::Static { .. } | Mode::Instants => 0.0,
            _ => length * (high - low) / shortest_side(self.camera.grid()),
        };
        let states = self
            .states_moved([beat, 0.0], tolerance)
            .unwrap_or_default();
        states.into_iter().map(|state| state.gain.to_bits())
    }

    /// The states if surfaces move by as many voxels with the heart beat and with respiration.
    fn states_moved(&self, voxels: [f64; 2], tolerance: f64) -> Result<Vec<Lasting>, PhantomError> {
        let mut steps = [STEPS[0]; 2];
        let allowed = OF_TIME * tolerance;
        let mut scan = self.with_steps(steps)?;
        for axis in (0..2).filter(|axis| voxels[*axis] > 0.0) {
            loop {
                let reached = voxels[axis] * scan.gap(axis);
                if reached <= allowed {
                    break;
                }
                let finer = match steps[axis] < STEPS[1] {
                    true => {
                        // The error is of second order.
                        let next = (steps[axis] as f64 * (reached / allowed).sqrt()) as usize;
                        let next = next.clamp(steps[axis] + 1, STEPS[1]);
                        steps[axis] = next.next_multiple_of(4);
                        self.with_steps(steps).ok()
                    }
                    false => None,
                };
                scan = finer.ok_or_else(|| missed(GROUND_TRUTH, reached, [allowed, tolerance]))?;
            }
        }
        Ok(scan.times())
    }

    /// Whether a view lasts for more than one state of the heart.
    pub(crate) fn has_duration(&self) -> bool {
        match self.acquisition.mode {
            Mode::Instants => false,
            Mode::Static { .. } => self.cycle.breathing().is_some(),
            Mode::Exposure { .. } | Mode::WholeCycle | Mode::Gated { .. } => true,
        }
    }

    /// The scan with linear interpolation between states of as many steps per cycle and per respiratory cycle.
    fn with_steps(&self, steps: [usize; 2]) -> Result<Self, PhantomError> {
        let acquisition = self.acquisition.linear(steps);
        acquisition.validate(self.cycle, self.camera, Rotation::StepAndShoot)?;
        Ok(Self {
            acquisition,
            ..self.clone()
        })
    }

    /// Returns [`TimeRule::gap`](super::time_rule::TimeRule::gap) of some views.
    fn gap(&self, axis: usize) -> f64 {
        let views: Vec<usize> = evenly(MOST_GAPS, self.n_plans()).collect();
        self.rule_of_states().gap(axis, &views)
    }

    /// Each volume gain and respiratory fraction with its fraction of the time of all views.
    fn times(&self) -> Vec<Lasting> {
        let (rule, n_views) = (self.rule_of_states(), self.n_plans());
        let mut all = Nodes::default();
        for view_idx in 0..n_views {
            for node in rule.view(view_idx).nodes {
                let weight = (node.weights[0] + node.weights[1]) / n_views as f64;
                // Without weight it is a state of the coarse rule alone.
                if weight != 0.0 {
                    all.add([node.gain, node.breath], 0.0, [weight, 0.0]);
                }
            }
        }
        let lasting = |node: Node| Lasting {
            gain: node.gain,
            breath: node.breath,
            share: node.weights[0],
        };
        all.nodes.into_iter().map(lasting).collect()
    }

    /// Returns the largest displacement of both membranes and their twist in voxels: from end-diastole to end-systole, and from end-expiration to
    /// end-inspiration.
    fn voxels_moved(&self) -> Result<[f64; 2], PhantomError> {
        let [low, high] = self.cycle.gains();
        let [start, still] = [self.places(high, 0.0)?, self.places(low, 0.0)?];
        let farthest = |places: &[Point3<f64>]| {
            let ways = start.iter().zip(places).map(|(a, b)| (b - a).norm());
            ways.fold(0.0, f64::max)
        };
        let beat = match self.acquisition.mode {
            Mode::Static { .. } => 0.0,
            _ => farthest(&still),
        };
        let breath = match self.cycle.breathing() {
            Some(_) => farthest(&self.places(high, 1.0)?),
            None => 0.0,
        };
        Ok([beat, breath].map(|way| way / shortest_side(self.camera.grid())))
    }

    /// Returns points of both membranes in the lab at a volume gain and a respiratory position.
    fn places(&self, gain: f64, breath: f64) -> Result<Vec<Point3<f64>>, PhantomError> {
        let (shape, pose) = (&self.heart.shapes(&[gain])?[0], self.pose(breath)?);
        let twist = self
            .twist
            .map(|twist| twist.scaled(self.cycle.emptied(gain)));
        let membranes = [
            (0.0, &shape.solution().inner),
            (1.0, &shape.solution().outer),
        ];
        let mut places = Vec::with_capacity(2 * ALONG * AROUND);
        for (layer, membrane) in membranes {
            for s in (0..ALONG).map(|k| 0.5 * k as f64 / (ALONG - 1) as f64) {
                let [x, r] = membrane.at(s).position;
                let turn = twist.as_ref().map_or(0.0, |twist| twist.angle(layer, s));
                let around = (0..AROUND).map(|k| TAU * k as f64 / AROUND as f64 + turn);
                places.extend(
                    around.map(|phi| pose.to_lab(&Point3::new(x, r * phi.cos(), r * phi.sin()))),
                );
            }
        }
        Ok(places)
    }
}
