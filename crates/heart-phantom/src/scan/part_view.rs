//! Images of parts of a scan: the change by the heart, its surroundings, and the samples that no shape of the heart changes.

use super::imaging::{Fixed, Imaging, ImagingOptions};
use super::settings::Rotation;
use super::whole::Scan;
use crate::HeartShape;
use crate::error::PhantomError;
use crate::once::once;
use revolve_voxel::{Image, Shown, View};

impl Scan<'_> {
    /// Prepares the images of a view at an angle: of the change by the heart, or of the surroundings.
    pub(super) fn part_view<'b>(
        &self,
        imaging: &'b Imaging,
        (view_idx, theta): (usize, f64),
        shown: Shown,
    ) -> Result<View<'b>, PhantomError> {
        let part = usize::from(shown == Shown::Organs);
        let ImagingOptions {
            value, resolutions, ..
        } = &imaging.options;
        let (rays, detector) = (self.camera.ray_geometry(), self.camera.detector());
        if rays.is_some_and(|rays| !rays.has_bins()) {
            let (format, what) = ("a list of lines", "a blur or averages over bins");
            return Err(PhantomError::Unsupported { format, what });
        }
        let lines = self.rays((view_idx, theta), &(0..detector.n_rows()))?;
        let response = &imaging.responses[view_idx][part];
        let density = resolutions[part].density;
        Ok(View::new(
            &lines,
            detector.pitch(),
            *value,
            response,
            density,
        )?)
    }

    /// The error of a view by corners of the meridians of a heart ([`View::corner_error`]).
    pub(crate) fn corner_error(
        &self,
        imaging: &Imaging,
        view_idx: usize,
        heart: &HeartShape,
    ) -> Result<f64, PhantomError> {
        let at = (view_idx, self.camera.angle(view_idx, 0.0));
        let view = self.part_view(imaging, at, Shown::Change)?;
        let [cavity, wall] = self.activity.of(heart);
        // A defect may be more active than the wall.
        let relative = self.defects.iter().map(|defect| defect.activity);
        let most = relative.fold(1.0, f64::max);
        Ok(view.corner_error(heart.body(), &[cavity, most * wall])?)
    }

    /// Whether the surroundings of a view are the same at all times and stored.
    pub(crate) fn keeps_surroundings(&self) -> bool {
        self.imaging.is_some() && self.camera.rotation() == Rotation::StepAndShoot
    }

    /// The samples of the surroundings of the heart.
    pub(super) fn fixed<'b>(
        &self,
        imaging: &'b Imaging,
        view_idx: usize,
    ) -> Result<&'b Fixed, PhantomError> {
        once(&imaging.fixed[view_idx], || {
            let at = (view_idx, self.camera.angle(view_idx, 0.0));
            let view = self.part_view(imaging, at, Shown::Organs)?;
            let rows = 0..self.camera.n_rows();
            let image = view.image(&self.surroundings.alone(), Shown::Organs, rows)?;
            let mut samples = vec![0.0f32; self.camera.view_len()];
            add(&image, 1.0, (&mut samples, 0, self.camera.n_bins()));
            Ok(Fixed {
                samples,
                largest_line: image.largest_line,
                rays: image.rays,
            })
        })
    }
}

/// Adds a weighted image to samples of `n_bins` bins a row that begin with row `first`.
pub(super) fn add(
    image: &Image,
    weight: f64,
    (samples, first, n_bins): (&mut [f32], usize, usize),
) {
    if image.bins.is_empty() {
        return;
    }
    let rows = samples.chunks_mut(n_bins).skip(image.rows.start - first);
    for (row, own) in rows.zip(image.samples.chunks(image.bins.len())) {
        for (sum, value) in row[image.bins.clone()].iter_mut().zip(own) {
            *sum += (weight * value) as f32;
        }
    }
}
