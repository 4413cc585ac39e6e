//! The number of steps of the quadrature over time that meets the tolerance.

use crate::Phantom;
use crate::Rotation;
use crate::error::PhantomError;
use crate::scan::STEPS;
use crate::scan::{Accuracy, Mode, Scan};
use std::collections::BTreeSet;

/// Bins and rows of the views of line integrals on which steps are tried.
const PROBE: usize = 64;
/// Views that are tried at least, those of all gates together; of a gate at least [`LEAST`], and the hardest one.
const VIEWS_TRIED: usize = 8;
const LEAST: usize = 2;

impl Phantom {
    /// Time steps per cycle: as given, or doubled until the estimated error of time in the views that are tried meets its part of the
    /// tolerance. Each gate tries other views.
    ///
    /// # Errors
    /// [`PhantomError::Tolerance`] if no number of steps suffices; what projecting the views can return.
    pub fn steps(&self) -> Result<usize, PhantomError> {
        let tolerance = match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => return Ok(steps),
            Accuracy::Tolerance(_) => self.parts().tolerances().time,
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
        let depth = self.coarse_depth()?;
        let camera = match &depth {
            Some(depth) => depth.camera.clone(),
            None => self.camera().coarse(PROBE)?,
        };
        let rows = match &depth {
            Some(_) => 0..self.camera().n_rows(),
            None => 0..camera.n_rows(),
        };
        let mut steps = STEPS[0];
        loop {
            let mut reached = 0.0f64;
            for gate in 0..self.n_gates() {
                let scan = Scan {
                    depth: depth.as_ref(),
                    ..self.scan(&camera, gate, self.acquisition_of(gate, steps))
                };
                for view_idx in self.views_of_gate(&scan, gate) {
                    let taken = scan.rows(view_idx..view_idx + 1, rows.clone(), &|_| ())?;
                    self.work.rays(taken.rays);
                    reached = reached.max(taken.view_error.time);
                }
            }
            if reached <= tolerance {
                return Ok(*self.steps.get_or_init(|| steps));
            }
            if steps >= STEPS[1] {
                return Err(PhantomError::Tolerance {
                    term: "average over time",
                    reached,
                    tolerance,
                });
            }
            steps *= 2;
        }
    }

    fn views_of_gate(&self, scan: &Scan<'_>, gate: usize) -> BTreeSet<usize> {
        let n_views = self.camera().n_views();
        // What is hard of a heart that is still is the angle, say that at which its base is seen edge on.
        if let Mode::Static { .. } = scan.acquisition.mode {
            return (0..n_views).collect();
        }
        let (gates, n) = (
            self.n_gates(),
            LEAST.max(VIEWS_TRIED.div_ceil(self.n_gates())),
        );
        let each = |k: usize| (k * gates + gate) * n_views / (n * gates);
        (0..n).map(each).chain([scan.hardest_view()]).collect()
    }

    /// The steps that meet the tolerance, once that was tried.
    pub(crate) fn steps_known(&self) -> Option<usize> {
        self.steps.get().copied()
    }
}
