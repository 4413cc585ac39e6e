//! Computation of projections: any part of an acquisition, bitwise identical to that part of the whole.
//!
//! The projection sets of all gates are sums over the same images: each is projected once and added to every set with the weight of the quadrature over
//! time ([`TimeRule`](super::time_rule)). Views are computed in groups whose shapes fit the memory of the heart ([`Heart::with_memory`](crate::Heart::with_memory)),
//! and where one view needs more, its nodes in batches; the sums are formed in the same order in any case.

use super::acquisition::Sinograms;
use super::camera::RowsOfViews;
use super::gates::add_to_gates;
use super::groups::{Group, for_groups};
use super::nodes::Node;
use super::part_view;
use super::view_error::{Errors, Total};
use super::whole::{Projected, Scan};
use crate::error::{PhantomError, zeros};
use crate::model::Placed;
use crate::observer::check_stop;
use crate::{HeartShape, Observer, Rotation};
use rayon::prelude::*;
use revolve_voxel::{Image, RayCounters, Shown};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::{ControlFlow, Range};
use std::sync::{Arc, Mutex, PoisonError};

/// An unfinished view of all sets.
struct View<'a> {
    view_idx: usize,
    plan: usize,
    rays: RayCounters,
    sets: Vec<Sums<'a>>,
}

/// An unfinished view of one set.
struct Sums<'a> {
    /// The even half of the rule; at the end the complete view.
    even: &'a mut [f32],
    /// The odd half, if there is any.
    odd: Vec<f32>,
    errors: Errors,
}

/// The shapes of a batch of nodes.
struct Shapes<'a> {
    by_gain: BTreeMap<u64, &'a Arc<HeartShape>>,
    placed: Placed,
}

impl<'a> Scan<'a> {
    /// Some rows of some views, `[view][row][bin]`.
    pub(crate) fn rows(
        &self,
        part: RowsOfViews,
        progress: Observer<'_, usize>,
    ) -> Result<Sinograms, PhantomError> {
        let mut samples = zeros("samples of the projections", self.len(&part))?;
        let sets = std::slice::from_ref(self);
        let mut totals = [Total::default()];
        Self::sets_into(sets, part, &mut samples, &mut totals, progress)?;
        Ok(Sinograms {
            samples,
            ..self.without_samples(&totals[0])
        })
    }

    /// Samples of some rows of some views.
    fn len(&self, (views, rows): &RowsOfViews) -> usize {
        views.len() * rows.len() * self.camera.n_bins()
    }

    /// Some rows of some views of several projection sets, at least one, `[set][view][row][bin]`; the sets differ in their gates alone. Errors are added
    /// to the totals of the sets, and counters to the first.
    pub(crate) fn sets_into(
        sets: &[Self],
        part: RowsOfViews,
        samples: &mut [f32],
        totals: &mut [Total],
        progress: Observer<'_, usize>,
    ) -> Result<(), PhantomError> {
        for set in sets {
            (set.acquisition).validate(set.cycle, set.camera, set.camera.rotation())?;
        }
        let one = &sets[0];
        let each = one.len(&part);
        let (views, rows) = part;
        let len = rows.len() * one.camera.n_bins();
        for view in samples.chunks_mut(len.max(1)) {
            simd_set::checkpoint();
            view.fill(0.0);
        }
        let mut images: Vec<_> = (samples.chunks_mut(each.max(1)))
            .map(|set| set.chunks_mut(len.max(1)))
            .collect();
        // Locked during the call, so that threads report their numbers in ascending order.
        let done = Mutex::new(0);
        let taken = || {
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            *done += 1;
            progress(*done)
        };
        for_groups(sets, views.clone(), totals, |group, totals| {
            let mut under_way: Vec<View> = (group.views.clone().enumerate())
                .map(|(k, view_idx)| View {
                    view_idx,
                    plan: k % group.plans.len(),
                    rays: RayCounters::default(),
                    sets: (images.iter_mut())
                        .map(|views| Sums::new(views.next().unwrap_or_default()))
                        .collect(),
                })
                .collect();
            let batches = group.batches(one.heart.most_shapes());
            for (k, batch) in batches.iter().enumerate() {
                let last = k + 1 == batches.len();
                let units = views.len() * batches.len();
                one.take_batch(&group, batch, &mut under_way, (&rows, last, units), &taken)?;
            }
            // Summed in the order of the views, independent of threads.
            for view in &under_way {
                totals[0].rays = totals[0].rays + view.rays;
                for (total, sums) in totals.iter_mut().zip(&view.sets) {
                    total.view(&sums.errors);
                }
            }
            Ok(())
        })
    }

