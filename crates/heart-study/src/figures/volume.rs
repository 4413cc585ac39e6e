//! Samples of a volume between the voxels.

use heart_phantom::revolve_voxel::VoxelGrid;
use heart_phantom::revolve_voxel::nalgebra::Point3;

/// A volume on its grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Volume<'a> {
    pub(crate) grid: VoxelGrid,
    /// Samples `[z][y][x]`.
    pub(crate) values: &'a [f32],
}

/// Returns the first and the last edge of a grid along x, y, z in cm.
pub(crate) fn edges(grid: &VoxelGrid) -> [[f64; 2]; 3] {
    let (shape, spacing, origin) = (grid.shape(), grid.spacing(), grid.origin());
    [0, 1, 2].map(|a| {
        let last = origin[a] + (shape[a] - 1) as f64 * spacing[a];
        [origin[a] - 0.5 * spacing[a], last + 0.5 * spacing[a]]
    })
}

impl Volume<'_> {
    /// Returns the index coordinates x, y, z of a point in cm: 0 at the centre of the first voxel.
    pub(crate) fn index(&self, p: &Point3<f64>) -> Point3<f64> {
        let (origin, spacing) = (self.grid.origin(), self.grid.spacing());
        Point3::from([0, 1, 2].map(|a| (p[a] - origin[a]) / spacing[a]))
    }

    /// Returns the value at index coordinates, trilinear between samples, constant beyond the outermost ones.
    pub(crate) fn value(&self, p: &Point3<f64>) -> f64 {
        let size = self.grid.shape();
        let mut cell = [0usize; 3];
        let mut w = [0.0; 3];
        for a in 0..3 {
            let at = p[a].clamp(0.0, (size[a] - 1) as f64);
            cell[a] = (at as usize).min(size[a].saturating_sub(2));
            w[a] = at - cell[a] as f64;
        }
        let [nx, ny, _] = size;
        let at = (cell[2] * ny + cell[1]) * nx + cell[0];
        // A side of one sample has no next one.
        let [x, y, z] =
            [(0, 1), (1, nx), (2, nx * ny)].map(|(a, step)| step.min((size[a] - 1) * step));
        let sample = |i: usize| f64::from(self.values[i]);
        let along = |i: usize| sample(i) * (1.0 - w[0]) + sample(i + x) * w[0];
        let plane = |i: usize| along(i) * (1.0 - w[1]) + along(i + y) * w[1];
        plane(at) * (1.0 - w[2]) + plane(at + z) * w[2]
    }
}
