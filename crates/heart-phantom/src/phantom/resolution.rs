//! The resolution at which samples are computed: sub-bins and rays, refined until the tolerance is met.

use super::memory::check_memory;
use super::{Phantom, once};
use crate::error::PhantomError;
use crate::scan::{
    Acquisition, Averages, BinSample, Depth, Facing, LATTICES, Projected, Rotation, Scan, SubBins,
};
use radon::Collimator;
use revolve_voxel::{Capsule, OrganShape, Organs};
use std::collections::BTreeSet;
use std::f64::consts::LN_2;

/// Sub-bins along the larger side of a bin, with the lattice of rays of a sub-bin that an edge crosses.
const LADDER: [[usize; 2]; 8] = [
    [1, 2],
    [2, 2],
    [3, 2],
    [4, 2],
    [6, 2],
    [8, 3],
    [12, 3],
    [16, 4],
];
/// The resolution at which time steps are tried.
const PROBE: Level = ([1; 2], 2);
/// Views in which resolutions are compared, besides the one nearest to its collimator.
const VIEWS_TRIED: usize = 7;
/// Smallest assumed ratio of the error of a resolution to that of the next coarser one.
const LEAST_RATIO: f64 = 0.4;
/// Errors of untested views relative to those of tested ones, and the threshold of edges relative to the tolerance: with a response, for objects larger
/// than a bin, third differences of both signs are averaged over many sub-bins; otherwise edges differ more between views.
const BLURRED: [f64; 2] = [1.2, 1.0];
const UNBLURRED: [f64; 2] = [1.8, 0.25];
/// The fraction of the tolerance for what surrounds the heart, where it has a resolution of its own.
const SURROUNDINGS: f64 = 0.3;
/// Sub-bins below this fraction of the narrowest response alias by no more than `ALIAS (h / sigma)^(5/2)` of the largest sample.
const NARROW: f64 = 0.25;
const ALIAS: f64 = 0.01;
/// Smallest number of sub-bins across a heart or organ whose edges are detected by third differences.
const ACROSS: f64 = 2.5;

/// The resolution of bin averages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Resolution {
    /// Sub-bins per bin, along bins and along rows.
    pub sub_bins: [usize; 2],
    /// Rays in a sub-bin that contains an edge; other sub-bins have one ray.
    pub rays: usize,
}

/// A resolution: sub-bins of a bin, and the index of the lattice.
type Level = ([usize; 2], usize);

impl Phantom {
    /// Returns the resolution of bin averages; `None` for line integrals ([`BinSample::Centres`]). The first call compares resolutions in up to
    /// eight views of the heart at end-systole and end-diastole.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no resolution meets the tolerance of the scene; errors of the solver.
    pub fn resolution(&self) -> Result<Option<Resolution>, PhantomError> {
        let sub_bins = self.depth()?.map(|depth| &depth.sub_bins);
        Ok(sub_bins.and_then(|sub_bins| {
            Some(Resolution {
                sub_bins: sub_bins.counts,
                rays: sub_bins.averages.as_ref()?.lattice.len(),
            })
        }))
    }

    /// Returns response and bin averages; `None` if samples are line integrals.
    pub(super) fn depth(&self) -> Result<Option<&Depth>, PhantomError> {
        Ok(once(&self.depth, || self.make_depth())?.as_ref())
    }

    /// Returns the same if it is known.
    pub(super) fn depth_known(&self) -> Option<&Depth> {
        self.depth.get().and_then(Option::as_ref)
    }

    fn make_depth(&self) -> Result<Option<Depth>, PhantomError> {
        let target = self.parts.tolerances().bins;
        match self.parts.samples() {
            BinSample::Centres => self.depth_on(SubBins::default()),
            BinSample::Averages if self.has_fixed_surroundings() => {
                let of = |projected, part: f64| {
                    self.depth_on(self.find_sub_bins(projected, part * target)?)
                };
                let heart = of(Projected::Heart, 1.0 - SURROUNDINGS)?;
                let surroundings = of(Projected::Surroundings, SURROUNDINGS)?;
                Ok(match (heart, surroundings) {
                    (Some(heart), Some(surroundings)) => {
                        Some(heart.with_surroundings(surroundings))
                    }
                    _ => None,
                })
            }
            BinSample::Averages => self.depth_on(self.find_sub_bins(Projected::All, target)?),
        }
    }

