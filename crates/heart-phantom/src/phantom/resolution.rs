//! The resolution at which images are computed, refined until the tolerance is met.

use super::Phantom;
use crate::error::{PhantomError, missed};
use crate::once::once;
use crate::scan::{Acquisition, Facing, Imaging, ImagingOptions, Projected, Scan, evenly};
use crate::{BinSample, Camera, Mode, Resolution, Rotation, no_observer};
use radon::Collimator;
use revolve_voxel::{BinValue, View};
use std::collections::BTreeSet;
use std::f64::consts::LN_2;

/// Densities of nodes, with the tolerance of the interpolation in depth. That is a bound for any object; the error in images of hearts
/// and organs is about a hundred times smaller.
const LADDER: [[f64; 2]; 10] = [
    [0.7, 1e-1],
    [1.0, 2e-2],
    [1.4, 2e-3],
    [2.0, 2e-4],
    [2.8, 2e-5],
    [4.0, 2e-6],
    [5.6, 2e-7],
    [8.0, 2e-8],
    [11.3, 2e-8],
    [16.0, 2e-8],
];
/// Index of the resolution at which the effect of sampling at bin centres is computed.
const PROBE: usize = 2;
/// Views in which resolutions are compared, besides the one nearest to its collimator.
const VIEWS_TRIED: usize = 7;
/// Evenly spaced views among which those with the largest change of the heart are found.
const CANDIDATES: usize = 16;
/// Assumed ratio of the error of a resolution to that of the next coarser one, whose density is smaller by the root of two. It is 0.5 for the
/// order 2 of small corners of a meridian at low densities, 0.42 for the order 5/2 of twisted sides of defects and of outlines that cross the edges of bins
/// without a response, and smaller where the quadrature converges exponentially.
const RATIO: f64 = 0.5;
/// Without a response, or with a narrow one, smallest assumed ratio of two successive differences: outlines cross few bins of a small heart, and one
/// difference may be small by chance. It is the ratio of the errors of three steps.
const LEAST_RATIO: f64 = RATIO * RATIO * RATIO;
/// Errors of untested views relative to those of tested ones, with a response and without or with a narrow one.
const OTHER_VIEWS: [f64; 2] = [1.2, 1.8];
/// Rotation during a view in radians above which the largest sample is that of averages over the rotation, because it may be much smaller.
const WIDE_TURN: f64 = 0.12;
/// Largest number of evaluations of the response per sample, rays times nodes in depth, unless a tolerance is given or the coarsest resolution
/// needs more. It limits the time of views whose rows are much higher than the wall is thick, and of objects much deeper than the response is
/// wide.
const MOST_EVALUATIONS: u64 = 2000;
/// Smallest fraction of the tolerance reserved for the surroundings of the heart, where these have a separate resolution.
const SURROUNDINGS: f64 = 0.3;

/// Images at the phases in which resolutions are compared.
struct Images {
    /// For each phase the samples of the views.
    samples: Vec<Vec<f32>>,
    /// Evaluations of the response.
    evaluations: u64,
    /// Bound on the errors of omitted weights and of rounding, absolute.
    truncation: f64,
    /// Largest [`View::corner_error`], absolute.
    corners: f64,
}

fn resolution(index: usize) -> Resolution {
    let [density, depth_tolerance] = LADDER[index];
    Resolution {
        density,
        depth_tolerance,
    }
}

impl Phantom {
    /// Returns the resolution of images of the heart; `None` for line integrals. The first call compares resolutions in up to eight views of
    /// the heart at end-systole and end-diastole. Without a tolerance the target is 1e-3 of the largest sample, unless that takes more than
    /// 2000 evaluations of the response a sample; [`ViewError::bins`](crate::ViewError::bins) is the error reached.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no resolution meets the tolerance of the scene; errors of the solver.
    pub fn resolution(&self) -> Result<Option<Resolution>, PhantomError> {
        let imaging = self.imaging()?;
        Ok(imaging.map(|imaging| imaging.options.resolutions[0]))
    }

