//! Views along rays that are not parallel.

use super::Phantom;
use super::products::Needs;
use crate::error::PhantomError;
use crate::scene::{Check, needs_parallel};
use crate::{BinSample, Orbit, RayGeometry, Rotation, files::Format, scene::HeadsSettings};
use revolve_voxel::Organs;
use revolve_voxel::nalgebra::Point3;

impl Phantom {
    /// Returns the phantom acquired along other rays: its views are those of `rays`, at their times if they have any, with mode, accuracy, activity
    /// and attenuation of the scene. It shares the solved shapes. Products that need a reconstruction are removed from `output.write`.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] for a collimator or a calibration, which need parallel rays; [`PhantomError::Unsupported`] for averages over the
    /// bins of a list of lines, which have no area; [`PhantomError::OutOfRange`] for more than 2^31 samples.
    pub fn along(&self, rays: RayGeometry) -> Result<Self, PhantomError> {
        let mut scene = self.scene().clone();
        let camera = &mut scene.camera;
        (camera.heads, camera.rotation) = (HeadsSettings::One, Rotation::StepAndShoot);
        // Without a collimator it has no effect.
        camera.radius = Orbit::Circle(1.0);
        let output = &mut scene.output;
        output.projections = Format::Npy;
        output
            .write
            .retain(|product| product.info().needs <= Needs::Views);
        let mut c = Check::default();
        needs_parallel(&scene, &mut c);
        c.finish()?;
        let mut phantom = self.with_scene(scene)?;
        if phantom.parts.samples() == BinSample::Averages && !rays.has_bins() {
            let (format, what) = ("a list of lines", "averages over bins");
            return Err(PhantomError::Unsupported { format, what });
        }
        let parts = &mut phantom.parts;
        parts.camera = parts.camera.along(rays)?;
        let camera = &parts.camera;
        let (settings, own) = (&mut parts.scene.camera, &mut parts.scene.reconstruction);
        // The pixels do not change.
        own.pixels.get_or_insert(settings.bins);
        own.pixel.get_or_insert(settings.pitch[0]);
        settings.views = camera.n_views();
        (settings.bins, settings.rows) = (camera.n_bins(), camera.n_rows());
        settings.pitch = camera.detector().pitch();
        Ok(phantom)
    }

    /// Whether the rays were given by [`Phantom::along`], so that the scene does not describe them.
    pub(crate) fn has_own_rays(&self) -> bool {
        let described = self.scene().camera.geometry != crate::scene::BeamSettings::Parallel;
        self.camera().ray_geometry().is_some() && !described
    }

    /// Returns an error if a source of a fan or cone beam is in the bounding box of the heart or in an organ.
    pub(super) fn check_sources(&self) -> Result<(), PhantomError> {
        let Some(rays) = self.camera().ray_geometry() else {
            return Ok(());
        };
        let boxes = (self.outermost()?.iter())
            .map(|body| body.bounding_box(0))
            .collect::<Result<Vec<_>, _>>()?;
        let organs = self.parts.organs.as_ref().map_or(&[][..], Organs::as_slice);
        for view_idx in 0..rays.n_views() {
            let Some([source, _]) = rays.rasters(view_idx) else {
                continue;
            };
            let source = source.first;
            let in_box = |[low, high]: &[Point3<f64>; 2]| {
                (0..3).all(|k| low[k] < source[k] && source[k] < high[k])
            };
            let inside = boxes.iter().any(in_box)
                || organs.iter().any(|organ| organ.shape.contains(&source));
            if inside {
                return Err(PhantomError::SourceInside { view_idx });
            }
        }
        Ok(())
    }
}
