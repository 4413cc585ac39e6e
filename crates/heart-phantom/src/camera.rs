//! The camera: where the views look from and how finely they are sampled.

use crate::error::PhantomError;
use revolve_voxel::{ParallelDetector, ParallelRays, VoxelGrid};
use std::f64::consts::PI;

/// A parallel-hole camera that turns by 180 degrees about the lab's z axis, and the voxels that
/// are reconstructed from it.
///
/// View `k` of `n` looks from `theta_k = k pi / n`: bins lie along `(cos theta, sin theta, 0)`, rays
/// run along `(-sin theta, cos theta, 0)`, rows lie along z. Bins, rows and voxels have the same
/// pitch and are centred: number `k` of `m` at `(k - (m - 1) / 2) * pitch`.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    geometry: radon::ParallelGeometry,
    detector: ParallelDetector,
    grid: VoxelGrid,
    image: radon::ImageGrid,
}

impl Camera {
    /// `n_views` views of `size` bins and `size` rows that fill a field of view `field` cm wide.
    ///
    /// # Errors
    /// [`PhantomError::Radon`] or [`PhantomError::Solid`] if a count is zero or `field` is not
    /// finite and positive.
    pub fn new(n_views: usize, size: usize, field: f64) -> Result<Self, PhantomError> {
        let pitch = field / size as f64;
        Ok(Self {
            geometry: radon::ParallelGeometry::uniform(n_views, PI, size, pitch)?,
            detector: ParallelDetector::new(size, size, [pitch; 2])?,
            grid: VoxelGrid::cube(size, pitch)?,
            image: radon::ImageGrid::square(size, pitch)?,
        })
    }

    /// Angles and bins, as the reconstruction needs them.
    pub fn geometry(&self) -> &radon::ParallelGeometry {
        &self.geometry
    }

    /// The voxels, index order `[z][y][x]`.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The pixels of one slice, index order `[y][x]`.
    pub fn image(&self) -> &radon::ImageGrid {
        &self.image
    }

    /// Number of views.
    pub fn n_views(&self) -> usize {
        self.geometry.n_views()
    }

    /// Bins of a view and voxels along an edge.
    pub fn size(&self) -> usize {
        self.geometry.n_bins()
    }

    /// Pitch of bins, rows and voxels in cm.
    pub fn pitch(&self) -> f64 {
        self.geometry.pitch()
    }

    /// The rays of one view, image order `[row][bin]`.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such view.
    pub fn rays(&self, view_idx: usize) -> Result<ParallelRays, PhantomError> {
        let angles = self.geometry.angles();
        let theta = *angles.get(view_idx).ok_or(PhantomError::Count {
            what: "view_idx",
            given: view_idx,
            min: 0,
            max: angles.len() - 1,
        })?;
        Ok(self.detector.rays(theta)?)
    }
}