    /// Whether what surrounds the heart is projected once for all times.
    fn has_fixed_surroundings(&self) -> bool {
        let scan = self.scan(self.camera(), 0, Acquisition::still(0.0));
        scan.has_surroundings() && self.camera().rotation() == Rotation::StepAndShoot
    }

    /// The response on one sub-bin per bin, for estimates; `None` where samples are line integrals, or averages without a response.
    pub(super) fn probe_depth(&self) -> Result<Option<Depth>, PhantomError> {
        let averages = self
            .depth()?
            .and_then(|depth| depth.sub_bins.averages.as_ref());
        match (averages, self.response()?.variance(f64::MAX) > 0.0) {
            (Some(averages), true) => self.depth_on(self.sub_bins(&PROBE, averages.threshold)?),
            _ => self.depth_on(SubBins::default()),
        }
    }

    /// Returns the response of the detector: that of the collimator, or a blur of constant width, or zero width.
    pub(super) fn response(&self) -> Result<Collimator, PhantomError> {
        let blur = |fwhm: f64| Collimator::new(0.0, 0.0, fwhm / (8.0 * LN_2).sqrt());
        Ok(match (self.parts.collimator, self.scene().blur) {
            (Some(collimator), _) => collimator,
            (None, Some(settings)) => blur(settings.fwhm)?,
            (None, None) => Collimator::default(),
        })
    }

    fn depth_on(&self, sub_bins: SubBins) -> Result<Option<Depth>, PhantomError> {
        let response = self.response()?;
        if response.variance(f64::MAX) == 0.0 && sub_bins.averages.is_none() {
            return Ok(None);
        }
        let views = match self.parts.collimator {
            Some(_) => {
                if let Some((view_idx, Facing { radius, body, .. })) = self.inside()? {
                    return Err(PhantomError::DetectorInside {
                        view_idx,
                        radius,
                        needed: body,
                    });
                }
                self.facing()?.to_vec()
            }
            None => vec![Facing::default(); self.camera().n_views()],
        };
        let [side, end] = self.extent()?;
        // Objects beyond all rows are blurred into them from both sides.
        let endless = self.scene().background.is_some();
        let end = if endless { f64::INFINITY } else { end };
        let response = (response, self.parts.tolerances().depth);
        let depth = Depth::new(response, self.camera(), sub_bins, views, [side, end])?;
        let threads = rayon::current_num_threads() as u64;
        check_memory(2 * threads * depth.view_bytes() as u64)?;
        Ok(Some(depth))
    }

    /// Returns the difference between line integrals and bin averages in the first view, if bins are wider than half the response or than the
    /// cavity: larger pitch and FWHM of the response in cm, and the difference relative to the largest sample.
    pub(super) fn aliasing(&self) -> Result<Option<[f64; 3]>, PhantomError> {
        let pitch = self.camera().detector().pitch();
        let side = pitch[0].max(pitch[1]);
        let fwhm = self.narrowest(Projected::All)? * (8.0 * LN_2).sqrt();
        let narrow = fwhm > 0.0 && side > 0.5 * fwhm;
        if self.parts.samples() == BinSample::Averages
            || !(narrow || side > self.smallest_part()?)
        {
            return Ok(None);
        }
        let first = BTreeSet::from([0]);
        let lines = self.images(&first, &SubBins::default(), Projected::All)?;
        let averages = self.sub_bins(&([3; 2], LATTICES.len() - 4), 0.0)?;
        let averages = self.images(&first, &averages, Projected::All)?;
        let largest = averages
            .iter()
            .flatten()
            .fold(0.0f32, |most, v| most.max(*v));
        Ok(Some([
            side,
            fwhm,
            difference(&lines, &averages) / f64::from(largest),
        ]))
    }

