//! Regular voxel grids.

use nalgebra::Point3;

use crate::RevolveError;
use crate::error::{SIZES, countable, finite, positive, within};

/// A regular grid of voxels; volumes on it are indexed `[z][y][x]`, x fastest.
///
/// The centre of voxel k along axis a is at `origin[a] + k * spacing[a]`, a = x, y, z. Numbers of voxels are `[nx, ny, nz]`; the shape of an
/// array is the reverse.
///
/// ```
/// use ndarray::Array3;
/// use revolve_voxel::VoxelGrid;
/// let grid = VoxelGrid::new([4, 3, 2], [0.1; 3], [0.0; 3])?;
/// let [nx, ny, nz] = grid.shape();
/// let volume = Array3::from_shape_vec((nz, ny, nx), vec![0.0_f32; nx * ny * nz])?;
/// assert_eq!(volume[[1, 2, 3]], 0.0); // [z][y][x]
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoxelGrid {
    shape: [usize; 3],
    spacing: [f64; 3],
    origin: [f64; 3],
}

impl VoxelGrid {
    /// Creates a grid from the numbers of voxels `[nx, ny, nz]`, the spacing of each axis and the centre of the first voxel.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a voxel, [`RevolveError::NotPositive`] for a spacing, [`RevolveError::NotFinite`],
    /// [`RevolveError::OutOfRange`] for a spacing below 1e-100 or above 1e100, [`RevolveError::TooLarge`] for more voxels than can be addressed.
    pub fn new(
        shape: [usize; 3],
        spacing: [f64; 3],
        origin: [f64; 3],
    ) -> Result<Self, RevolveError> {
        countable("voxels", &shape)?;
        for a in 0..3 {
            within(
                "voxel spacing",
                positive("voxel spacing", spacing[a])?,
                SIZES,
            )?;
            finite("grid origin", origin[a])?;
        }
        Ok(Self {
            shape,
            spacing,
            origin,
        })
    }

    /// Creates a grid centred at `offset`: centre k of n at `(k - (n-1)/2) * spacing + offset`.
    ///
    /// # Errors
    /// As [`VoxelGrid::new`].
    pub fn centred(
        shape: [usize; 3],
        spacing: [f64; 3],
        offset: [f64; 3],
    ) -> Result<Self, RevolveError> {
        let first = |a: usize| offset[a] - 0.5 * (shape[a] as f64 - 1.0) * spacing[a];
        Self::new(shape, spacing, [first(0), first(1), first(2)])
    }

    /// Creates a cubic grid of n voxels along each edge, centred at the origin.
    ///
    /// # Errors
    /// As [`VoxelGrid::new`].
    pub fn cube(n: usize, spacing: f64) -> Result<Self, RevolveError> {
        Self::centred([n; 3], [spacing; 3], [0.0; 3])
    }

    /// Returns the numbers of voxels `[nx, ny, nz]`.
    #[must_use]
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Returns the spacing `[dx, dy, dz]`.
    #[must_use]
    pub fn spacing(&self) -> [f64; 3] {
        self.spacing
    }

    /// Returns the centre of the first voxel.
    #[must_use]
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Returns the number of voxels.
    #[allow(clippy::len_without_is_empty)] // never empty
    #[must_use]
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns the number of voxels in one z slice.
    #[must_use]
    pub fn slice_len(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Returns the volume of one voxel.
    #[must_use]
    pub fn voxel_volume(&self) -> f64 {
        self.spacing.iter().product()
    }

    /// Returns the centre of voxel (ix, iy, iz).
    #[must_use]
    pub fn centre(&self, ix: usize, iy: usize, iz: usize) -> Point3<f64> {
        let at = |a: usize, k: usize| self.origin[a] + k as f64 * self.spacing[a];
        Point3::new(at(0, ix), at(1, iy), at(2, iz))
    }
}
