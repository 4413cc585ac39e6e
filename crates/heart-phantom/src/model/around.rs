//! How what is around the wall moves: with the nearest material, and less the farther away.

use super::material::Wall;
use crate::error::PhantomError;
use nalgebra::Point3;
use revolve_voxel::{NearestMaterial, VoxelGrid};
use std::f64::consts::PI;

/// How far the wall takes along what is next to it, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    /// All of its way up to this distance from it.
    pub(crate) whole: f64,
    /// Nothing of it from this distance on.
    pub(crate) none: f64,
}

impl Reach {
    /// The share of the way at a distance.
    fn share(self, distance: f64) -> f64 {
        if distance <= self.whole {
            return 1.0;
        }
        let along = (distance - self.whole) / (self.none - self.whole);
        0.5 * (1.0 + (PI * along.min(1.0)).cos())
    }
}

impl Wall {
    /// As [`Wall::displacements`], of what is near the wall too: it goes the way of the nearest material, less from some distance on.
    pub(crate) fn displacements_around(
        &self,
        to: &Wall,
        grid: &VoxelGrid,
        reach: Reach,
    ) -> Result<Vec<(usize, [f32; 3])>, PhantomError> {
        let (shell, pose) = self.standing_shell();
        let moved = |p: &Point3<f64>, nearest: &NearestMaterial| {
            let [layer, at] = nearest.material;
            let off = match nearest.distance > 0.0 {
                false => [0.0; 2],
                true => {
                    let [x, r] = shell.point(layer, at);
                    [p.x - x, p.y.hypot(p.z) - r]
                }
            };
            let way = self.way(to, p, nearest.material, off) * reach.share(nearest.distance);
            [way.x as f32, way.y as f32, way.z as f32]
        };
        let slices = 0..grid.shape()[2];
        Ok(shell.map_voxels_around(pose, grid, slices, reach.none, moved)?)
    }

    /// The longest way that any of some points of the wall goes, cm.
    pub(crate) fn longest_way(&self, to: &Wall) -> f64 {
        let mut longest = 0.0f64;
        for k in 0..8 * 4 * 2 {
            let point = super::MaterialPoint {
                layer: (k % 2) as f64,
                s: 0.5 * (k / 8) as f64 / 7.0,
                azimuth: 0.5 * PI * (k / 2 % 4) as f64,
            };
            longest = longest.max((to.place(&point) - self.place(&point)).norm());
        }
        longest
    }
}
