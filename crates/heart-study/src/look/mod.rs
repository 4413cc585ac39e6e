//! Images and a self-contained page of a run.

mod beat;
mod kept;
mod measured;
mod page;
mod planes;
mod tables;

use crate::html::Page;
use beat::Beat;
use heart_phantom::PhantomError;
use heart_phantom::files::write_atomically;
use heart_phantom::{Compensation, GateResults, Phantom, PhaseOf, Product, RunReport};
pub(crate) use kept::Look;
use planes::Planes;
use std::path::{Path, PathBuf};

const CURVES: &str = "curves.svg";

impl<'a> Look<'a> {
    /// Prepares images if the output contains them, and the page if `page`. With neither it stores nothing.
    pub(crate) fn new(phantom: &'a Phantom, page: bool) -> Self {
        Self {
            phantom,
            page,
            planes: Planes::new(phantom),
            shown: Vec::new(),
            sums: Vec::new(),
            sinogram: None,
        }
    }

    /// Returns an upper estimate of the memory of the page in bytes: volumes and sections of all gates, images and the viewer.
    pub(crate) fn bytes(phantom: &Phantom) -> u64 {
        const VIEWER: usize = 32 << 20;
        let cuts = phantom.n_gates() * Planes::new(phantom).len() * size_of::<f32>();
        let volumes = 2 * (Beat::new(phantom).bytes() + cuts);
        (volumes + VIEWER) as u64
    }

    fn wants(&self, product: Product) -> bool {
        self.phantom.scene().output.write.contains(&product)
    }

    /// Returns the names of the files that it writes.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if self.wants(Product::Pictures) {
            let truth = self.phantom.truth_of().file_name();
            // Images show the reconstructions of gates, even if these are not written.
            let of_gates = self.phantom.scene().reconstruction.compensation == Compensation::None;
            let reconstruction = of_gates.then_some("reconstruction");
            let truth = self.wants(Product::Truth).then_some(truth);
            for name in [reconstruction, truth].into_iter().flatten() {
                let gates = 0..self.phantom.n_gates();
                files.extend(gates.map(|gate| self.picture_name(name, gate)));
            }
            files.push(CURVES.into());
        }
        if self.page {
            files.push(Page::FILE.into());
        }
        files
    }

    fn picture_name(&self, name: &str, gate: usize) -> PathBuf {
        match self.phantom.n_gates() {
            1 => format!("{name}.png").into(),
            gates => format!("{name}-{}.png", PhaseOf::Gate { gate, gates }).into(),
        }
    }

    /// Adds the results of a gate.
    pub(crate) fn see(&mut self, gate: usize, results: &GateResults) -> Result<(), PhantomError> {
        if !self.page && !self.wants(Product::Pictures) {
            return Ok(());
        }
        if let Some(views) = &results.projections {
            let camera = self.phantom.camera();
            let [bin, row] = camera.detector().pitch();
            let sum = |view: &[f32]| view.iter().map(|&v| f64::from(v)).sum::<f64>() * bin * row;
            let views_of = views.chunks_exact(camera.view_len());
            self.sums.push(views_of.map(sum).collect());
            if gate == 0 && self.page {
                self.sinogram = Some(measured::cuts(self.phantom, views)?);
            }
        }
        let truth = self.phantom.truth_of().file_name();
        for (name, volume) in [
            ("reconstruction", &results.reconstruction),
            (truth, &results.truth),
        ] {
            if let Some(volume) = volume {
                self.keep(name, volume);
            }
        }
        Ok(())
    }

    /// Writes images, curves and the page with this title.
    pub(crate) fn write(
        &self,
        report: &RunReport,
        title: &str,
        folder: &Path,
    ) -> Result<(), PhantomError> {
        if !self.page && !self.wants(Product::Pictures) {
            return Ok(());
        }
        let curves = measured::curves(self, report)?;
        if self.wants(Product::Pictures) {
            for shown in &self.shown {
                for gate in 0..shown.cuts.len() {
                    let picture = self.picture(shown, gate)?;
                    picture.write_png(&folder.join(self.picture_name(shown.name, gate)))?;
                }
            }
            // The first is that of the volume.
            let text = curves.first().map_or("", |curve| curve.svg.as_str());
            write_atomically(&folder.join(CURVES), |out| out.write_all(text.as_bytes()))?;
        }
        if self.page {
            let html = page::html(self, report, title, &curves)?;
            write_atomically(&folder.join(Page::FILE), |out| {
                out.write_all(html.as_bytes())
            })?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "../../tests/look/mod.rs"]
mod tests;
