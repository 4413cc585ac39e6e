//! What weakens the rays between the heart and the detector.

use crate::error::PhantomError;
use revolve_voxel::{Attenuator, Body, EllipticCylinder, Medium, VoxelGrid};

/// A uniform medium: a torso that stands still, or the heart itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuation {
    /// Attenuation in 1/cm, the same all through the medium.
    pub coefficient: f64,
    /// All within this cylinder attenuates; `None` for cavity and wall, and nothing else.
    pub torso: Option<EllipticCylinder>,
}

impl Attenuation {
    /// The medium with the heart in this shape.
    pub(crate) fn of<'a>(&self, heart: &'a Body) -> Result<Attenuator<'a>, PhantomError> {
        let medium = match self.torso {
            Some(torso) => Medium::Torso(torso),
            None => Medium::Layer(heart, heart.layers().len() - 1),
        };
        Ok(Attenuator::new(self.coefficient, medium)?)
    }

    /// Mean of the attenuation over each voxel, `[z][y][x]`.
    pub(crate) fn map(
        &self,
        heart: &Body,
        grid: &VoxelGrid,
        tolerance: f64,
    ) -> Result<Vec<f32>, PhantomError> {
        let mut out = vec![0.0f32; grid.len()];
        let slices = 0..grid.shape()[2];
        match self.torso {
            Some(torso) => torso.voxelize_add(grid, slices, self.coefficient, &mut out)?,
            None => {
                let everywhere = vec![self.coefficient; heart.layers().len()];
                let sampling = revolve_voxel::Sampling::Coverage { tolerance };
                heart.voxelize_add(grid, slices, sampling, &everywhere, 1.0, &mut out)?;
            }
        }
        Ok(out)
    }
}
