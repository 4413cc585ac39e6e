//! The voxels and the response of the model that OSEM reconstructs with.

use super::method::Osem;
use crate::error::PhantomError;
use crate::scan::BinSample;
use crate::scene::Parts;
use crate::{Camera, Medium};
use radon::Collimator;
use revolve_voxel::Organs;

/// Layers of so many standard deviations of the widest response, beyond the first row and the last, are blurred into the views.
const MARGIN: f64 = 3.0;

/// The voxels of the model.
#[derive(Debug)]
pub(crate) struct ModelVoxels {
    /// The camera with these voxels; its rows are their layers.
    pub(crate) camera: Camera,
    /// Which of them is the first of the camera's own, along x, y and z.
    first: [usize; 3],
}

impl Parts {
    /// The voxels of the model, of a camera whose face is nowhere farther from the axis than that.
    pub(crate) fn model_voxels(
        &self,
        osem: &Osem,
        radius: f64,
    ) -> Result<ModelVoxels, PhantomError> {
        let camera = &self.camera;
        let half = 0.5 * camera.n_bins() as f64 * camera.pitch();
        let mut reach = [[-half, half]; 2];
        let mut hold = |centre: [f64; 2], half: [f64; 2]| {
            for ([low, high], (c, a)) in reach.iter_mut().zip(centre.into_iter().zip(half)) {
                (*low, *high) = (low.min(c - a), high.max(c + a));
            }
        };
        // A medium of coefficient 0 is no reason for more voxels.
        let models = osem.attenuation && self.attenuation.is_some();
        let medium = (self.attenuation).filter(|own| models && own.coefficient > 0.0);
        if let Some(around) = self.scene.background {
            hold(around.centre, around.semi_axes);
        }
        if let Some(Medium::Torso { centre, semi_axes }) = medium.map(|own| own.medium) {
            hold(centre, semi_axes);
        }
        for organ in self.organs.iter().flat_map(Organs::as_slice) {
            if organ.activity > 0.0 || (models && organ.attenuation > 0.0) {
                let ([x, y, _], [a, b, _]) = organ.shape.bounds();
                hold([x, y], [a, b]);
            }
        }
        let width = self.response(osem).sigma(radius + half);
        let layers = (MARGIN * width / camera.detector().pitch()[1]).ceil();
        let (first, camera) = camera.with_voxels_around(reach, layers)?;
        Ok(ModelVoxels { camera, first })
    }

    /// How the model has points blurred. The model's samples are averages over bins: where those given are samples, what means are wider by is
    /// taken off the crystal's variance, as far as it goes.
    pub(super) fn response(&self, osem: &Osem) -> Collimator {
        let collimator = self.collimator.filter(|_| osem.resolution);
        let Some(response) = collimator else {
            return Collimator::default();
        };
        let [bin, row] = self.camera.detector().pitch();
        let wider = match self.samples() {
            BinSample::Centres => bin.min(row).powi(2) / 12.0,
            BinSample::Averages => 0.0,
        };
        let intrinsic = (response.intrinsic().powi(2) - wider).max(0.0).sqrt();
        // Nothing that `new` could refuse.
        Collimator::new(response.slope(), response.at_face(), intrinsic).unwrap_or(response)
    }
}

/// Where the collimator's face is farthest from the axis.
pub(crate) fn farthest(radii: &[f64]) -> f64 {
    radii.iter().fold(0.0, |most, radius| most.max(*radius))
}

impl ModelVoxels {
    /// The voxels of a camera from a volume of the model, `[z][y][x]` both.
    pub(super) fn cut(&self, volume: &[f32], camera: &Camera) -> Vec<f32> {
        let ([nx, ny, _], [own, rows, slices]) =
            (self.camera.grid().shape(), camera.grid().shape());
        let [x, y, z] = self.first;
        let row = |k: usize| ((z + k / rows) * ny + y + k % rows) * nx + x;
        (0..slices * rows)
            .flat_map(|k| &volume[row(k)..row(k) + own])
            .copied()
            .collect()
    }
}