    /// Returns the computation of images; `None` if samples are line integrals.
    pub(super) fn imaging(&self) -> Result<Option<&Imaging>, PhantomError> {
        let make = || {
            self.check_sources()?;
            // The views that are tried do not count as progress.
            let _none = simd_set::part(0..0, 1);
            self.make_imaging()
        };
        Ok(once(&self.imaging, make)?.as_ref())
    }

    fn make_imaging(&self) -> Result<Option<Imaging>, PhantomError> {
        let Some(value) = self.bin_value()? else {
            return Ok(None);
        };
        let target = self.parts.tolerance_of_bins();
        let views = self.views_tried()?;
        // Averages over the rotation during a view have smaller absolute errors.
        let camera = self.camera().stopped();
        let find = |images: (Projected, Images), largest, target| {
            self.find_resolution((&camera, value, &views), images, largest, target)
        };
        // Omitted weights and rounding may use the other half of the tolerance.
        let check = |truncation: f64, largest: f64| {
            let reached = truncation / largest;
            let term = "omitted weights and rounding";
            match self.parts.tolerance().filter(|_| reached > target) {
                Some(tolerance) => Err(missed(term, reached, [target, tolerance])),
                None => Ok(()),
            }
        };
        let coarsest = |projected| self.images((&camera, Some(value)), &views, 0, projected);
        let (resolutions, error) = match self.has_fixed_surroundings() {
            true => {
                let [of_heart, of_others] = [Projected::Heart, Projected::Surroundings];
                let [hearts, others] = [coarsest(of_heart)?, coarsest(of_others)?];
                let around = &others.samples[0];
                let whole = (hearts.samples.iter())
                    .map(|heart| heart.iter().zip(around).map(|(a, b)| a + b).collect());
                let largest = least_maximum(&whole.collect::<Vec<_>>());
                check(hearts.truncation + others.truncation, largest)?;
                let (heart, error) =
                    find((of_heart, hearts), largest, (1.0 - SURROUNDINGS) * target)?;
                let (around, of_around) = find((of_others, others), largest, target - error)?;
                ([heart, around], error + of_around)
            }
            false => {
                let images = coarsest(Projected::All)?;
                let mut largest = least_maximum(&images.samples);
                if self.camera().turn() > WIDE_TURN {
                    let turning = (self.camera(), Some(value));
                    let averages = self.images(turning, &views, 0, Projected::All)?;
                    largest = largest.min(least_maximum(&averages.samples));
                }
                check(images.truncation, largest)?;
                let (all, error) = find((Projected::All, images), largest, target)?;
                ([all; 2], error)
            }
        };
        self.imaging_on(value, resolutions, error).map(Some)
    }

    /// The definition of a sample of the image; `None` for line integrals.
    fn bin_value(&self) -> Result<Option<BinValue>, PhantomError> {
        let is_blurred = self.response()?.variance(f64::MAX) > 0.0;
        Ok(match self.parts.samples() {
            BinSample::Averages => Some(BinValue::Average),
            BinSample::Centres => is_blurred.then_some(BinValue::Centre),
        })
    }

