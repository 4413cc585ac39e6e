//! How many steps of the quadrature over time a tolerance takes.

use crate::Phantom;
use crate::error::PhantomError;
use crate::scan::STEPS;
use crate::scan::{Accuracy, Mode};
use crate::{Acquisition, Rotation};
use std::collections::BTreeSet;

/// Bins and rows of the coarse views on which that is tried.
const PROBE: usize = 48;

impl Phantom {
    /// Steps a cycle: as given, or doubled until the estimated error of coarse views of the first and the middle angle, and of the
    /// time that is hardest to sample, is no more than the tolerance.
    pub(crate) fn steps(&self) -> Result<usize, PhantomError> {
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
        let camera = self.camera().coarse(PROBE)?;
        let rows = camera.n_rows();
        let mut steps = STEPS[0];
        loop {
            let mut reached = 0.0f64;
            for gate in 0..self.n_gates() {
                let scan = self.scan(&camera, gate, self.acquisition_of(gate, steps));
                // What is hard of a heart that is still is the angle, say that at which its base is seen edge on.
                let views: BTreeSet<usize> = match scan.acquisition {
                    Acquisition::Static { .. } => (0..camera.n_views()).collect(),
                    _ => [0, camera.n_views() / 2, scan.hardest_view()].into(),
                };
                for view_idx in views {
                    let taken = scan.rows(view_idx..view_idx + 1, 0..rows, &|_| ())?;
                    self.work.rays(taken.rays);
                    reached = reached.max(taken.quadrature_error.unwrap_or(0.0));
                }
            }
            if reached <= tolerance {
                return Ok(*self.steps.get_or_init(|| steps));
            }
            if steps >= STEPS[1] {
                return Err(PhantomError::Quadrature {
                    reached,
                    tolerance,
                    steps,
                });
            }
            steps *= 2;
        }
    }

    /// The steps that meet the tolerance, once that was tried.
    pub(crate) fn steps_known(&self) -> Option<usize> {
        self.steps.get().copied()
    }
}
