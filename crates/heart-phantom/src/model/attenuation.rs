//! What weakens the rays between the heart and the detector.

use crate::error::PhantomError;
use revolve_voxel::{Attenuator, Body, EllipticCylinder, Medium, Organs, VoxelGrid};

/// A uniform medium: a torso that stands still, or the heart itself, around which organs may have attenuations of their own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuation {
    /// Attenuation in 1/cm, the same all through the medium.
    pub coefficient: f64,
    /// All within this cylinder attenuates; `None` for cavity and wall, and nothing else.
    pub torso: Option<EllipticCylinder>,
}

impl Attenuation {
    /// The medium with the heart in this shape, and with what is around it.
    pub(crate) fn of<'a>(
        &self,
        heart: &'a Body,
        organs: Option<&'a Organs>,
    ) -> Result<Attenuator<'a>, PhantomError> {
        let medium = match (self.torso, organs) {
            (Some(torso), _) => Medium::Torso(torso),
            (None, Some(organs)) => Medium::Around(organs, heart),
            (None, None) => Medium::Layer(heart, heart.layers().len() - 1),
        };
        Ok(Attenuator::new(self.coefficient, medium)?)
    }

    /// Mean of the attenuation over each voxel, `[z][y][x]`.
    pub(crate) fn map(
        &self,
        heart: &Body,
        organs: Option<&Organs>,
        grid: &VoxelGrid,
        tolerance: f64,
    ) -> Result<Vec<f32>, PhantomError> {
        let mut out = vec![0.0f32; grid.len()];
        let slices = 0..grid.shape()[2];
        let around: Option<Vec<f32>> = organs
            .map(|organs| organs.voxelize(grid, slices.clone(), |organ| organ.attenuation))
            .transpose()?;
        match self.torso {
            Some(torso) => torso.voxelize_add(grid, slices, self.coefficient, &mut out)?,
            None => {
                // Beside organs the share that is the heart's.
                let own = around.as_ref().map_or(self.coefficient, |_| 1.0);
                let everywhere = vec![own; heart.layers().len()];
                let sampling = revolve_voxel::Sampling::Coverage { tolerance };
                heart.voxelize_add(grid, slices, sampling, &everywhere, 1.0, &mut out)?;
            }
        }
        for (voxel, under) in out.iter_mut().zip(around.into_iter().flatten()) {
            *voxel = under + *voxel * (self.coefficient as f32 - under);
        }
        Ok(out)
    }
}
