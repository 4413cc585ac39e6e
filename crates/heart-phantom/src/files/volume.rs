//! A volume to be written.

use super::names::millimetres;
use crate::error::{PhantomError, check};
use crate::files::Samples;
use crate::files::samples::gates_of;
use revolve_voxel::VoxelGrid;

/// Samples on a voxel grid, index order `[z][y][x]`; lab frame, centimetres, axes along x, y, z. Of the gates of a beat `[gate][z][y][x]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume<'a> {
    grid: VoxelGrid,
    samples: Samples<'a>,
    seconds: Option<f64>,
    study: Option<&'a str>,
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
        Ok(Self {
            grid,
            samples,
            seconds: None,
            study: None,
        })
    }

    /// The volumes of the gates of a beat, `[gate][z][y][x]`, `seconds` from one to the next: one file for all of them.
    ///
    /// ```
    /// use heart_phantom::files::{Format, Volume, write_volume};
    /// use heart_phantom::revolve_voxel::VoxelGrid;
    /// let grid = VoxelGrid::centred([4, 3, 2], [0.1; 3], [0.0; 3])?;
    /// let beat = vec![0.5_f32; 8 * 24];
    /// let volume = Volume::of_gates(grid, &beat, 0.125)?; // 8 gates of a beat of a second
    /// let folder = tempfile::tempdir()?; // or any other
    /// write_volume(&folder.path().join("beat.nii"), &volume, Format::Nifti)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Volume::new`], with a number of samples that is no multiple of that of the voxels; [`PhantomError::OutOfRange`] if `seconds` is
    /// not positive.
    pub fn of_gates(
        grid: VoxelGrid,
        samples: impl Into<Samples<'a>>,
        seconds: f64,
    ) -> Result<Self, PhantomError> {
        let samples = samples.into();
        let first = gates_of(samples, grid.len(), seconds)?;
        let volume = Self::new(grid, first)?;
        samples.check("samples of a volume", &[samples.len()])?;
        Ok(Self {
            samples,
            seconds: Some(seconds),
            ..volume
        })
    }

    /// The same as part of a study: files with one name of a study belong together where a format knows of studies (DICOM). Any text,
    /// such as that of a scene.
    pub fn with_study(mut self, name: &'a str) -> Self {
        self.study = Some(name);
        self
    }

    /// Seconds from one gate to the next, of volumes of gates.
    pub fn seconds_per_gate(&self) -> Option<f64> {
        self.seconds
    }

    /// Number of gates, or 1.
    pub fn n_gates(&self) -> usize {
        self.samples.len() / self.grid.len().max(1)
    }

    /// The name of the study.
    pub fn study(&self) -> Option<&'a str> {
        self.study
    }

    /// The grid.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The samples, `[z][y][x]` or `[gate][z][y][x]`.
    pub fn samples(&self) -> Samples<'a> {
        self.samples
    }

    /// Its axes from slowest to fastest.
    pub(super) fn axes(&self) -> Vec<usize> {
        let [nx, ny, nz] = self.grid.shape();
        let gates = self.seconds.map(|_| self.n_gates());
        gates.into_iter().chain([nz, ny, nx]).collect()
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
