//! Computation of projections: any part of an acquisition, bitwise identical to that part of the whole.
//!
//! Views are computed in groups whose shapes fit the heart's memory ([`Heart::with_memory`]), and where one view needs more, its points
//! in batches; the sums are formed in the same order, whatever that memory is.

use super::acquisition::Sinograms;
use super::depth::Depth;
use super::halves::Halves;
use super::nodes::{Node, Nodes};
use super::project::{Aim, CENTRE};
use super::samples::Taking;
use super::view_error::{Errors, Total};
use super::whole::{Lasting, Scan};
use crate::HeartShape;
use crate::error::PhantomError;
use crate::model::Placed;
use rayon::prelude::*;
use revolve_voxel::RayCounters;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Samples of slabs kept for the next batch of points: 128 MB, and as much again for the coarser rule.
const MOST_SLABS_KEPT: usize = 1 << 25;
/// The errors that take blurs of their own are estimated in so many views at most, evenly among those taken.
const VIEWS_LOOKED_AT: usize = 16;
/// Points of the quadrature in a group of views: some 50 MB.
pub(crate) const MOST_NODES: usize = 1 << 20;

/// Views that are computed together.
struct Group {
    views: Range<usize>,
    /// The points of each, or one list for all of them.
    plans: Vec<Nodes>,
}

/// The rays of each sub-bin: first one through its centre, then a lattice in those that an edge crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    Centres,
    Lattice,
}