    /// Refines until two resolutions differ by no more than the tolerance allows.
    fn find_sub_bins(&self, projected: Projected, target: f64) -> Result<SubBins, PhantomError> {
        let (levels, alias) = self.levels(projected)?;
        let views = self.views_tried()?;
        let largest = self.largest_sample(&views)?;
        let side = self.camera().detector().pitch();
        let is_large = self.smallest_part()? > side[0].max(side[1]);
        let [other_views, edge] = match self.narrowest(projected)? > 0.0 && is_large {
            true => BLURRED,
            false => UNBLURRED,
        };
        let threshold = edge * target * largest;
        let try_level = |level: &Level| {
            let sub_bins = self.sub_bins(level, threshold)?;
            let images = self.images(&views, &sub_bins, projected)?;
            Ok::<_, PhantomError>((sub_bins, images))
        };
        let mut before = try_level(&levels[0])?;
        for pair in levels.windows(2) {
            let (after, ratio) = (try_level(&pair[1])?, ratio(&pair[0], &pair[1]));
            let off = match largest > 0.0 {
                true => difference(&before.1, &after.1) / largest,
                false => 0.0,
            };
            let coarse = other_views / (1.0 - ratio) * off;
            let finest = Some(&pair[1]) == levels.last();
            for (error, (sub_bins, _), last) in
                [(coarse, &before, false), (ratio * coarse, &after, finest)]
            {
                let error = error + alias;
                if error <= target || (last && !self.parts.is_tolerance_given()) {
                    return Ok(SubBins {
                        error,
                        ..sub_bins.clone()
                    });
                }
                if last {
                    return Err(PhantomError::Tolerance {
                        term: "averages over bins",
                        reached: error,
                        tolerance: target,
                    });
                }
            }
            before = after;
        }
        Ok(before.0)
    }

    fn sub_bins(&self, (counts, lattice): &Level, threshold: f64) -> Result<SubBins, PhantomError> {
        let pitch = self.camera().detector().pitch();
        let side = [0, 1].map(|axis| pitch[axis] / counts[axis] as f64);
        let mut dense = None;
        if self.smallest_part()? < ACROSS * side[0].max(side[1]) {
            let margin = 0.5 * side[0].hypot(side[1]);
            dense = Capsule::around(&self.outermost()?)
                .map(|capsule| capsule.with_margin(margin))
                .transpose()?;
        }
        Ok(SubBins {
            counts: *counts,
            averages: Some(Averages::new(*lattice, threshold, dense)),
            error: 0.0,
        })
    }

    /// The resolutions to try, coarsest first, and what all of them alias.
    fn levels(&self, projected: Projected) -> Result<(Vec<Level>, f64), PhantomError> {
        let pitch = self.camera().detector().pitch();
        let side = pitch[0].max(pitch[1]);
        let counts = |k: usize| {
            let of = |pitch: f64| (k as f64 * pitch / side - 1e-9).ceil().max(1.0) as usize;
            pitch.map(of)
        };
        let organs = match projected {
            Projected::All | Projected::Surroundings => self.parts.organs.as_ref(),
            Projected::Heart => None,
        };
        let organs = organs.into_iter().flat_map(Organs::as_slice);
        let smallest = organs.fold(f64::INFINITY, |least: f64, organ| match organ.shape {
            OrganShape::Ellipsoid(ellipsoid) => {
                ellipsoid.semi_axes().into_iter().fold(least, f64::min)
            }
            OrganShape::Cylinder(cylinder) => {
                cylinder.semi_axes().into_iter().fold(least, f64::min)
            }
            _ => least,
        });
        let least = (0.5 * ACROSS * side / smallest).ceil().clamp(1.0, 16.0) as usize;
        let narrowest = self.narrowest(projected)?;
        // One sub-bin a bin is enough, or there is no blur to alias: only the rays are refined.
        if side <= NARROW * narrowest || narrowest == 0.0 {
            let levels = (1..LATTICES.len()).map(|lattice| (counts(least), lattice));
            let alias = match narrowest > 0.0 {
                true => ALIAS * (side / narrowest).powf(2.5),
                false => 0.0,
            };
            return Ok((levels.collect(), alias));
        }
        let first = least.max((side / (1.6 * narrowest)) as usize);
        let mut levels: Vec<Level> = (LADDER.iter())
            .filter(|[k, _]| *k >= first)
            .map(|[k, lattice]| (counts(*k), *lattice))
            .collect();
        if levels.len() < 2 {
            levels = [6, 5]
                .map(|back| (counts(LADDER[7][0]), LATTICES.len() - back))
                .to_vec();
        }
        Ok((levels, 0.0))
    }

    /// The smallest standard deviation of the response to anything active, cm.
    fn narrowest(&self, projected: Projected) -> Result<f64, PhantomError> {
        let response = self.response()?;
        if self.parts.collimator.is_none() {
            return Ok(response.sigma(0.0));
        }
        Ok(response.sigma(self.nearest(projected)?))
    }

