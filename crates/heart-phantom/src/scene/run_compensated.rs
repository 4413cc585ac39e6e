//! Volumes of all gates in one frame, at the end of a run.

use super::run::Run;
use super::run_report::{CompensatedReport, Progress};
use crate::error::PhantomError;
use crate::files::{RECONSTRUCTION, TRUTH, Volume};
use crate::{Method, Product};

impl Run<'_> {
    /// Those that the scene asks for, of the views of all gates.
    pub(super) fn compensated(
        &mut self,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Vec<CompensatedReport>, PhantomError> {
        let phantom = self.phantom;
        if !phantom.is_compensated() {
            return Ok(Vec::new());
        }
        let views = std::mem::take(&mut self.seen);
        let pictures = self.wants(Product::Pictures);
        let reconstruct = self.wants(Product::Reconstruction) || pictures;
        let (volumes, passes) = match phantom.parts().method {
            Method::Fbp => (phantom.n_volumes(), 1),
            Method::Osem(osem) => (1, osem.iterations),
        };
        let n_gates = phantom.n_gates() as f64;
        let mut reports = Vec::new();
        for number in 0..volumes {
            let told = |done: usize| {
                let share = (number as f64 + done as f64 / passes as f64) / volumes as f64;
                progress(Progress {
                    stage: "compensated",
                    fraction: (n_gates + 0.4 * share) / (n_gates + 0.5),
                });
            };
            told(0);
            let mut report = CompensatedReport::default();
            let mut made = None;
            if reconstruct {
                let (volume, osem) = phantom.compensated(number, &views, &told)?;
                report.osem = osem;
                if self.wants(Product::Reconstruction) {
                    self.put_compensated(RECONSTRUCTION, number, &volume)?;
                }
                if pictures {
                    self.keep_middle(&volume);
                }
                made = Some(volume);
            }
            if self.wants(Product::Truth) {
                let truth = phantom.compensated_truth(number)?;
                self.put_compensated(TRUTH, number, &truth)?;
                if let Some(volume) = made {
                    report.artefacts =
                        Some(phantom.compensated_artefacts(number, &volume, &truth)?);
                }
            }
            reports.push(report);
        }
        Ok(reports)
    }

    fn put_compensated(
        &mut self,
        what: &str,
        number: usize,
        samples: &[f32],
    ) -> Result<(), PhantomError> {
        let volume = Volume::new(*self.phantom.camera().grid(), samples)?;
        self.put(&self.phantom.compensated_name(what, number), volume)
    }
}