/// The shapes of a batch of points.
struct Shapes<'a> {
    by_gain: BTreeMap<u64, &'a Arc<HeartShape>>,
    placed: Placed,
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
        let n_bins = (self.depth).map_or(self.camera.n_bins(), Depth::n_bins);
        let len = rows.len() * n_bins;
        let mut samples = vec![0.0f32; views.len() * len];
        let mut total = Total::default();
        let done = AtomicUsize::new(0);
        let taken = || progress(1 + done.fetch_add(1, Ordering::Relaxed));
        let mut images = &mut samples[..];
        self.for_groups(views.clone(), |group| {
            for plan in &group.plans {
                total.plan(plan);
            }
            let (own, rest) = std::mem::take(&mut images).split_at_mut(group.views.len() * len);
            images = rest;
            let own = own.chunks_mut(len.max(1));
            let every = views.len().div_ceil(VIEWS_LOOKED_AT);
            let look = |view_idx: usize| (view_idx - views.start).is_multiple_of(every);
            self.take(
                &group,
                &rows,
                own.zip(group.views.clone().map(look)),
                &mut total,
                &taken,
            )
        })?;
        let angle = |view_idx| self.acquisition.angle(self.cycle, self.camera, view_idx);
        Ok(Sinograms {
            samples,
            angles: views.clone().map(angle).collect(),
            distinct_phases: total.phases.len(),
            distinct_shapes: total.gains.len(),
            view_error: match self.depth {
                Some(depth) => total.view_error(depth.sub_bins.error, depth.tails()),
                None => total.view_error(0.0, 0.0),
            },
            rays: total.rays,
        })
    }

    /// Hands on the views in groups whose shapes, and points, fit into memory.
    fn for_groups(
        &self,
        views: Range<usize>,
        mut take: impl FnMut(Group) -> Result<(), PhantomError>,
    ) -> Result<(), PhantomError> {
        let quadrature = self.quadrature();
        if self.acquisition.same_for_all_views(self.cycle, self.camera) {
            let plans = vec![quadrature.view(views.start)];
            return take(Group { views, plans });
        }
        let most = self.heart.most_shapes();
        let mut group = Group {
            views: views.start..views.start,
            plans: Vec::new(),
        };
        let (mut gains, mut n_nodes) = (BTreeSet::new(), 0);
        for view_idx in views {
            let plan = quadrature.view(view_idx);
            let own: BTreeSet<u64> = plan.gains().map(f64::to_bits).collect();
            let more = own.difference(&gains).count();
            if gains.len() + more > most || n_nodes + plan.nodes.len() > MOST_NODES {
                let next = Group {
                    views: view_idx..view_idx,
                    plans: Vec::new(),
                };
                take(std::mem::replace(&mut group, next))?;
                (gains, n_nodes) = (BTreeSet::new(), 0);
            }
            gains.extend(own);
            n_nodes += plan.nodes.len();
            group.views.end += 1;
            group.plans.push(plan);
        }
        take(group)
    }

    /// Takes the views of a group.
    fn take<'b>(
        &self,
        group: &Group,
        rows: &Range<usize>,
        images: impl Iterator<Item = (&'b mut [f32], bool)>,
        total: &mut Total,
        done: &(impl Fn() + Sync),
    ) -> Result<(), PhantomError> {
        let mut taking: Vec<Taking> = (images.zip(group.views.clone()).enumerate())
            .map(|(k, ((image, look), view_idx))| Taking {
                view_idx,
                plan: k % group.plans.len(),
                image,
                slabs: Vec::new(),
                odd: Vec::new(),
                flags: None,
                rays: RayCounters::default(),
                look,
                errors: Errors::default(),
            })
            .collect();
        let batches = group.batches(self.heart.most_shapes());
        let passes: &[Pass] = match self
            .depth
            .and_then(|depth| depth.sub_bins.averages.as_ref())
        {
            Some(_) => &[Pass::Centres, Pass::Lattice],
            None => &[Pass::Centres],
        };
        for part in taking.chunks_mut(self.at_once(batches.len())) {
            // The lattice needs the samples at the centres of all batches.
            let rounds: Vec<&[Pass]> = match batches.len() {
                1 => vec![passes],
                _ => passes.chunks(1).collect(),
            };
            for (round, passes) in rounds.iter().enumerate() {
                for (k, batch) in batches.iter().enumerate() {
                    let last = k + 1 == batches.len() && round + 1 == rounds.len();
                    self.take_batch(group, batch, part, rows, (passes, k == 0, last), done)?;
                }
            }
        }
        // Summed in the order of the views, whatever thread took them.
        for view in &taking {
            total.view(view.rays, &view.errors);
        }
        Ok(())
    }

    /// How many views are under way together: slabs of all of them are too much where they have to wait for another batch.
    fn at_once(&self, batches: usize) -> usize {
        match self.depth {
            Some(depth) if batches > 1 => {
                let slabs = self.camera.view_len() * depth.most_slabs();
                (MOST_SLABS_KEPT / slabs).max(1)
            }
            _ => usize::MAX,
        }
    }

    /// Adds a batch of points to some views, and ends them with the last.
    fn take_batch(
        &self,
        group: &Group,
        batch: &Range<usize>,
        taking: &mut [Taking<'_>],
        rows: &Range<usize>,
        (passes, first, last): (&[Pass], bool, bool),
        done: &(impl Fn() + Sync),
    ) -> Result<(), PhantomError> {
        let nodes = |plan: usize| {
            let nodes = &group.plans[plan].nodes;
            &nodes[batch.start..batch.end.min(nodes.len())]
        };
        let gains = (0..group.plans.len()).flat_map(|plan| nodes(plan).iter().map(|n| n.gain));
        let distinct: BTreeSet<u64> = gains.map(f64::to_bits).collect();
        let gains: Vec<f64> = distinct.iter().map(|bits| f64::from_bits(*bits)).collect();
        // All of them at once, in parallel; below they are only looked up.
        let solved = self.heart.shapes(&gains)?;
        let shapes = Shapes {
            by_gain: distinct.into_iter().zip(&solved).collect(),
            placed: self.placed(&solved)?,
        };
        taking.par_iter_mut().try_for_each(|view| {
            for pass in passes {
                if let (Pass::Lattice, true) = (pass, first) {
                    self.flag(view, rows)?;
                }
                self.add(view, nodes(view.plan), &shapes, rows, *pass)?;
            }
            if last {
                self.finish(view, rows)?;
                done();
            }
            Ok(())
        })
    }

    /// Adds some points of its quadrature to a view.
    fn add(
        &self,
        view: &mut Taking<'_>,
        nodes: &[Node],
        shapes: &Shapes<'_>,
        rows: &Range<usize>,
        pass: Pass,
    ) -> Result<(), PhantomError> {
        let averages = self
            .depth
            .and_then(|depth| depth.sub_bins.averages.as_ref());
        let places = match (pass, averages) {
            (Pass::Centres, _) | (Pass::Lattice, None) => CENTRE,
            (Pass::Lattice, Some(averages)) => &averages.lattice[..],
        };
        let mask = view.flags.clone();
        let (planes, seen_rows) = match self.depth {
            None => (Vec::new(), rows.clone()),
            Some(depth) => (depth.planes(view.view_idx), depth.rows_seen(rows)),
        };
        let Taking {
            view_idx,
            image,
            slabs,
            odd: odd_half,
            ..
        } = view;
        let view_idx = *view_idx;
        let even_half: &mut [f32] = match self.depth {
            None => image,
            Some(_) => {
                let len = seen_rows.len() * (planes.len() + 1) * self.camera.n_bins();
                slabs.resize(len, 0.0);
                slabs
            }
        };
        let aim = |share: f64| Aim {
            theta: self.camera.angle(view_idx, share),
            planes: &planes,
            rows: &seen_rows,
            places,
            mask: mask.as_ref(),
        };
        let mut halves = Halves::new(even_half, odd_half);
        // What surrounds the heart is the same for all its shapes: once for all points at the same angle.
        if self.has_surroundings() && !self.keeps_surroundings() {
            let mut shares: BTreeMap<u64, [f64; 2]> = BTreeMap::new();
            for node in nodes {
                let sum = shares.entry(node.share.to_bits()).or_default();
                *sum = [0, 1].map(|half| sum[half] + node.weights[half]);
            }
            for (share, weights) in shares {
                let aim = aim(f64::from_bits(share));
                halves.add(weights, |weight, target| {
                    self.project_surroundings(&aim, weight, target)
                })?;
            }
        }
        for node in nodes {
            let aim = aim(node.share);
            let shape = shapes.by_gain[&node.gain.to_bits()];
            let body = shape.body().standing(self.pose(node.breath)?);
            let heart = (&**shape, &body, shapes.placed.of(shape));
            let done = halves.add(node.weights, |weight, target| {
                self.project(heart, &aim, weight, target)
            })?;
            view.rays = view.rays + done;
        }
        Ok(())
    }

    /// The view that is hardest to sample.
    pub(crate) fn hardest_view(&self) -> usize {
        if self.acquisition.same_for_all_views(self.cycle, self.camera) {
            return 0;
        }
        let quadrature = self.quadrature();
        let spread = |view_idx| quadrature.view(view_idx).spread();
        let hardness: Vec<f64> = (0..self.camera.n_views()).map(spread).collect();
        let larger = |a: &usize, b: &usize| hardness[*a].total_cmp(&hardness[*b]);
        (0..hardness.len()).max_by(larger).unwrap_or(0)
    }

    /// Collects the gains of all views, until there are `most`.
    pub(crate) fn collect_gains(&self, gains: &mut BTreeSet<u64>, most: usize) {
        let quadrature = self.quadrature();
        for view_idx in 0..self.n_plans() {
            if gains.len() >= most {
                break;
            }
            gains.extend(quadrature.view(view_idx).gains().map(f64::to_bits));
        }
    }

    /// How far the breath has come in each view, in the mean over what it sees.
    pub(crate) fn breaths_of_views(&self) -> Vec<f64> {
        let quadrature = self.quadrature();
        let mean = |view_idx| {
            let nodes = quadrature.view(view_idx).nodes.into_iter();
            nodes
                .map(|node| (node.weights[0] + node.weights[1]) * node.breath)
                .sum()
        };
        (0..self.camera.n_views()).map(mean).collect()
    }

    /// Views that differ in what they see.
    fn n_plans(&self) -> usize {
        if self.acquisition.same_for_all_views(self.cycle, self.camera) {
            1
        } else {
            self.camera.n_views()
        }
    }

    /// Each volume gain and breath with its share of the time of all views, equal ones merged.
    pub(crate) fn times(&self) -> Result<Vec<Lasting>, PhantomError> {
        self.acquisition.validate(self.cycle, self.camera)?;
        let quadrature = self.quadrature();
        let n_views = self.n_plans();
        let mut times: Vec<Lasting> = Vec::new();
        let mut known = BTreeMap::new();
        for view_idx in 0..n_views {
            for node in quadrature.view(view_idx).nodes {
                let weight = (node.weights[0] + node.weights[1]) / n_views as f64;
                let state = [node.gain, node.breath].map(f64::to_bits);
                let at = *known.entry(state).or_insert(times.len());
                match times.get_mut(at) {
                    Some(lasting) => lasting.share += weight,
                    None => times.push(Lasting {
                        gain: node.gain,
                        breath: node.breath,
                        share: weight,
                    }),
                }
            }
        }
        Ok(times)
    }
}

impl Group {
    /// The points of all views at once; or, where one list of points alone needs more shapes, part by part.
    fn batches(&self, most: usize) -> Vec<Range<usize>> {
        let [plan] = &self.plans[..] else {
            return vec![Range {
                start: 0,
                end: usize::MAX,
            }];
        };
        let (mut batches, mut gains, mut start) = (Vec::new(), BTreeSet::new(), 0);
        for (k, gain) in plan.gains().enumerate() {
            if gains.len() == most && !gains.contains(&gain.to_bits()) {
                batches.push(start..k);
                (gains, start) = (BTreeSet::new(), k);
            }
            gains.insert(gain.to_bits());
        }
        batches.push(start..plan.nodes.len());
        batches
    }
}
