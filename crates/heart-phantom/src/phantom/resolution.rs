//! The resolution at which samples are computed: sub-bins and rays, refined until the tolerance is met.

use super::memory::check_memory;
use super::{Phantom, once};
use crate::error::PhantomError;
use crate::scan::{Acquisition, Averages, BinSample, Depth, Facing, LATTICES, Scan, SubBins};
use radon::Collimator;
use revolve_voxel::{Capsule, OrganShape, Organs};
use std::collections::BTreeSet;
use std::f64::consts::LN_2;

/// Sub-bins along the larger side of a bin, with the lattice of rays of a sub-bin that an edge crosses.
const LADDER: [[usize; 2]; 8] = [
    [1, 2],
    [2, 2],
    [3, 3],
    [4, 3],
    [6, 4],
    [8, 4],
    [12, 5],
    [16, 6],
];
/// Views in which resolutions are compared, besides the one nearest to its collimator.
const VIEWS_TRIED: usize = 7;
/// Smallest ratio of the error of a resolution to that of the next coarser one that is assumed.
const LEAST_RATIO: f64 = 0.4;
/// Errors in views that were not tried, relative to those that were: edges that are not blurred differ more from view to view.
const OTHER_VIEWS: f64 = 1.2;
const OTHER_VIEWS_UNBLURRED: f64 = 1.8;
/// The threshold of edges, as a fraction of the tolerance.
const EDGE: f64 = 0.25;
/// Sub-bins below this fraction of the narrowest response alias by no more than `ALIAS (h / sigma)^(5/2)` of the largest sample.
const NARROW: f64 = 0.25;
const ALIAS: f64 = 0.01;
/// Smallest number of sub-bins across a heart or an organ whose edges third differences find.
const ACROSS: f64 = 2.5;

/// The resolution at which averages over bins are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Resolution {
    /// Sub-bins of a bin, along the bins and along the rows.
    pub sub_bins: [usize; 2],
    /// Rays of a sub-bin that an edge crosses; of any other there is one.
    pub rays: usize,
}

/// One resolution: sub-bins of a bin, and the number of the lattice.
type Level = ([usize; 2], usize);

impl Phantom {
    /// The resolution at which averages over bins are computed; `None` for line integrals ([`BinSample::Centres`]). The first call finds it:
    /// it compares resolutions in up to eight views of the heart at end-systole and at end-diastole.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no resolution meets the tolerance of the scene; what solving the shapes can return.
    pub fn resolution(&self) -> Result<Option<Resolution>, PhantomError> {
        let sub_bins = self.depth()?.map(|depth| &depth.sub_bins);
        Ok(sub_bins.and_then(|sub_bins| {
            Some(Resolution {
                sub_bins: sub_bins.counts,
                rays: sub_bins.averages.as_ref()?.lattice.len(),
            })
        }))
    }

    /// The response and the averages over bins; `None` where samples are line integrals.
    pub(super) fn depth(&self) -> Result<Option<&Depth>, PhantomError> {
        Ok(once(&self.depth, || self.make_depth())?.as_ref())
    }

    /// The same, once it was made.
    pub(super) fn depth_known(&self) -> Option<&Depth> {
        self.depth.get().and_then(Option::as_ref)
    }

    fn make_depth(&self) -> Result<Option<Depth>, PhantomError> {
        let sub_bins = match self.parts.samples() {
            BinSample::Centres => SubBins::default(),
            BinSample::Averages => self.find_sub_bins()?,
        };
        self.depth_on(sub_bins)
    }

    /// The response on one sample a bin, for estimates; `None` where samples are line integrals.
    pub(super) fn coarse_depth(&self) -> Result<Option<Depth>, PhantomError> {
        self.depth_on(SubBins::default())
    }

    /// The response of the detector: that of the collimator, or of a blur of the same width at any depth; of no width without either.
    fn response(&self) -> Result<Collimator, PhantomError> {
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
        // What goes on beyond all rows is blurred into them from both sides.
        let endless = self.scene().background.is_some();
        let end = if endless { f64::INFINITY } else { end };
        let response = (response, self.parts.tolerances().depth);
        let depth = Depth::new(response, self.camera(), sub_bins, views, [side, end])?;
        let threads = rayon::current_num_threads() as u64;
        check_memory(2 * threads * depth.view_bytes() as u64)?;
        Ok(Some(depth))
    }

