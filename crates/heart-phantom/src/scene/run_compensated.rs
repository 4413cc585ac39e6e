//! Motion-compensated volumes at the end of a run.

use super::run::Run;
use super::run_report::{CompensatedReport, Progress};
use crate::error::PhantomError;
use crate::observer::check_stop;
use crate::phantom::{Index, Needs};
use crate::{Observer, Product};

impl Run<'_> {
    /// Computes the requested motion-compensated volumes from the projections of all gates.
    pub(super) fn compensated(
        &mut self,
        progress: Observer<'_, Progress>,
    ) -> Result<Vec<CompensatedReport>, PhantomError> {
        let phantom = self.phantom;
        if !phantom.is_compensated() {
            return Ok(Vec::new());
        }
        let views = std::mem::take(&mut self.seen);
        let reconstruct = phantom.scene().output.needs(Needs::Reconstruction);
        let volumes = phantom.n_volumes();
        let passes = phantom.scene().reconstruction.method.iterations();
        let n_gates = phantom.n_gates() as f64;
        let mut reports = Vec::new();
        for number in 0..volumes {
            let told = |done: usize| {
                let share = (number as f64 + done as f64 / passes as f64) / volumes as f64;
                progress(Progress {
                    stage: "compensated",
                    fraction: (n_gates + 0.4 * share) / (n_gates + 0.5),
                })
            };
            let mut report = CompensatedReport::default();
            let mut made = None;
            if reconstruct {
                let (volume, osem) = phantom.compensated(number, &views, &told)?;
                report.osem = osem;
                self.reconstructed(Index::Volume(number), &volume)?;
                made = Some(volume);
            }
            if self.wants(Product::Truth) {
                check_stop(told(passes))?;
                let truth = phantom.compensated_truth(number)?;
                self.write((Product::Truth, 0), Index::Volume(number), &truth)?;
                if let Some(volume) = made {
                    report.artefacts =
                        Some(phantom.compensated_artefacts(number, &volume, &truth)?);
                }
            }
            reports.push(report);
        }
        Ok(reports)
    }
}
