//! Motion of the surroundings of the wall: that of the nearest material, decreasing with distance.

use super::material::Wall;
use crate::error::PhantomError;
use nalgebra::Point3;
use revolve_voxel::VoxelGrid;
use std::f64::consts::PI;

/// Distances from the wall, cm, that define the motion of the surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    /// Full displacement up to this distance.
    pub(crate) whole: f64,
    /// No displacement from this distance.
    pub(crate) none: f64,
}

impl Reach {
    /// Returns the fraction of the displacement at a distance.
    fn share(self, distance: f64) -> f64 {
        if distance <= self.whole {
            return 1.0;
        }
        let along = (distance - self.whole) / (self.none - self.whole);
        0.5 * (1.0 + (PI * along.min(1.0)).cos())
    }
}

impl Wall {
    /// As [`Wall::displacements`], including the surroundings, which move with the nearest material, decreasing with distance.
    pub(crate) fn displacements_around(
        &self,
        to: &Wall,
        grid: &VoxelGrid,
        reach: Reach,
    ) -> Result<Vec<(usize, [f32; 3])>, PhantomError> {
        let (shell, pose) = self.placed_shell();
        let moved = |p: &Point3<f64>, material: [f64; 2], distance: f64| {
            let [layer, at] = material;
            let off = match distance > 0.0 {
                false => [0.0; 2],
                true => {
                    let [x, r] = shell.point(layer, at);
                    [p.x - x, p.y.hypot(p.z) - r]
                }
            };
            let way = self.way(to, p, material, off) * reach.share(distance);
            [way.x as f32, way.y as f32, way.z as f32]
        };
        let slices = 0..grid.shape()[2];
        Ok(shell.map_voxels(pose, grid, slices, reach.none, moved)?)
    }

    /// Returns the largest displacement of sampled points of the wall, cm.
    pub(crate) fn longest_way(&self, to: &Wall) -> f64 {
        let mut longest = 0.0f64;
        for k in 0..8 * 4 * 2 {
            let point = super::material::MaterialPoint {
                layer: (k % 2) as f64,
                s: 0.5 * (k / 8) as f64 / 7.0,
                azimuth: 0.5 * PI * (k / 2 % 4) as f64,
            };
            longest = longest.max((to.place(&point) - self.place(&point)).norm());
        }
        longest
    }
}