    /// Returns the smallest part that third differences must detect: the cavity or a defect.
    fn smallest_part(&self) -> Result<f64, PhantomError> {
        let [small, _] = self.extreme_phases();
        let shape = self.shape(small)?;
        let layers = shape.body().layers();
        let mut least = f64::INFINITY;
        for layer in layers {
            let [from, to] = layer.x_range();
            least = least.min(layer.r_max()).min(0.5 * (to - from));
        }
        let outer = &layers[layers.len() - 1];
        let [from, to] = outer.x_range();
        for defect in &self.scene().defects {
            let region = defect.region();
            let ([s0, s1], [a0, a1]) = (region.s, region.azimuths);
            let along = (s1 - s0) * 2.0 * (to - from);
            least = least.min(0.5 * along).min(0.5 * (a1 - a0) * outer.r_max());
        }
        Ok(least)
    }

    /// Returns evenly spaced views, and the view with the narrowest response.
    fn views_tried(&self) -> Result<BTreeSet<usize>, PhantomError> {
        let n = self.camera().n_views();
        let mut views: BTreeSet<usize> = (0..VIEWS_TRIED.min(n))
            .map(|k| k * n / VIEWS_TRIED.min(n))
            .collect();
        if self.parts.collimator.is_some() {
            let distance = |view: &Facing| view.radius - view.seen[1];
            let nearest = (self.facing()?.iter().enumerate())
                .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
            views.extend(nearest.map(|(view_idx, _)| view_idx));
        }
        Ok(views)
    }

    /// Returns the largest sample of these views with one ray per bin; the smaller one of two phases.
    fn largest_sample(&self, views: &BTreeSet<usize>) -> Result<f64, PhantomError> {
        let images = self.images(views, &SubBins::default(), Projected::All)?;
        let largest = |image: &Vec<f32>| image.iter().fold(0.0f32, |most, v| most.max(*v));
        let least = images.iter().map(largest).fold(f32::INFINITY, f32::min);
        Ok(f64::from(least))
    }

    /// Projects these views of the heart at end-systole and end-diastole, or at the phase of a static scene.
    fn images(
        &self,
        views: &BTreeSet<usize>,
        sub_bins: &SubBins,
        projected: Projected,
    ) -> Result<Vec<Vec<f32>>, PhantomError> {
        let depth = self.depth_on(sub_bins.clone())?;
        let camera = depth.as_ref().map_or(self.camera(), |depth| &depth.camera);
        let rows = 0..self.camera().n_rows();
        let mut images = Vec::new();
        let mut phases = self.outermost_phases();
        if projected == Projected::Surroundings {
            phases.truncate(1);
        }
        for phase in phases {
            let scan = Scan {
                depth: depth.as_ref(),
                projected,
                ..self.scan(camera, 0, Acquisition::still(phase))
            };
            let mut samples = Vec::new();
            for &view_idx in views {
                let taken = scan.rows(view_idx..view_idx + 1, rows.clone(), &|_| ())?;
                self.work.rays(taken.rays);
                samples.extend(taken.samples);
            }
            images.push(samples);
        }
        Ok(images)
    }
}

/// Returns the largest difference of two sets of images, relative to the largest sample of each.
fn difference(coarse: &[Vec<f32>], fine: &[Vec<f32>]) -> f64 {
    let pairs = coarse.iter().flatten().zip(fine.iter().flatten());
    f64::from(pairs.fold(0.0f32, |most, (a, b)| most.max((a - b).abs())))
}

/// Returns the ratio r of the error of a resolution to the error e of the coarser one: aliasing is of order 5/2 in the size of sub-bins,
/// edges are of order 3/2 in the distance of rays. The difference is (1 - r) e.
fn ratio((before, coarse): &Level, (after, fine): &Level) -> f64 {
    let side = |counts: &[usize; 2]| counts[0].max(counts[1]) as f64;
    let rays = |[n, m]: [usize; 2], lattice: usize| (n * m * LATTICES[lattice][1]) as f64;
    let aliases = match before == after {
        true => 0.0,
        false => (side(before) / side(after)).powf(2.5),
    };
    let edges = (rays(*before, *coarse) / rays(*after, *fine)).powf(0.75);
    aliases.max(edges).max(LEAST_RATIO)
}
