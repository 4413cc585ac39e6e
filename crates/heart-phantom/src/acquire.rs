//! What the camera sees: sinograms of the heart at rest, of instants, exposures, whole cycles, gates.

use crate::activity::{Activity, Background};
use crate::attenuation::Attenuation;
use crate::defect::{Defect, Placed};
use crate::error::PhantomError;
use crate::timing::{MeanVolume, Node, Nodes};
use crate::{Camera, Cycle, Heart, HeartShape};
use rayon::prelude::*;
use revolve_voxel::RayCounters;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// When each view is taken.
///
/// Averages over time are trapezoidal sums on an even number of equal steps, at least 2, no longer than the cycle over
/// `points`. Over a whole cycle that is the Gauss rule of periodic functions. The half of the points gives an error estimate
/// for nothing, [`Sinograms::quadrature_error`]. Steps that are longer than what the curve does may miss it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Acquisition {
    /// All views at one phase of the cycle: nothing moves.
    Static {
        /// The phase; 0 is rest in the study's cycle.
        phase: f64,
    },
    /// View `k` is an instant at `t = k * interval` seconds.
    Instants {
        /// Seconds from a view to the next.
        interval: f64,
    },
    /// View `k` is the mean from `t = k * interval` to `k * interval + window` seconds.
    Exposure {
        /// Seconds from a view to the next.
        interval: f64,
        /// Seconds that a view is exposed, at most `interval`.
        window: f64,
        /// Steps a cycle, even.
        points: usize,
    },
    /// Each view is the mean over whole cycles.
    WholeCycle {
        /// Steps a cycle, even.
        points: usize,
    },
    /// Each view is the mean over one gate: the phases from `gate / gates` to `(gate + 1) / gates` of every beat.
    Gate {
        /// Which gate, from 0.
        gate: usize,
        /// Number of equal gates.
        gates: usize,
        /// Steps a cycle, even.
        points: usize,
    },
}

impl Acquisition {
    /// Solves the shapes that all views need, so that nothing is left to solve when they are taken.
    ///
    /// # Errors
    /// As [`acquire`](acquire()).
    pub fn solve(&self, heart: &Heart, camera: &Camera, cycle: &Cycle) -> Result<(), PhantomError> {
        self.validate(cycle, camera)?;
        let views = if self.same_for_all_views(camera) {
            1
        } else {
            camera.n_views()
        };
        let nodes = (0..views).flat_map(|view_idx| self.nodes(cycle, camera, view_idx).nodes);
        let gains: Vec<f64> = nodes.map(|node| node.gain).collect();
        heart.shapes(&gains).map(drop)
    }
}

/// The sinograms of an acquisition and how they came about.
#[derive(Debug, Clone)]
pub struct Sinograms {
    /// Line integrals in cm times activity, index order `[view][row][bin]`, bin fastest.
    pub samples: Vec<f32>,
    /// Distinct phases that the views see.
    pub distinct_phases: usize,
    /// Distinct shapes that those phases need: mirrored phases share one.
    pub distinct_shapes: usize,
    /// For averages: `|s_n - s_(n/2)| / |s_n|` (Euclidean norms over all samples), the difference between `n` steps and
    /// half of them. It bounds the error of `n` from above where the rule converges at all. So that what the curve does between
    /// the steps is not missed, it is never less than the relative error of the cavity's mean volume by the same steps (root mean
    /// square over the views), which the curve alone tells.
    pub quadrature_error: Option<f64>,
    /// Rays cast and skipped.
    pub rays: RayCounters,
}

/// Takes all views of an acquisition; `activity` is that of the cavity and of the wall.
///
/// Line integrals are those of the exact body, no voxels are involved. Equal shapes are solved
/// once; the result has the same bits for any number of threads. `progress` is called with the
/// number of views done.
///
/// # Errors
/// [`PhantomError::Count`] or [`PhantomError::Odd`] unless the number of steps is even and at most 65536;
/// [`PhantomError::OutOfRange`] for a time, phase or activity without sense; what solving the shapes can return.
pub fn acquire(
    heart: &Heart,
    camera: &Camera,
    cycle: &Cycle,
    acquisition: Acquisition,
    activity: impl Into<Activity>,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Sinograms, PhantomError> {
    let scan = Scan::plain(heart, camera, cycle, acquisition, activity.into());
    scan.rows(0..camera.n_views(), 0..camera.n_rows(), progress)
}

/// An acquisition of which any part can be taken, each with the bits that it has in the whole.
pub(crate) struct Scan<'a> {
    pub(crate) heart: &'a Heart,
    pub(crate) camera: &'a Camera,
    pub(crate) cycle: &'a Cycle,
    pub(crate) acquisition: Acquisition,
    pub(crate) activity: Activity,
    pub(crate) attenuation: Option<Attenuation>,
    pub(crate) defects: &'a [Defect],
    pub(crate) background: Option<Background>,
    /// How far the defects' layers may be from where they are, cm.
    pub(crate) tolerance: f64,
}

