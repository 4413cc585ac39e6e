//! Detection of settings with which reconstructions or counts are useless.

use super::Phantom;
use super::products::Needs;
use super::warning::{Warning, WarningKind};
use super::warnings::half_extents;
use crate::error::PhantomError;
use crate::text::brief;
use crate::{Counts, Method};
use revolve_voxel::Body;

impl Phantom {
    /// Returns the settings with which reconstructions or counts are useless; `bodies` are those of [`Phantom::outermost`].
    pub(super) fn unsuitable(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let (scene, own) = (self.scene(), &self.scene().reconstruction);
        let pixel = self.camera().grid().spacing()[0];
        let width = own.pixels.unwrap_or(scene.camera.bins) as f64 * pixel;
        let (mut heart, mut needed) = (0.0f64, 0.0f64);
        for phase in self.outermost_phases() {
            heart = heart.max(2.0 * self.shape(phase)?.radius());
        }
        for [x, y, _] in bodies.iter().map(half_extents) {
            needed = needed.max(2.0 * x.max(y));
        }
        let mut found = Vec::new();
        let mut add = |key, reason, value, limit, unit| {
            let numbers = [("value", value), ("limit", limit)];
            let [value, limit] = [value, limit].map(brief);
            let text = format!("{key}: {reason} ({value}; the limit is {limit} {unit}");
            let message = format!("{})", text.trim_end());
            found.push(Warning::new(WarningKind::Unsuitable, key, numbers, message));
        };
        let reconstructs = scene.output.needs(Needs::Reconstruction);
        let filters = reconstructs && own.method == Method::Fbp;
        let period = filters.then_some(scene.camera.pitch[0] / own.cutoff);
        for (key, size) in [
            ("reconstruction.pixel", Some(pixel)),
            ("reconstruction.cutoff", period),
            ("reconstruction.filter_fwhm", own.filter_fwhm),
        ] {
            if let Some(size) = size.filter(|size| *size > heart) {
                let reason = "the resolution is coarser than the outer diameter of the heart";
                add(key, reason, size, heart, "cm");
            }
        }
        // By default the grid is as wide as the views, and truncation has a warning of its own.
        if width < self.width().min(needed) {
            let reason = "pixels x pixel does not contain the heart";
            add("reconstruction.pixels", reason, width, needed, "cm");
        }
        let gain = own.window.gain(0.0);
        if filters && (gain - 1.0).abs() > 1e-9 {
            let reason = "the gain at frequency 0 scales the volumes";
            add("reconstruction.window", reason, gain, 1.0, "");
        }
        if let Some(Counts::Total(total)) = scene.noise.map(|noise| noise.counts) {
            let mean = total / self.camera().n_views() as f64;
            if mean < 1.0 {
                let reason = "too few counts are expected in a view";
                add("noise.counts.total", reason, mean, 1.0, "");
            }
        }
        Ok(found)
    }
}
