//! The number of time steps that meets the tolerance.

use crate::error::PhantomError;
use crate::scan::STEPS;
use crate::scan::{Accuracy, Acquisition, Interpolation, Mode, Projected, Scan};
use crate::{Phantom, Rotation, no_observer};
use std::collections::BTreeSet;

/// Bins and rows of the projections that determine the time steps, for line integrals.
const PROBE: usize = 64;
/// Smallest number of tested views of all gates; each gate has at least [`LEAST`], and its most demanding view.
const VIEWS_TRIED: usize = 8;
const LEAST: usize = 2;
/// The same for polynomials in volume, whose errors differ little between views.
const ALIKE: usize = 4;

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
        // With a response and step-and-shoot rotation, the surroundings have no time-quadrature error.
        let projected = match self.camera().rotation() {
            Rotation::StepAndShoot => Projected::Heart,
            Rotation::Continuous => Projected::All,
        };
        let imaging = self.imaging()?;
        let camera = match imaging {
            Some(_) => self.camera().clone(),
            None => self.camera().coarse(PROBE)?,
        };
        let (rows, n_bins) = (0..camera.n_rows(), camera.n_bins());
        let mut steps = STEPS[0];
        loop {
            let [mut reached, mut least] = [0.0f64; 2];
            let sets: Vec<Scan<'_>> = (0..self.n_gates())
                .map(|gate| Scan {
                    imaging,
                    projected,
                    ..self.scan(&camera, gate, self.acquisition_of(gate, steps))
                })
                .collect();
            for (sets, views) in self.views_of_sets(&sets) {
                for view_idx in views {
                    let view = view_idx..view_idx + 1;
                    let each = rows.len() * n_bins;
                    let mut samples = vec![0.0; sets.len() * each];
                    for set in
                        Scan::sets_into(sets, (view, rows.clone()), &mut samples, &no_observer)?
                    {
                        self.work.rays(set.rays);
                        let error = set.view_error;
                        reached = reached.max(error.total());
                        least = least.max(error.total() - error.time);
                    }
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
