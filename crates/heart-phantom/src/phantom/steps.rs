//! The number of time steps that meets the tolerance.

use crate::error::{PhantomError, missed};
use crate::scan::{Interpolation, STEPS, Scan, Total, evenly};
use crate::{Accuracy, Phantom, Rotation, ViewError, no_observer};
use std::collections::BTreeSet;

/// Bins and rows of the projections that determine the time steps, for line integrals.
const PROBE: usize = 64;
/// Smallest number of evenly spaced tested views of all gates; each gate has at least [`LEAST`]. Besides, its most demanding view and those in
/// which the heart changes most are tested.
const VIEWS_TRIED: usize = 8;
const LEAST: usize = 2;
/// The same for polynomials in volume, of which all gates are sums over the same images.
const ALIKE: usize = 4;
/// Largest errors over time in untested views relative to those in tested ones: without this factor a random chest exceeded its tolerance.
const OTHER_VIEWS: f64 = 1.5;

/// The number of steps to try after another: a power of two, or that and a half for a polynomial, whose error falls faster.
fn next(steps: usize, interpolation: Interpolation) -> usize {
    match (interpolation, steps.is_power_of_two()) {
        (Interpolation::Linear, _) => 2 * steps,
        (Interpolation::Polynomial, true) => steps + steps / 2,
        (Interpolation::Polynomial, false) => steps / 3 * 4,
    }
}

impl Phantom {
    /// Returns the time steps per cycle: given, or increased until the estimated error in the tested views meets the tolerance. The
    /// error is relative to the largest sample, heart and surroundings together.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no number of steps suffices; errors of projecting.
    pub fn steps(&self) -> Result<usize, PhantomError> {
        let tolerance = match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => return Ok(steps),
            Accuracy::Tolerance(tolerance) => tolerance,
        };
        let is_static = self.scene().acquisition.mode.static_phase().is_some();
        let turns = is_static && self.camera().rotation() == Rotation::Continuous;
        if !turns && !self.heart_scan(0)?.has_duration() {
            return Ok(STEPS[0]);
        }
        if let Some(steps) = self.steps.get() {
            return Ok(*steps);
        }
        let imaging = self.imaging()?;
        let camera = match imaging {
            Some(_) => self.camera().clone(),
            None => self.camera().coarse(PROBE)?,
        };
        let always = match is_static {
            // The error depends on the angle; it is largest where the rays are parallel to the base.
            true => (0..camera.n_views()).collect(),
            false => self.changed_views(&camera)?.into(),
        };
        let mut steps = STEPS[0];
        loop {
            let sets: Vec<Scan<'_>> = (0..self.n_gates())
                .map(|gate| Scan {
                    imaging,
                    camera: &camera,
                    ..self.scan(self.acquisition_of(gate, steps))
                })
                .collect();
            let [mut reached, mut least] = [0.0f64; 2];
            for (sets, views) in self.views_of_sets(&sets, &always) {
                for error in self.errors_in_views(sets, &views)? {
                    reached = reached.max(error.total());
                    least = least.max(error.total() - error.time);
                }
            }
            if reached <= tolerance {
                return Ok(*self.steps.get_or_init(|| steps));
            }
            // More steps do not reduce the other terms.
            let (term, reached) = match least > tolerance {
                true => ("averages over bins with omitted weights", least),
                false => ("average over time", reached),
            };
            let mut finer = sets[0].acquisition;
            finer.points = [next(steps, finer.interpolation); 2];
            let too_many = finer.validate(sets[0].cycle, &camera, camera.rotation());
            if steps >= STEPS[1] || too_many.is_err() || least > tolerance {
                return Err(missed(term, reached, [tolerance; 2]));
            }
            steps = finer.points[0];
        }
    }

    /// Errors of projection sets in some views, relative to the largest sample of each set in these.
    fn errors_in_views(
        &self,
        sets: &[Scan<'_>],
        views: &BTreeSet<usize>,
    ) -> Result<Vec<ViewError>, PhantomError> {
        let camera = sets[0].camera;
        let mut samples = vec![0.0; sets.len() * camera.view_len()];
        let mut totals: Vec<Total> = sets.iter().map(|_| Total::default()).collect();
        for &view_idx in views {
            let view = camera.rows_of(view_idx..view_idx + 1);
            Scan::sets_into(sets, view, &mut samples, &mut totals, &no_observer)?;
        }
        let others = match views.len() < camera.n_views() {
            true => OTHER_VIEWS,
            false => 1.0,
        };
        let error = |(set, total): (&Scan<'_>, &Total)| {
            let made = set.without_samples(total);
            self.work.rays(made.rays);
            ViewError {
                time: others * made.view_error.time,
                ..made.view_error
            }
        };
        Ok(sets.iter().zip(&totals).map(error).collect())
    }

    /// Projection sets that are computed together, with their tested views, among which are those of `always`.
    fn views_of_sets<'a, 'b>(
        &self,
        sets: &'a [Scan<'b>],
        always: &BTreeSet<usize>,
    ) -> Vec<(&'a [Scan<'b>], BTreeSet<usize>)> {
        let n_views = self.camera().n_views();
        let with = |sets: &'a [Scan<'b>], views: &mut dyn Iterator<Item = usize>| {
            let demanding = sets.iter().map(Scan::hardest_view);
            (
                sets,
                views
                    .chain(demanding)
                    .chain(always.iter().copied())
                    .collect(),
            )
        };
        match sets[0].acquisition.interpolation {
            Interpolation::Polynomial => vec![with(sets, &mut evenly(ALIKE, n_views))],
            Interpolation::Linear => {
                let (gates, n) = (sets.len(), LEAST.max(VIEWS_TRIED.div_ceil(sets.len())));
                let each = |gate: usize, k: usize| (k * gates + gate) * n_views / (n * gates);
                (sets.chunks(1).enumerate())
                    .map(|(gate, set)| with(set, &mut (0..n).map(|k| each(gate, k))))
                    .collect()
            }
        }
    }
}
