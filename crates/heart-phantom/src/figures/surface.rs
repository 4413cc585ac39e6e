//! Iso-surfaces of a volume: where along a ray the interpolated volume first reaches a level, and the normal there.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::Volume;

/// Voxels along a block; blocks that stay below the level are passed in one stride.
const BLOCK: usize = 8;
/// Step along a ray inside the other blocks, voxels.
const STEP: f64 = 0.5;

/// A volume with the largest sample of each block.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    volume: &'a Volume<'a>,
    level: f32,
    /// Samples along x, y, z.
    size: [usize; 3],
    /// Blocks along x, y, z.
    n_blocks: [usize; 3],
    /// Whether a block reaches the level anywhere, `[z][y][x]`.
    reaches: Vec<bool>,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Distance along the ray, voxels.
    pub(super) t: f64,
    /// Whether the ray was inside already where it began: a face of the cut or of the volume, not the surface.
    pub(super) inside_at_start: bool,
}

impl<'a> Surface<'a> {
    pub(super) fn new(volume: &'a Volume<'a>, level: f32) -> Self {
        let [nz, ny, nx] = volume.size;
        let size = [nx, ny, nz];
        // Cells lie between samples, so a block of BLOCK cells has BLOCK + 1 samples a side.
        let n_blocks = size.map(|n| (n - 1).div_ceil(BLOCK));
        let [bx, by, _] = n_blocks;
        let reaches = (0..n_blocks.iter().product::<usize>())
            .into_par_iter()
            .with_min_len(bx)
            .map(|i| {
                let first = [i % bx, i / bx % by, i / bx / by].map(|b| b * BLOCK);
                let last: [usize; 3] = std::array::from_fn(|a| (first[a] + BLOCK).min(size[a] - 1));
                (first[2]..=last[2]).any(|z| {
                    (first[1]..=last[1]).any(|y| {
                        let row = (z * ny + y) * nx;
                        volume.values[row + first[0]..=row + last[0]]
                            .iter()
                            .any(|&v| v >= level)
                    })
                })
            })
            .collect();
        Self {
            volume,
            level,
            size,
            n_blocks,
            reaches,
        }
    }

    /// Index coordinates (voxels, x y z) of a point in cm.
    pub(super) fn index(&self, p: &Point3<f64>) -> Point3<f64> {
        let at = |a: usize| p[a] / self.volume.spacing + 0.5 * (self.size[a] as f64 - 1.0);
        Point3::new(at(0), at(1), at(2))
    }

    /// The volume at index coordinates, trilinear between samples, held constant beyond its faces.
    pub(super) fn value(&self, p: &Point3<f64>) -> f64 {
        let mut cell = [0usize; 3];
        let mut w = [0.0; 3];
        for a in 0..3 {
            let at = p[a].clamp(0.0, (self.size[a] - 1) as f64);
            cell[a] = (at as usize).min(self.size[a] - 2);
            w[a] = at - cell[a] as f64;
        }
        let [nx, ny, _] = self.size;
        let at = (cell[2] * ny + cell[1]) * nx + cell[0];
        let values = self.volume.values;
        let along =
            |i: usize| f64::from(values[i]) * (1.0 - w[0]) + f64::from(values[i + 1]) * w[0];
        let plane = |i: usize| along(i) * (1.0 - w[1]) + along(i + nx) * w[1];
        plane(at) * (1.0 - w[2]) + plane(at + nx * ny) * w[2]
    }

    /// The outward unit normal: against the gradient, central differences a voxel wide of the interpolated volume.
    pub(super) fn normal(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let slope = |d: Vector3<f64>| self.value(&(p - d)) - self.value(&(p + d));
        Vector3::new(
            slope(Vector3::x()),
            slope(Vector3::y()),
            slope(Vector3::z()),
        )
        .try_normalize(1e-12)
    }

    /// Where the ray from `origin` along the unit vector `along`, both in voxels, first reaches the level at or after
    /// `from` and before `to`.
    pub(super) fn first(
        &self,
        origin: &Point3<f64>,
        along: &Vector3<f64>,
        from: f64,
        to: f64,
    ) -> Option<Found> {
        let (mut t, mut end) = (from, to);
        for a in 0..3 {
            let last = (self.size[a] - 1) as f64;
            if along[a] == 0.0 {
                if origin[a] < 0.0 || origin[a] > last {
                    return None;
                }
                continue;
            }
            let (one, two) = (-origin[a] / along[a], (last - origin[a]) / along[a]);
            t = t.max(one.min(two));
            end = end.min(one.max(two));
        }
        let level = f64::from(self.level);
        let mut below: Option<f64> = None;
        while t < end {
            let p = origin + t * along;
            let skip = self.to_block_end(&p, along);
            if let Some(far) = skip {
                // A hair more, so that rounding cannot keep the ray on the face it leaves.
                t += far + 1e-9 * (1.0 + t.abs());
                below = Some(t.min(end));
                continue;
            }
            if self.value(&p) >= level {
                let Some(mut low) = below else {
                    return Some(Found {
                        t,
                        inside_at_start: true,
                    });
                };
                let mut high = t;
                // Ten halvings of half a voxel: far below what a pixel shows.
                for _ in 0..10 {
                    let middle = 0.5 * (low + high);
                    if self.value(&(origin + middle * along)) >= level {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                return Some(Found {
                    t: high,
                    inside_at_start: false,
                });
            }
            below = Some(t);
            t += STEP;
        }
        None
    }

    /// If the block that holds `p` stays below the level, how far the ray runs inside it.
    fn to_block_end(&self, p: &Point3<f64>, along: &Vector3<f64>) -> Option<f64> {
        let mut block = [0usize; 3];
        let mut far = f64::INFINITY;
        for a in 0..3 {
            block[a] = ((p[a].max(0.0) as usize) / BLOCK).min(self.n_blocks[a] - 1);
            if along[a] != 0.0 {
                let face = (block[a] + usize::from(along[a] > 0.0)) * BLOCK;
                far = far.min(((face as f64 - p[a]) / along[a]).max(0.0));
            }
        }
        let [bx, by, _] = self.n_blocks;
        (!self.reaches[(block[2] * by + block[1]) * bx + block[0]]).then_some(far)
    }
}