impl<'a> Scan<'a> {
    /// The heart alone: nothing attenuates, nothing is around it, its wall is whole.
    pub(crate) fn plain(
        heart: &'a Heart,
        camera: &'a Camera,
        cycle: &'a Cycle,
        acquisition: Acquisition,
        activity: Activity,
    ) -> Self {
        Self {
            heart,
            camera,
            cycle,
            acquisition,
            activity,
            attenuation: None,
            defects: &[],
            background: None,
            tolerance: 0.0,
        }
    }
}

impl Scan<'_> {
    /// Some rows of some views, `[view][row][bin]`.
    pub(crate) fn rows(
        &self,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        self.acquisition.validate(self.cycle, self.camera)?;
        self.activity.validate()?;
        let plans = self.plans(views.clone());
        let averaged = plans.iter().any(|plan| plan.phases.len() > 1);
        let volume_error = if averaged {
            let errors = self.volume_errors(views.clone(), &plans);
            let squares: f64 = errors.iter().map(|error| error * error).sum();
            (squares / errors.len() as f64).sqrt()
        } else {
            0.0
        };
        let gains: Vec<f64> = (plans.iter().flat_map(|plan| &plan.nodes))
            .map(|node| node.gain)
            .collect();
        // All of them at once, in parallel; below they are only looked up.
        self.heart.shapes(&gains)?;
        let placed = self.placed(&gains)?;

        let len = rows.len() * self.camera.n_bins();
        let mut samples = vec![0.0f32; views.len() * len];
        let done = AtomicUsize::new(0);
        let taken: Vec<View> = samples
            .par_chunks_mut(len.max(1))
            .zip(views.into_par_iter())
            .enumerate()
            .map(|(k, (image, view_idx))| {
                let nodes = &plans[k % plans.len()].nodes;
                let view = self.view(view_idx, nodes, &placed, rows.clone(), image)?;
                progress(1 + done.fetch_add(1, Ordering::Relaxed));
                Ok(view)
            })
            .collect::<Result<_, PhantomError>>()?;

        // Summed in the order of the views, whatever thread took them.
        let total = taken.iter().fold(View::default(), |sum, view| View {
            rays: sum.rays + view.rays,
            square: sum.square + view.square,
            difference: sum.difference + view.difference,
        });
        Ok(Sinograms {
            samples,
            distinct_phases: count_distinct(plans.iter().flat_map(|plan| &plan.phases)),
            distinct_shapes: count_distinct(&gains),
            quadrature_error: averaged.then(|| {
                if total.square > 0.0 {
                    (total.difference / total.square).sqrt().max(volume_error)
                } else {
                    0.0
                }
            }),
            rays: total.rays,
        })
    }

    /// The defects in each of the shapes, all of which the background surrounds: from it they are taken away.
    pub(crate) fn placed(&self, gains: &[f64]) -> Result<Placed, PhantomError> {
        if let Some(background) = &self.background {
            background.check_surrounds(&self.heart.shapes(gains)?)?;
        }
        Placed::new(self.heart, self.defects, self.tolerance, gains)
    }

    /// Where something is taken away that is there, as much as there is, rounding may leave less than nothing.
    pub(crate) fn no_negatives(&self, samples: &mut [f32]) {
        if self.background.is_some() || !self.defects.is_empty() {
            samples
                .iter_mut()
                .for_each(|sample| *sample = sample.max(0.0));
        }
    }

    /// The quadrature of each view, or one for all of them.
    fn plans(&self, views: Range<usize>) -> Vec<Nodes> {
        let nodes = |view_idx| self.acquisition.nodes(self.cycle, self.camera, view_idx);
        if self.acquisition.same_for_all_views(self.camera) {
            vec![nodes(views.start)]
        } else {
            views.map(nodes).collect()
        }
    }

    /// The view whose mean volume its steps miss most.
    pub(crate) fn hardest_view(&self) -> usize {
        let views = 0..self.camera.n_views();
        let errors = self.volume_errors(views.clone(), &self.plans(views));
        let larger = |a: &usize, b: &usize| errors[*a].total_cmp(&errors[*b]);
        (0..errors.len()).max_by(larger).unwrap_or(0)
    }

    /// Relative error of the mean volume of the cavity in each of the views, or in one for all of them.
    fn volume_errors(&self, views: Range<usize>, plans: &[Nodes]) -> Vec<f64> {
        let known = MeanVolume::new(self.cycle);
        let of = (self.cycle, self.camera);
        (views.zip(plans))
            .map(|(view_idx, plan)| known.error(&self.acquisition, of, view_idx, plan))
            .collect()
    }

    /// Each of the shapes with its share of the first view's time, equal ones merged.
    pub(crate) fn exposures(&self) -> Result<Vec<(Arc<HeartShape>, f64)>, PhantomError> {
        self.acquisition.validate(self.cycle, self.camera)?;
        let mut merged: Vec<(f64, f64)> = Vec::new();
        for node in self.acquisition.nodes(self.cycle, self.camera, 0).nodes {
            let weight = node.weights[0] + node.weights[1];
            match merged.iter_mut().find(|(gain, _)| *gain == node.gain) {
                Some((_, sum)) => *sum += weight,
                None => merged.push((node.gain, weight)),
            }
        }
        let gains: Vec<f64> = merged.iter().map(|(gain, _)| *gain).collect();
        let weights = merged.iter().map(|(_, weight)| *weight);
        Ok(self
            .heart
            .shapes(&gains)?
            .into_iter()
            .zip(weights)
            .collect())
    }

    fn view(
        &self,
        view_idx: usize,
        nodes: &[Node],
        placed: &Placed,
        rows: Range<usize>,
        image: &mut [f32],
    ) -> Result<View, PhantomError> {
        let mut view = View::default();
        let averaged = nodes.iter().any(|node| node.weights[1] > 0.0);
        let mut odd = vec![0.0f32; if averaged { image.len() } else { 0 }];
        for node in nodes {
            let shape = &self.heart.shapes(&[node.gain])?[0];
            let theta = self.camera.angle(view_idx, node.share);
            let rays = self.camera.detector().rays(theta)?.rows(rows.clone())?;
            let (body, [cavity, wall]) = (shape.body(), self.activity.of(shape));
            // The torso is everywhere, the heart what differs from it.
            let around = self
                .background
                .map_or(0.0, |background| background.concentration);
            let activity = [cavity - around, wall - around];
            let attenuator = (self.attenuation.as_ref())
                .map(|medium| medium.of(body))
                .transpose()?;
            for (half, &weight) in node.weights.iter().enumerate() {
                if weight > 0.0 {
                    let target = if half == 0 { &mut *image } else { &mut odd[..] };
                    if let Some(background) = &self.background {
                        let (torso, amount) = (background.torso, weight * background.concentration);
                        torso.project_add(&rays, amount, attenuator.as_ref(), target)?;
                    }
                    let mut done = match &attenuator {
                        None => body.project_add(&rays, &activity, weight, target)?,
                        Some(medium) => {
                            body.project_attenuated_add(&rays, &activity, weight, medium, target)?
                        }
                    };
                    for (sector, factor) in placed.of(shape) {
                        let difference = weight * factor * wall;
                        done = done
                            + sector.project_add(&rays, difference, attenuator.as_ref(), target)?;
                    }
                    view.rays = view.rays + done;
                }
            }
        }
        // The rule is the sum of its halves, the one with half the steps twice the even half.
        for (even, odd) in image.iter_mut().zip(&odd) {
            view.difference += f64::from(odd - *even).powi(2);
            *even += odd;
            view.square += f64::from(*even).powi(2);
        }
        self.no_negatives(image);
        Ok(view)
    }
}

/// What one view adds to the totals.
#[derive(Default)]
struct View {
    rays: RayCounters,
    /// Sum of the squared samples.
    square: f64,
    /// Sum of the squared differences from the rule with half the steps.
    difference: f64,
}

fn count_distinct<'a>(values: impl IntoIterator<Item = &'a f64>) -> usize {
    (values.into_iter())
        .map(|v| v.to_bits())
        .collect::<BTreeSet<_>>()
        .len()
}
