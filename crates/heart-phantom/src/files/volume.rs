//! A volume to be written.

use super::names::millimetres;
use crate::error::{PhantomError, check};
use crate::files::Samples;
use revolve_voxel::VoxelGrid;

/// Samples on a voxel grid, index order `[z][y][x]`; lab frame, centimetres, axes along x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume<'a> {
    grid: VoxelGrid,
    samples: Samples<'a>,
}

impl<'a> Volume<'a> {
    /// A volume from the grid that it was made on, so that it is written where it was drawn.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] if there is not one sample a voxel; [`PhantomError::OutOfRange`] if a
    /// sample is not finite, or if spacing or origin in millimetres do not fit into 32 bits, as some
    /// formats keep them.
    pub fn new(grid: VoxelGrid, samples: impl Into<Samples<'a>>) -> Result<Self, PhantomError> {
        let samples = samples.into();
        samples.check("samples of a volume", &grid.shape())?;
        let most = f64::from(f32::MAX) / 10.0;
        for a in 0..3 {
            let least = f64::from(f32::MIN_POSITIVE);
            check("voxel spacing", grid.spacing()[a], [least, most])?;
            check("grid origin", grid.origin()[a], [-most, most])?;
        }
        Ok(Self { grid, samples })
    }

    /// The grid.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The samples, `[z][y][x]`.
    pub fn samples(&self) -> Samples<'a> {
        self.samples
    }

    /// Step between voxels `[x, y, z]` in mm.
    pub(super) fn spacing_mm(&self) -> [f64; 3] {
        self.grid.spacing().map(millimetres)
    }

    /// Centre of the first voxel `[x, y, z]` in mm.
    pub(super) fn origin_mm(&self) -> [f64; 3] {
        self.grid.origin().map(millimetres)
    }
}
