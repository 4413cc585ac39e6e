//! Iso-surfaces of a volume: the first point of a ray at a level, and the normal there.

use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::volume::Volume;

/// Step along a ray, voxels.
pub(super) const STEP: f64 = 1.0;

/// A volume with the bounding box of its samples above the level.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    volume: Volume<'a>,
    level: f32,
    /// Index coordinates that contain all cells with such a sample, lowest and highest of x, y, z; `None` without one.
    around: Option<[[f64; 2]; 3]>,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Distance along the ray, voxels.
    pub(super) t: f64,
    /// Whether the ray started inside: a face of the cut or of the volume, not the surface.
    pub(super) inside_at_start: bool,
}

impl<'a> Surface<'a> {
    pub(super) fn new(volume: Volume<'a>, level: f32) -> Self {
        let size = volume.grid.shape();
        let [nx, ny, _] = size;
        let box_of_row = |(row, samples): (usize, &[f32])| {
            let first = samples.iter().position(|&v| v >= level)?;
            let last = samples.iter().rposition(|&v| v >= level)?;
            let (y, z) = (row % ny, row / ny);
            Some([[first, last], [y, y], [z, z]])
        };
        let union = |a: [[usize; 2]; 3], b: [[usize; 2]; 3]| {
            [0, 1, 2].map(|k| [a[k][0].min(b[k][0]), a[k][1].max(b[k][1])])
        };
        let reached = (volume.values.par_chunks(nx).enumerate())
            .filter_map(box_of_row)
            .reduce_with(union);
        // The cells around a sample end at its neighbours.
        let around = reached.map(|reached| {
            [0, 1, 2].map(|a| {
                let [first, last] = reached[a];
                [first.saturating_sub(1), (last + 1).min(size[a] - 1)].map(|k| k as f64)
            })
        });
        Self {
            volume,
            level,
            around,
        }
    }

    /// The outward unit normal: against the gradient, central differences a voxel wide of the interpolated volume.
    pub(super) fn normal(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let slope = |d: Vector3<f64>| self.volume.value(&(p - d)) - self.volume.value(&(p + d));
        Vector3::new(
            slope(Vector3::x()),
            slope(Vector3::y()),
            slope(Vector3::z()),
        )
        .try_normalize(1e-12)
    }

    /// Returns the first point of the ray from `origin` along the unit vector `along`, both in voxels, at the level, between `from`
    /// and `to`.
    pub(super) fn first(
        &self,
        origin: &Point3<f64>,
        along: &Vector3<f64>,
        from: f64,
        to: f64,
    ) -> Option<Found> {
        let (mut t, mut end) = (from, to);
        for (a, [low, high]) in self.around?.into_iter().enumerate() {
            if along[a] == 0.0 {
                if !(low <= origin[a] && origin[a] <= high) {
                    return None;
                }
                continue;
            }
            let (one, two) = ((low - origin[a]) / along[a], (high - origin[a]) / along[a]);
            t = t.max(one.min(two));
            end = end.min(one.max(two));
        }
        if t > end {
            return None;
        }
        let level = f64::from(self.level);
        // Samples at the faces of the box are below the level, so a ray starts inside only at a face of the volume or the cut.
        let mut below: Option<f64> = None;
        loop {
            let p = origin + t * along;
            if self.volume.value(&p) >= level {
                let Some(mut low) = below else {
                    return Some(Found {
                        t,
                        inside_at_start: true,
                    });
                };
                let mut high = t;
                // Ten bisections of a voxel: far below a pixel.
                for _ in 0..10 {
                    let middle = 0.5 * (low + high);
                    if self.volume.value(&(origin + middle * along)) >= level {
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
            if t >= end {
                return None;
            }
            below = Some(t);
            t = (t + STEP).min(end);
        }
    }
}
