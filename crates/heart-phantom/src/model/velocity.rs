//! Velocity of the wall.

use super::material::{MaterialPoint, Wall};
use crate::error::PhantomError;
use nalgebra::Point3;
use revolve_voxel::VoxelGrid;
use std::ops::Range;

impl Wall {
    /// Returns the velocities that the material at the centres of the voxels of some slices has in the wall `at` another time: lab vectors in
    /// cm/s, from the walls before and after it, `seconds` apart. Only voxels in the wall are returned, with their indices among these
    /// slices (`[z][y][x]`), ascending.
    pub(crate) fn velocities(
        &self,
        (at, between): (&Wall, [&Wall; 2]),
        seconds: f64,
        grid: &VoxelGrid,
        slices: Range<usize>,
    ) -> Result<Vec<(usize, [f32; 3])>, PhantomError> {
        let velocity = |p: &Point3<f64>, found: [f64; 2], _| {
            let way = at.moved(between, &self.material(found, p)) / seconds;
            [way.x as f32, way.y as f32, way.z as f32]
        };
        let (shell, pose) = self.placed_shell();
        Ok(shell.map_voxels(pose, grid, slices, 0.0, velocity)?)
    }

    /// Returns the velocity of a material point in cm/s, by the walls `seconds` apart before and after this one.
    pub(crate) fn velocity(
        &self,
        between: [&Wall; 2],
        seconds: f64,
        point: &MaterialPoint,
    ) -> Result<[f64; 3], PhantomError> {
        Ok((self.moved(between, &point.checked()?) / seconds).into())
    }
}
