//! The number of time steps that meets the tolerance.

use crate::error::PhantomError;
use crate::scan::STEPS;
use crate::scan::{Accuracy, Acquisition, Camera, Interpolation, Mode, Scan, ViewError};
use crate::{Phantom, Rotation, no_observer};
use std::collections::BTreeSet;

/// Bins and rows of the projections that determine the time steps, for line integrals.
const PROBE: usize = 64;
/// Smallest number of tested views of all gates; each gate has at least [`LEAST`], and its most demanding view.
const VIEWS_TRIED: usize = 8;
const LEAST: usize = 2;
/// The same for polynomials in volume, whose errors differ little between views.
const ALIKE: usize = 4;
/// Errors over time in untested views relative to those in tested ones.
const OTHER_VIEWS: f64 = 1.5;
/// Evenly spaced views among which those with the largest change of the heart are found and tested besides.
const CANDIDATES: usize = 16;

/// The number of steps to try after another: a power of two, or that and a half for a polynomial, whose error falls faster.
fn next(steps: usize, interpolation: Interpolation) -> usize {
    match (interpolation, steps.is_power_of_two()) {
        (Interpolation::Linear, _) => 2 * steps,
        (Interpolation::Polynomial, true) => steps + steps / 2,
        (Interpolation::Polynomial, false) => steps / 3 * 4,
    }
}

impl Phantom {
    /// Returns the time steps per cycle: given, or increased until the estimated error in the tested views meets the tolerance. Each gate tests
    /// other views.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no number of steps suffices; errors of projecting.
    pub fn steps(&self) -> Result<usize, PhantomError> {
        let tolerance = match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => return Ok(steps),
            Accuracy::Tolerance(tolerance) => tolerance,
        };
        let averaged = match self.scene().acquisition.mode {
            Mode::Instants => false,
            Mode::Static { .. } => {
                let turns = self.camera().rotation() != Rotation::StepAndShoot;
                turns || self.cycle().breathing().is_some()
            }
            Mode::Exposure { .. } | Mode::WholeCycle | Mode::Gated { .. } => true,
        };
        if !averaged {
            return Ok(STEPS[0]);
        }
        if let Some(steps) = self.steps_known() {
            return Ok(steps);
        }
        let imaging = self.imaging()?;
        let camera = match imaging {
            Some(_) => self.camera().clone(),
            None => self.camera().coarse(PROBE)?,
        };
        let changed = self.changed_views(&camera)?;
        let mut steps = STEPS[0];
        loop {
            let sets: Vec<Scan<'_>> = (0..self.n_gates())
                .map(|gate| Scan {
                    imaging,
                    ..self.scan(&camera, gate, self.acquisition_of(gate, steps))
                })
                .collect();
            let [mut reached, mut least] = [0.0f64; 2];
            for (sets, mut views) in self.views_of_sets(&sets) {
                views.extend(&changed);
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
            if steps >= STEPS[1] || least > tolerance {
                return Err(PhantomError::Tolerance {
                    term,
                    reached,
                    tolerance,
                });
            }
            steps = next(steps, sets[0].acquisition.interpolation);
        }
    }

    /// Views in which the heart changes most, among some evenly spaced ones; none for a static heart, of which all views are tested.
    fn changed_views(&self, camera: &Camera) -> Result<Vec<usize>, PhantomError> {
        if matches!(self.scene().acquisition.mode, Mode::Static { .. }) {
            return Ok(Vec::new());
        }
        let n_views = camera.n_views();
        let n = n_views.min(CANDIDATES);
        let evenly = (0..n).map(|k| k * n_views / n).collect();
        Ok(self.most_changed(camera, &evenly)?.to_vec())
    }

    /// Largest errors of projection sets in some views, relative to the largest sample of each set in these.
    fn errors_in_views(
        &self,
        sets: &[Scan<'_>],
        views: &BTreeSet<usize>,
    ) -> Result<Vec<ViewError>, PhantomError> {
        let camera = sets[0].camera;
        let rows = 0..camera.n_rows();
        let len = rows.len() * camera.n_bins();
        let mut samples = vec![0.0; sets.len() * len];
        let mut all = vec![(0.0f64, ViewError::default()); sets.len()];
        for &view_idx in views {
            let view = (view_idx..view_idx + 1, rows.clone());
            let taken = Scan::sets_into(sets, view, &mut samples, &no_observer)?;
            for ((set, samples), (most, sum)) in taken.iter().zip(samples.chunks(len)).zip(&mut all)
            {
                self.work.rays(set.rays);
                let largest = f64::from(samples.iter().fold(0.0f32, |m, sample| m.max(*sample)));
                *most = most.max(largest);
                let error = set.view_error;
                sum.time = sum.time.max(error.time * largest);
                sum.truncation = sum.truncation.max(error.truncation * largest);
                sum.bins = error.bins;
            }
        }
        let others = if views.len() < camera.n_views() {
            OTHER_VIEWS
        } else {
            1.0
        };
        let relative = |(most, mut sum): (f64, ViewError)| {
            sum.time *= others;
            if most > 0.0 {
                sum.time /= most;
                sum.truncation /= most;
            }
            sum
        };
        Ok(all.into_iter().map(relative).collect())
    }

    /// Projection sets that are computed together, with their tested views.
    fn views_of_sets<'a, 'b>(
        &self,
        sets: &'a [Scan<'b>],
    ) -> Vec<(&'a [Scan<'b>], BTreeSet<usize>)> {
        let n_views = self.camera().n_views();
        let hardest = |sets: &[Scan<'_>]| sets.iter().map(Scan::hardest_view).collect::<Vec<_>>();
        match sets[0].acquisition {
            // For a static heart the error depends on the angle; it is largest where the rays are parallel to the base.
            Acquisition {
                mode: Mode::Static { .. },
                ..
            } => vec![(sets, (0..n_views).collect())],
            // All gates are sums over the same images.
            Acquisition {
                interpolation: Interpolation::Polynomial,
                ..
            } => {
                let evenly = (0..ALIKE).map(|k| k * n_views / ALIKE);
                vec![(sets, evenly.chain(hardest(sets)).collect())]
            }
            Acquisition {
                interpolation: Interpolation::Linear,
                ..
            } => {
                let (gates, n) = (sets.len(), LEAST.max(VIEWS_TRIED.div_ceil(sets.len())));
                let each = |gate: usize, k: usize| (k * gates + gate) * n_views / (n * gates);
                (sets.chunks(1).enumerate())
                    .map(|(gate, set)| {
                        let views = (0..n).map(|k| each(gate, k));
                        (set, views.chain(hardest(set)).collect())
                    })
                    .collect()
            }
        }
    }

    /// Returns the steps that meet the tolerance, if they are known.
    pub(crate) fn steps_known(&self) -> Option<usize> {
        self.steps.get().copied()
    }
}