    /// By how much line integrals differ from averages over bins in the first view, where they may: bins are wider than half the response, or
    /// than the cavity. The larger pitch and the response's full width at half maximum (cm), and the difference relative to the largest sample.
    pub(super) fn aliasing(&self) -> Result<Option<[f64; 3]>, PhantomError> {
        let pitch = self.camera().detector().pitch();
        let side = pitch[0].max(pitch[1]);
        let fwhm = self.narrowest()? * (8.0 * LN_2).sqrt();
        let narrow = fwhm > 0.0 && side > 0.5 * fwhm;
        if self.parts.samples() == BinSample::Averages
            || !(narrow || side > self.smallest_part()?)
        {
            return Ok(None);
        }
        let first = BTreeSet::from([0]);
        let lines = self.images(&first, &SubBins::default())?;
        let averages = self.sub_bins(&([3; 2], LATTICES.len() - 4), 0.0)?;
        let averages = self.images(&first, &averages)?;
        Ok(Some([side, fwhm, difference(&lines, &averages)]))
    }

    /// Refines until two resolutions differ by no more than the tolerance allows.
    fn find_sub_bins(&self) -> Result<SubBins, PhantomError> {
        let target = self.parts.tolerances().bins;
        let (levels, alias) = self.levels()?;
        let views = self.views_tried()?;
        let largest = self.largest_sample(&views)?;
        let other_views = match self.narrowest()? > 0.0 {
            true => OTHER_VIEWS,
            false => OTHER_VIEWS_UNBLURRED,
        };
        let threshold = EDGE * target * largest;
        let try_level = |level: &Level| {
            let sub_bins = self.sub_bins(level, threshold)?;
            let images = self.images(&views, &sub_bins)?;
            Ok::<_, PhantomError>((sub_bins, images))
        };
        let mut before = try_level(&levels[0])?;
        for pair in levels.windows(2) {
            let (after, ratio) = (try_level(&pair[1])?, ratio(&pair[0], &pair[1]));
            let coarse = other_views / (1.0 - ratio) * difference(&before.1, &after.1);
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
    fn levels(&self) -> Result<(Vec<Level>, f64), PhantomError> {
        let pitch = self.camera().detector().pitch();
        let side = pitch[0].max(pitch[1]);
        let counts = |k: usize| {
            let of = |pitch: f64| (k as f64 * pitch / side - 1e-9).ceil().max(1.0) as usize;
            pitch.map(of)
        };
        let organs = self.parts.organs.iter().flat_map(Organs::as_slice);
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
        let narrowest = self.narrowest()?;
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
    fn narrowest(&self) -> Result<f64, PhantomError> {
        let response = self.response()?;
        if self.parts.collimator.is_none() {
            return Ok(response.sigma(0.0));
        }
        let near = self.facing()?.iter().map(|view| view.radius - view.seen[1]);
        Ok(response.sigma(near.fold(f64::INFINITY, f64::min)))
    }

    /// The smallest of what third differences have to find: the cavity, or a defect.
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

    /// Views evenly among all, and the one with the narrowest response.
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

    /// The largest sample of the views tried, by one ray a bin; of two phases the smaller one.
    fn largest_sample(&self, views: &BTreeSet<usize>) -> Result<f64, PhantomError> {
        let images = self.images(views, &SubBins::default())?;
        let largest = |image: &Vec<f32>| image.iter().fold(0.0f32, |most, v| most.max(*v));
        let least = images.iter().map(largest).fold(f32::INFINITY, f32::min);
        Ok(f64::from(least))
    }

    /// The views of the heart at end-systole and at end-diastole, or at the one phase of a scan.
    fn images(
        &self,
        views: &BTreeSet<usize>,
        sub_bins: &SubBins,
    ) -> Result<Vec<Vec<f32>>, PhantomError> {
        let depth = self.depth_on(sub_bins.clone())?;
        let camera = depth.as_ref().map_or(self.camera(), |depth| &depth.camera);
        let rows = 0..self.camera().n_rows();
        let mut images = Vec::new();
        for phase in self.outermost_phases() {
            let scan = Scan {
                depth: depth.as_ref(),
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

/// The largest difference of two sets of images, relative to the largest sample of each.
fn difference(coarse: &[Vec<f32>], fine: &[Vec<f32>]) -> f64 {
    let of = |(a, b): (&Vec<f32>, &Vec<f32>)| {
        let (mut off, mut largest) = (0.0f32, 0.0f32);
        for (a, b) in a.iter().zip(b) {
            off = off.max((a - b).abs());
            largest = largest.max(b.abs());
        }
        match largest > 0.0 {
            true => f64::from(off / largest),
            false => 0.0,
        }
    };
    coarse.iter().zip(fine).map(of).fold(0.0, f64::max)
}

/// The ratio of the error of a resolution to that of the one before: aliases are of order 5/2 in the size of the sub-bins, edges of order 3/2
/// in the distance of the rays. If e is the error of the coarser one and r the ratio, they differ by (1 - r) e.
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
