//! Velocity of the wall.

use super::material::{MaterialPoint, Wall};
use crate::error::PhantomError;
use nalgebra::{Point3, Vector3};
use revolve_voxel::VoxelGrid;
use std::ops::Range;

impl Wall {
    /// Returns the velocities of the material at the centres of the voxels of some slices: lab vectors in cm/s, from its positions
    /// at two other times `seconds` apart. Only voxels in the wall are returned, with their indices among these slices
    /// (`[z][y][x]`), ascending.
    pub(crate) fn velocities(
        &self,
        between: [&Wall; 2],
        seconds: f64,
        grid: &VoxelGrid,
        slices: Range<usize>,
    ) -> Result<Vec<(usize, [f32; 3])>, PhantomError> {
        let velocity = |p: &Point3<f64>, found: [f64; 2]| {
            let way = moved(between, &self.material(found, p)) / seconds;
            [way.x as f32, way.y as f32, way.z as f32]
        };
        let (shell, pose) = self.placed_shell();
        Ok(shell.map_voxels(pose, grid, slices, velocity)?)
    }

    /// Returns the velocity of a material point in cm/s, from its positions in two walls `seconds` apart.
    pub(crate) fn velocity(
        between: [&Wall; 2],
        seconds: f64,
        point: &MaterialPoint,
    ) -> Result<[f64; 3], PhantomError> {
        Ok((moved(between, &point.checked()?) / seconds).into())
    }
}

fn moved([from, to]: [&Wall; 2], point: &MaterialPoint) -> Vector3<f64> {
    to.place(point) - from.place(point)
}
