//! Detection of settings with which reconstructions or counts are useless.

use super::Phantom;
use super::products::Needs;
use super::warning::Warning;
use super::warnings::half_extents;
use crate::error::PhantomError;
use crate::{Counts, Method};
use radon::Window;
use revolve_voxel::Body;

impl Phantom {
    /// Returns the settings with which reconstructions or counts are useless; `bodies` are those of [`Phantom::outermost`].
    pub(super) fn unsuitable(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let (camera, own) = (&self.scene().camera, &self.scene().reconstruction);
        let (pixel, [pitch, _]) = (self.camera().grid().spacing()[0], camera.pitch);
        let width = own.pixels.unwrap_or(camera.bins) as f64 * pixel;
        let (mut heart, mut needed) = (0.0f64, 0.0f64);
        for phase in self.outermost_phases() {
            heart = heart.max(2.0 * self.shape(phase)?.radius());
        }
        for body in bodies {
            let [x, y, _] = half_extents(body);
            needed = needed.max(2.0 * x.max(y));
        }
        let mut found = Vec::new();
        let mut add = |key, quantity, value, comparison, limit, unit| {
            found.push(Warning::Unsuitable {
                key,
                quantity,
                value,
                comparison,
                limit,
                unit,
            });
        };
        let reconstructs = self.scene().output.needs(Needs::Reconstruction);
        let filters = reconstructs && own.method == Method::Fbp;
        let period = filters.then_some(pitch / own.cutoff);
        let fwhm = own.filter_fwhm.filter(|_| reconstructs);
        for (key, quantity, value) in [
            ("reconstruction.pixel", "the voxel size", Some(pixel)),
            ("reconstruction.cutoff", "pitch / cutoff", period),
            ("reconstruction.filter_fwhm", "the width", fwhm),
        ] {
            if let Some(value) = value.filter(|value| *value > heart) {
                let than = "more than the outer diameter of the heart,";
                add(key, quantity, value, than, heart, " cm");
            }
        }
        // By default the grid is as wide as the views, and truncation has a warning of its own.
        if width < self.width() && width < needed {
            let (key, than) = ("reconstruction.pixels", "less than the heart needs,");
            add(key, "pixels x pixel", width, than, needed, " cm");
        }
        match &own.window {
            Window::Custom(gains) if filters && gains[0] != 1.0 => {
                let scale = "the gain at frequency 0, which scales the volumes,";
                add("reconstruction.window", scale, gains[0], "not", 1.0, "");
            }
            _ => {}
        }
        if let Some(Counts::Total(total)) = self.scene().noise.map(|noise| noise.counts) {
            let mean = total / self.camera().n_views() as f64;
            if mean < 1.0 {
                let quantity = "the mean number of counts in a view";
                add("noise.counts.total", quantity, mean, "less than", 1.0, "");
            }
        }
        Ok(found)
    }
}
