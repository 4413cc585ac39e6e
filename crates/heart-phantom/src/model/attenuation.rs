//! Attenuation between the heart and the detector.

use crate::error::{PhantomError, zeros};
#[cfg(feature = "scene")]
use crate::scene::exactly;
use revolve_voxel::{Body, EllipticCylinder, Organs, VoxelGrid};

/// `[attenuation]`: a uniform medium.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Attenuation {
    /// Attenuation coefficient of the medium in 1/cm.
    pub coefficient: f64,
    /// The medium.
    pub medium: Medium,
}

/// The attenuating volume.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum Medium {
    /// Cavity and wall; organs have their own coefficients.
    Heart,
    /// A stationary, infinite elliptic cylinder along z.
    Torso {
        /// Position of the axis, `[x, y]` in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        centre: [f64; 2],
        /// Semi-axes along x and y in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        semi_axes: [f64; 2],
    },
}

impl Attenuation {
    /// Returns the torso of a validated scene; `None` if the heart attenuates.
    pub(crate) fn torso(&self) -> Option<EllipticCylinder> {
        match self.medium {
            Medium::Heart => None,
            Medium::Torso { centre, semi_axes } => EllipticCylinder::new(centre, semi_axes).ok(),
        }
    }

    /// Returns the average attenuation of each voxel, `[z][y][x]`.
    pub(crate) fn map(
        &self,
        heart: &Body,
        organs: Option<&Organs>,
        grid: &VoxelGrid,
        tolerance: f64,
    ) -> Result<Vec<f32>, PhantomError> {
        let mut out: Vec<f32> = zeros("voxels of the attenuation map", grid.len())?;
        let slices = 0..grid.shape()[2];
        let around: Option<Vec<f32>> = organs
            .map(|organs| organs.voxelize(grid, slices.clone(), |organ| organ.attenuation))
            .transpose()?;
        match self.torso() {
            Some(torso) => torso.voxelize_add(grid, slices, self.coefficient, &mut out)?,
            None => {
                // With organs: the volume fraction of the heart.
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