    /// Returns errors and counters of projections.
    pub(crate) fn without_samples(&self, total: &Total) -> Sinograms {
        let bins = (self.imaging).map_or([0.0; 2], |own| [own.options.error, own.tails()]);
        Sinograms {
            samples: Vec::new(),
            distinct_shapes: total.gains.len(),
            view_error: total.view_error(self.acquisition.interpolation, bins),
            rays: total.rays,
        }
    }

    /// Adds a batch of nodes to some views, each one of the `units` of work, and ends the views with the last.
    fn take_batch(
        &self,
        group: &Group,
        batch: &Range<usize>,
        views: &mut [View<'_>],
        (rows, last, units): (&Range<usize>, bool, usize),
        done: &(impl Fn() -> ControlFlow<()> + Sync),
    ) -> Result<(), PhantomError> {
        let nodes = |plan: usize| {
            let nodes = &group.plans[plan];
            &nodes[batch.start..batch.end.min(nodes.len())]
        };
        let gains = (0..group.plans.len()).flat_map(|plan| nodes(plan).iter().map(|n| n.gain));
        let distinct: BTreeSet<u64> = gains.map(f64::to_bits).collect();
        let gains: Vec<f64> = distinct.iter().map(|bits| f64::from_bits(*bits)).collect();
        // All shapes are solved at once, in parallel; below they are only looked up.
        let solved = self.heart.shapes(&gains)?;
        let shapes = Shapes {
            by_gain: distinct.into_iter().zip(&solved).collect(),
            placed: self.placed(&solved)?,
        };
        views.par_iter_mut().try_for_each(|view| {
            simd_set::checkpoint();
            if self.projected != Projected::Surroundings {
                // Images from one angle share their plan.
                let mut known = None;
                let states = || nodes(view.plan).chunk_by(|a, b| a.key() == b.key());
                let units = units * states().count();
                for nodes in states() {
                    self.add_heart(view, nodes, &shapes, rows, &mut known)?;
                    simd_set::unit(units);
                }
            } else {
                simd_set::unit(units);
            }
            if last {
                self.add_surroundings(view, &group.plans[view.plan], rows)?;
                self.finish(view, rows)?;
                check_stop(done())?;
            }
            Ok(())
        })
    }

    /// Adds the heart in one shape to the sets of some nodes, which differ in their sets alone. `known` is the plan of images from the last angle.
    fn add_heart(
        &self,
        view: &mut View<'_>,
        nodes: &[Node],
        shapes: &Shapes<'_>,
        rows: &Range<usize>,
        known: &mut Option<(f64, revolve_voxel::View<'a>)>,
    ) -> Result<(), PhantomError> {
        let node = &nodes[0];
        let shape = shapes.by_gain[&node.gain.to_bits()];
        let body = shape.body().with_pose(self.pose(node.breath)?);
        let heart = (&**shape, &body, shapes.placed.of(shape));
        let weights: Vec<(usize, [f64; 2])> = nodes.iter().map(|n| (n.set, n.weights)).collect();
        let theta = self.camera.angle(view.view_idx, node.share);
        let at = (view.view_idx, theta);
        let Some(imaging) = self.imaging else {
            return view.add_lines(&weights, |weight, image| {
                self.project(heart, at, rows, weight, image)
            });
        };
        let plan = match known {
            Some((angle, plan)) if *angle == theta => plan,
            _ => {
                let plan = self.part_view(imaging, at, Shown::Change)?;
                &known.insert((theta, plan)).1
            }
        };
        let image = plan.image(&self.assembly(heart)?, Shown::Change, rows.clone())?;
        view.add_image(&image, &weights, rows.start, self.camera.n_bins());
        Ok(())
    }

    /// Adds the surroundings of the heart; they are the same for all shapes and projected once for all nodes at the same angle.
    fn add_surroundings(
        &self,
        view: &mut View<'_>,
        nodes: &[Node],
        rows: &Range<usize>,
    ) -> Result<(), PhantomError> {
        if !self.has_surroundings() || self.keeps_surroundings() {
            return Ok(());
        }
        let mut by_share: BTreeMap<u64, BTreeMap<usize, [f64; 2]>> = BTreeMap::new();
        for node in nodes {
            let of_sets = by_share.entry(node.share.to_bits()).or_default();
            let sum = of_sets.entry(node.set).or_default();
            *sum = [0, 1].map(|half| sum[half] + node.weights[half]);
        }
        for (share, weights) in by_share {
            let theta = self.camera.angle(view.view_idx, f64::from_bits(share));
            let at = (view.view_idx, theta);
            let weights: Vec<_> = weights.into_iter().collect();
            match self.imaging {
                None => view.add_lines(&weights, |weight, image| {
                    self.project_surroundings(at, rows, weight, image)
                })?,
                Some(imaging) => {
                    let plan = self.part_view(imaging, at, Shown::Organs)?;
                    let alone = self.surroundings.alone();
                    let image = plan.image(&alone, Shown::Organs, rows.clone())?;
                    view.add_image(&image, &weights, rows.start, self.camera.n_bins());
                }
            }
        }
        Ok(())
    }

    /// Sums both halves of the rule and estimates the errors.
    fn finish(&self, view: &mut View<'_>, rows: &Range<usize>) -> Result<(), PhantomError> {
        let fixed = match self.imaging {
            Some(imaging) if self.has_surroundings() && self.keeps_surroundings() => {
                Some(self.fixed(imaging, view.view_idx)?)
            }
            _ => None,
        };
        for Sums { even, odd, errors } in &mut view.sets {
            errors.add_halves(even, &std::mem::take(odd));
            if let Some(fixed) = fixed {
                let own = &fixed.samples[rows.start * self.camera.n_bins()..];
                (even.iter_mut().zip(own)).for_each(|(sample, fixed)| *sample += fixed);
                errors.line += fixed.largest_line;
            }
            self.no_negatives(even);
            errors.add_samples(even);
        }
        Ok(())
    }

    /// The keys of the images of a view.
    pub(crate) fn images(&self, view_idx: usize) -> Vec<[u64; 3]> {
        let nodes = self.quadrature().view(view_idx).nodes;
        nodes.iter().map(Node::key).collect()
    }

    /// The view whose samples need the most nodes.
    pub(crate) fn hardest_view(&self) -> usize {
        if self.acquisition.same_for_all_views(self.cycle, self.camera) {
            return 0;
        }
        let quadrature = self.rule_of_states();
        let spread = |view_idx| quadrature.view(view_idx).spread();
        let hardness: Vec<f64> = (0..self.camera.n_views()).map(spread).collect();
        let larger = |a: &usize, b: &usize| hardness[*a].total_cmp(&hardness[*b]);
        (0..hardness.len()).max_by(larger).unwrap_or(0)
    }

    /// Collects the gains of all views, until there are `most`.
    pub(crate) fn collect_gains(&self, gains: &mut BTreeSet<u64>, most: usize) {
        let quadrature = self.rule_of_states();
        for view_idx in 0..self.n_plans() {
            if gains.len() >= most {
                break;
            }
            gains.extend(quadrature.view(view_idx).gains().map(f64::to_bits));
        }
    }

    /// The respiratory fraction of each view, averaged over its time.
    pub(crate) fn breaths_of_views(&self) -> Vec<f64> {
        let states = self.rule_of_states();
        let views = 0..self.camera.n_views();
        views.map(|view_idx| states.means(view_idx)[1]).collect()
    }

    /// Volume gain and respiratory fraction, averaged over the time of all views.
    pub(crate) fn means(&self) -> Result<[f64; 2], PhantomError> {
        (self.acquisition).validate(self.cycle, self.camera, Rotation::StepAndShoot)?;
        let (states, n_views) = (self.rule_of_states(), self.n_plans());
        let sums = (0..n_views).map(|view_idx| states.means(view_idx));
        let sums = sums.fold([0.0; 2], |[g, b], [gain, breath]| [g + gain, b + breath]);
        Ok(sums.map(|sum| sum / n_views as f64))
    }

    /// Number of views with nodes of their own.
    pub(super) fn n_plans(&self) -> usize {
        if self.acquisition.same_for_all_views(self.cycle, self.camera) {
            1
        } else {
            self.camera.n_views()
        }
    }
}

impl<'a> Sums<'a> {
    fn new(even: &'a mut [f32]) -> Self {
        Self {
            even,
            odd: Vec::new(),
            errors: Errors::default(),
        }
    }

    /// Both halves of the rule, of which the second one may be missing.
    fn halves(&mut self, [even, odd]: [f64; 2]) -> impl Iterator<Item = (f64, &mut [f32])> {
        if odd != 0.0 {
            self.odd.resize(self.even.len(), 0.0);
        }
        let halves = [(even, &mut *self.even), (odd, &mut self.odd[..])];
        halves.into_iter().filter(|(weight, _)| *weight != 0.0)
    }
}

impl View<'_> {
    /// Adds the weighted result of `project` to an image of lines; `project` is called once.
    fn add_lines(
        &mut self,
        weights: &[(usize, [f64; 2])],
        project: impl FnOnce(f64, &mut [f32]) -> Result<RayCounters, PhantomError>,
    ) -> Result<(), PhantomError> {
        let rays = match *weights {
            // Added to the sum without a buffer.
            [(set, weights @ ([_, 0.0] | [0.0, _]))] => {
                let mut halves = self.sets[set].halves(weights);
                match halves.next() {
                    Some((weight, target)) => project(weight, target)?,
                    None => RayCounters::default(),
                }
            }
            _ => {
                let mut one = vec![0.0f32; self.sets[0].even.len()];
                let rays = project(1.0, &mut one)?;
                let mut weights = weights.iter().peekable();
                let (mut uses, mut targets) = (Vec::new(), Vec::new());
                for (set, sums) in self.sets.iter_mut().enumerate() {
                    if let Some((_, weights)) = weights.next_if(|(of, _)| *of == set) {
                        for (weight, target) in sums.halves(*weights) {
                            uses.push((targets.len(), weight));
                            targets.push(target);
                        }
                    }
                }
                add_to_gates(&one, &uses, &mut targets);
                rays
            }
        };
        self.rays = self.rays + rays;
        Ok(())
    }

    /// Adds an image to the sets, each with its weights; `first` is the first row of the samples.
    fn add_image(
        &mut self,
        image: &Image,
        weights: &[(usize, [f64; 2])],
        first: usize,
        n_bins: usize,
    ) {
        self.rays = self.rays + image.rays;
        for (set, weights) in weights {
            let sums = &mut self.sets[*set];
            let weight = weights[0] + weights[1];
            sums.errors.line += weight.abs() * image.largest_line;
            for (weight, target) in sums.halves(*weights) {
                part_view::add(image, weight, (target, first, n_bins));
            }
        }
    }
}

/// At most so many evenly spaced views of all.
pub(crate) fn evenly(most: usize, n_views: usize) -> impl Iterator<Item = usize> {
    let n = most.min(n_views);
    (0..n).map(move |k| k * n_views / n)
}