    /// Whether the surroundings of the heart are projected once for all times.
    fn has_fixed_surroundings(&self) -> bool {
        self.parts.surroundings.is_active() && self.camera().rotation() == Rotation::StepAndShoot
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

    fn imaging_on(
        &self,
        value: BinValue,
        resolutions: [Resolution; 2],
        error: f64,
    ) -> Result<Imaging, PhantomError> {
        let options = ImagingOptions {
            response: self.response()?,
            value,
            resolutions,
            error,
        };
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
        let imaging = Imaging::new(options, &views, self.parts.surroundings.changes_behind())?;
        let threads = rayon::current_num_threads() as u64;
        let images = 2 * threads * imaging.view_bytes(self.camera()) as u64;
        self.check_available(self.share.further.saturating_add(images))?;
        Ok(imaging)
    }

    /// Returns the difference between values at bin centres and averages over bins in the first view, if bins are wider than half the response or
    /// than the smallest part of the heart: larger pitch and FWHM of the response in cm, and the difference relative to the largest sample.
    pub(super) fn aliasing(&self) -> Result<Option<[f64; 3]>, PhantomError> {
        once(&self.aliasing, || self.compare_averages()).copied()
    }

    fn compare_averages(&self) -> Result<Option<[f64; 3]>, PhantomError> {
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
        let images = |value| self.images((self.camera(), value), &first, PROBE, Projected::All);
        let centres = images(self.bin_value()?)?.samples;
        let averages = images(Some(BinValue::Average))?.samples;
        let largest = largest_of(averages.iter().flatten());
        Ok(Some([
            side,
            fwhm,
            difference(centres.iter().flatten(), averages.iter().flatten()) / largest,
        ]))
    }

    /// Refines images of the coarsest resolution until their difference from those of another one, and the error of the corners of meridians, are no
    /// more than the tolerance allows, relative to `largest`. Returns the resolution with its error.
    fn find_resolution(
        &self,
        (camera, value, views): (&Camera, BinValue, &BTreeSet<usize>),
        (projected, coarsest): (Projected, Images),
        largest: f64,
        target: f64,
    ) -> Result<(Resolution, f64), PhantomError> {
        let pitch = camera.detector().pitch();
        let is_narrow = self.narrowest()? < View::NARROW * pitch[0].max(pitch[1]);
        let others = OTHER_VIEWS[usize::from(is_narrow)];
        let (mut before, mut corners) = (coarsest.samples, coarsest.corners);
        let mut least_off = 0.0;
        let mut index = 1;
        loop {
            let images = self.images((camera, Some(value)), views, index, projected)?;
            let after = images.samples;
            let n_samples = after.iter().map(Vec::len).sum::<usize>() as u64;
            let off = difference(before.iter().flatten(), after.iter().flatten()) / largest;
            let off = off.max(least_off);
            least_off = if is_narrow { LEAST_RATIO * off } else { 0.0 };
            let quadrature = others / (1.0 - RATIO) * off;
            let coarse = quadrature + corners / largest;
            corners = images.corners;
            let given = self.parts.tolerance();
            let is_costly = given.is_none() && images.evaluations > MOST_EVALUATIONS * n_samples;
            if coarse <= target || is_costly {
                return Ok((resolution(index - 1), coarse));
            }
            let error = RATIO * quadrature + corners / largest;
            match given {
                _ if error <= target => return Ok((resolution(index), error)),
                _ if index + 1 < LADDER.len() => (before, index) = (after, index + 1),
                None => return Ok((resolution(index), error)),
                Some(tolerance) => {
                    return Err(missed("averages over bins", error, [target, tolerance]));
                }
            }
        }
    }

    /// The smallest standard deviation of the response to anything active, cm.
    fn narrowest(&self) -> Result<f64, PhantomError> {
        let response = self.response()?;
        if self.parts.collimator.is_none() {
            return Ok(response.sigma(0.0));
        }
        let distances = (self.facing()?.iter()).map(|view| view.radius - view.seen[1]);
        Ok(response.sigma(distances.fold(f64::INFINITY, f64::min)))
    }

    /// Returns the smallest part of the heart: the cavity, the wall or a defect.
    fn smallest_part(&self) -> Result<f64, PhantomError> {
        let [small, _] = self.cycle().extreme_phases();
        let shape = self.shape(small)?;
        let layers = shape.body().layers();
        let mut least = f64::INFINITY;
        for layer in layers {
            let [from, to] = layer.x_range();
            least = least.min(layer.r_max()).min(0.5 * (to - from));
        }
        for phase in self.outermost_phases() {
            let wall = self.thickness(phase)?;
            least = least.min(wall.side).min(wall.apex);
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
        let mut views: BTreeSet<usize> = evenly(VIEWS_TRIED, self.camera().n_views()).collect();
        if self.parts.collimator.is_some() {
            let distance = |view: &Facing| view.radius - view.seen[1];
            let nearest = (self.facing()?.iter().enumerate())
                .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
            views.extend(nearest.map(|(view_idx, _)| view_idx));
        }
        Ok(views)
    }

    /// Returns two of some evenly spaced views: the one with the largest change between end-systole and end-diastole, and the one with the
    /// largest sample of the heart, both of line integrals.
    pub(super) fn changed_views(&self, camera: &Camera) -> Result<[usize; 2], PhantomError> {
        let views = evenly(CANDIDATES, camera.n_views()).collect();
        let from = (camera, None);
        let images = self.images(from, &views, 0, Projected::Heart)?.samples;
        let phases = [&images[0], &images[images.len() - 1]];
        let len = phases[0].len() / views.len();
        let mut found = [(0.0, 0); 2];
        for (k, &view_idx) in views.iter().enumerate() {
            let [a, b] = phases.map(|samples| &samples[k * len..][..len]);
            let values = [difference(a, b), largest_of(a.iter().chain(b))];
            for (best, value) in found.iter_mut().zip(values) {
                if value > best.0 {
                    *best = (value, view_idx);
                }
            }
        }
        Ok(found.map(|(_, view_idx)| view_idx))
    }

    /// Projects these views of the heart at end-systole and end-diastole, or at the phase of a static scene; line integrals without `value`.
    fn images(
        &self,
        (camera, value): (&Camera, Option<BinValue>),
        views: &BTreeSet<usize>,
        index: usize,
        projected: Projected,
    ) -> Result<Images, PhantomError> {
        let on = |value| self.imaging_on(value, [resolution(index); 2], 0.0);
        let imaging = value.map(on).transpose()?;
        let mut cycle = self.cycle().clone();
        // An instant is no average over respiration, and may lie outside a respiratory gate.
        if self.scene().acquisition.mode == Mode::Instants {
            cycle = cycle.without_breathing();
        }
        let mut images = Images {
            samples: Vec::new(),
            evaluations: 0,
            truncation: 0.0,
            corners: 0.0,
        };
        let mut phases = self.outermost_phases();
        if projected == Projected::Surroundings {
            phases.truncate(1);
        }
        for phase in phases {
            let scan = Scan {
                imaging: imaging.as_ref(),
                projected,
                cycle: &cycle,
                camera,
                ..self.scan(Acquisition::still(phase))
            };
            let of_heart = |_: &&Imaging| projected != Projected::Surroundings;
            if let Some(imaging) = imaging.as_ref().filter(of_heart) {
                let heart = self.shape(phase)?;
                for &view_idx in views {
                    let corners = scan.corner_error(imaging, view_idx, &heart)?;
                    images.corners = images.corners.max(corners);
                }
            }
            let mut samples = Vec::new();
            for &view_idx in views {
                let part = camera.rows_of(view_idx..view_idx + 1);
                let taken = scan.rows(part, &no_observer)?;
                self.work.rays(taken.rays);
                let counted = |own: &Imaging| own.evaluations(view_idx, taken.rays);
                images.evaluations += imaging.as_ref().map_or(0, counted);
                let truncation = taken.view_error.truncation * largest_of(&taken.samples);
                images.truncation = images.truncation.max(truncation);
                samples.extend(taken.samples);
            }
            images.samples.push(samples);
        }
        Ok(images)
    }
}

/// The least of the maxima of those images that contain activity; infinite without one.
fn least_maximum(images: &[Vec<f32>]) -> f64 {
    let maxima = images.iter().map(largest_of).filter(|most| *most > 0.0);
    maxima.fold(f64::INFINITY, f64::min)
}

/// Returns the largest absolute value of some samples.
pub(super) fn largest_of<'a>(samples: impl IntoIterator<Item = &'a f32>) -> f64 {
    let samples = samples.into_iter();
    f64::from(samples.fold(0.0f32, |most, sample| most.max(sample.abs())))
}

/// Returns the largest difference of two sets of samples.
fn difference<'a>(
    coarse: impl IntoIterator<Item = &'a f32>,
    fine: impl IntoIterator<Item = &'a f32>,
) -> f64 {
    let pairs = coarse.into_iter().zip(fine);
    f64::from(pairs.fold(0.0f32, |most, (a, b)| most.max((a - b).abs())))
}
