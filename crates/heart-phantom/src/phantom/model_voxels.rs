//! The OSEM model of a gate, its voxels and its response.

use super::method::Osem;
use crate::error::{PhantomError, zeros};
use crate::scene::Parts;
use crate::{BinSample, Camera};
use radon::{Collimator, SpectOperator, Subset};

/// The model extends beyond the first and the last row by so many standard deviations of the widest response.
const MARGIN: f64 = 3.0;

/// The voxels of the model.
#[derive(Debug)]
pub(crate) struct ModelVoxels {
    /// The camera with these voxels; one row per layer.
    pub(crate) camera: Camera,
    /// Index of the first of the camera's own voxels, along x, y and z.
    first: [usize; 3],
}

/// The model of a gate.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) operator: SpectOperator<f32>,
    pub(super) subsets: Vec<Subset<SpectOperator<f32>, f32>>,
}

impl Model {
    pub(super) fn new(osem: &Osem, operator: SpectOperator<f32>) -> Result<Self, PhantomError> {
        let mut subsets = operator.subsets(osem.subsets)?;
        // Consecutive subsets have different directions.
        subsets.sort_by_key(|subset| subset.operator().views()[0].reverse_bits());
        Ok(Self { operator, subsets })
    }
}

impl Parts {
    /// Returns the voxels of the model for the distances of the collimator face from the axis.
    pub(crate) fn model_voxels(
        &self,
        osem: &Osem,
        radii: &[f64],
    ) -> Result<ModelVoxels, PhantomError> {
        let camera = &self.camera;
        let half = 0.5 * camera.n_bins() as f64 * camera.pitch();
        let mut reach = [[-half, half]; 2];
        let mut hold = |centre: [f64; 2], half: [f64; 2]| {
            for ([low, high], (c, a)) in reach.iter_mut().zip(centre.into_iter().zip(half)) {
                (*low, *high) = (low.min(c - a), high.max(c + a));
            }
        };
        let attenuation = self.scene.attenuates();
        let models = osem.attenuation && attenuation.is_some();
        let torso = attenuation.and_then(|own| own.torso());
        for organ in torso.iter().chain(self.surroundings.sources()) {
            if organ.activity > 0.0 || (models && organ.attenuation > 0.0) {
                let ([x, y, _], [a, b, _]) = organ.shape.bounds();
                hold([x, y], [a, b]);
            }
        }
        let farthest = radii.iter().copied().fold(0.0, f64::max);
        let width = self.response(osem).sigma(farthest + half);
        let layers = (MARGIN * width / camera.detector().pitch()[1]).ceil();
        let (first, camera) = camera.with_voxels_around(reach, layers)?;
        Ok(ModelVoxels { camera, first })
    }

    /// Returns the response of the model, whose samples are bin averages. For data at bin centres, the variance of a bin average is
    /// subtracted from the intrinsic variance, as far as possible.
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
        // `new` accepts all of these values.
        Collimator::new(response.slope(), response.at_face(), intrinsic).unwrap_or(response)
    }
}

impl ModelVoxels {
    /// Extracts the voxels of a camera from a volume of the model, both `[z][y][x]`.
    pub(super) fn cut(&self, volume: &[f32], camera: &Camera) -> Result<Vec<f32>, PhantomError> {
        let ([nx, ny, _], [own, rows, slices]) =
            (self.camera.grid().shape(), camera.grid().shape());
        let [x, y, z] = self.first;
        let row = |k: usize| ((z + k / rows) * ny + y + k % rows) * nx + x;
        let mut out = zeros("voxels of the reconstruction", slices * rows * own)?;
        for (k, pixels) in out.chunks_mut(own).enumerate() {
            pixels.copy_from_slice(&volume[row(k)..][..own]);
        }
        Ok(out)
    }
}
