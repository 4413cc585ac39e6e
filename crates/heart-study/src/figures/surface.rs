//! Iso-surfaces of a volume: the first point of a ray at a level, and the normal there.

use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::Volume;

/// Step along a ray, voxels.
const STEP: f64 = 1.0;

/// A volume with the bounding box of its samples above the level.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    volume: &'a Volume<'a>,
    level: f32,
    /// Samples along x, y, z.
    size: [usize; 3],
    /// Index coordinates that contain all cells with such a sample: lowest and highest of x, y, z.
    around: [[f64; 2]; 3],
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
    pub(super) fn new(volume: &'a Volume<'a>, level: f32) -> Self {
        let [nz, ny, nx] = volume.size;
        let size = [nx, ny, nz];
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
        let around = match reached {
            // The cells around a sample end at its neighbours.
            Some(reached) => [0, 1, 2].map(|a| {
                let [first, last] = reached[a];
                [first.saturating_sub(1), (last + 1).min(size[a] - 1)].map(|k| k as f64)
            }),
            None => [[f64::INFINITY, f64::NEG_INFINITY]; 3],
        };
        Self {
            volume,
            level,
            size,
            around,
        }
    }

    /// Index coordinates (voxels, x y z) of a point in cm.
    pub(super) fn index(&self, p: &Point3<f64>) -> Point3<f64> {
        let at = |a: usize| p[a] / self.volume.spacing + 0.5 * (self.size[a] as f64 - 1.0);
        Point3::new(at(0), at(1), at(2))
    }

    /// Returns the [trilinear] value at index coordinates.
    pub(super) fn value(&self, p: &Point3<f64>) -> f64 {
        trilinear(self.volume.values, self.size, p)
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
        for a in 0..3 {
            let [low, high] = self.around[a];
            if low > high {
                return None;
            }
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
            if self.value(&p) >= level {
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
            if t >= end {
                return None;
            }
            below = Some(t);
            t = (t + STEP).min(end);
        }
    }
}

/// Returns a volume of `[nx, ny, nz]` samples at index coordinates x, y, z, trilinear between samples, constant beyond its faces.
pub(crate) fn trilinear(values: &[f32], size: [usize; 3], p: &Point3<f64>) -> f64 {
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
    let [x, y, z] = [(0, 1), (1, nx), (2, nx * ny)].map(|(a, step)| step.min((size[a] - 1) * step));
    let along = |i: usize| f64::from(values[i]) * (1.0 - w[0]) + f64::from(values[i + x]) * w[0];
    let plane = |i: usize| along(i) * (1.0 - w[1]) + along(i + y) * w[1];
    plane(at) * (1.0 - w[2]) + plane(at + z) * w[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 40;
    const RADIUS: f64 = 13.0;

    /// Radius less distance from an off-centre point, voxels.
    fn ball(centre: [f64; 3]) -> Vec<f32> {
        (0..N * N * N)
            .map(|i| {
                let at = [i % N, i / N % N, i / N / N].map(|k| k as f64);
                let d: f64 = (0..3).map(|a| (at[a] - centre[a]).powi(2)).sum();
                (RADIUS - d.sqrt()) as f32
            })
            .collect()
    }

    const CENTRE: [f64; 3] = [21.3, 18.6, 17.9];

    #[test]
    fn rays_intersect_a_ball_with_its_normal() {
        let values = ball(CENTRE);
        let volume = Volume {
            values: &values,
            size: [N; 3],
            spacing: 1.0,
        };
        let surface = Surface::new(&volume, 1e-6);
        let centre = Point3::from(CENTRE);
        let mut n_hits = 0;
        for k in 0..400 {
            // Directions over the sphere, offsets within the ball and just beyond.
            let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / 400.0;
            let turn = f64::from(k) * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let along = Vector3::new(r * turn.cos(), r * turn.sin(), z);
            let across = along.cross(&Vector3::new(0.3, -0.8, 0.5)).normalize();
            let off = 1.1 * RADIUS * f64::from(k % 23) / 22.0;
            let origin = centre + off * across;
            let found = surface.first(&origin, &along, -100.0, 100.0);
            if off < 0.95 * RADIUS {
                let found = found.expect("the ray passes through the ball");
                assert!(!found.inside_at_start);
                let p = origin + found.t * along;
                // The error of linear interpolation of a distance is at most h^2 / (4 r) across two axes, and that of ten halvings 2^-10 of a step.
                let room = 1.0 / (4.0 * RADIUS) + STEP / 1024.0;
                assert!(
                    ((p - centre).norm() - RADIUS).abs() < room,
                    "{}",
                    (p - centre).norm()
                );
                assert!((p - centre).dot(&along) < 0.0, "the near side");
                let normal = surface.normal(&p).unwrap();
                // Central differences of interpolated distances: h^2 / r^2 or 0.006, with room for the cells' corners.
                assert!((normal - (p - centre).normalize()).norm() < 0.02);
                n_hits += 1;
            } else if off > 1.01 * RADIUS {
                assert!(found.is_none());
            }
        }
        assert!(n_hits > 300);
    }

    #[test]
    fn a_ray_that_starts_inside_is_marked() {
        let values = ball(CENTRE);
        let volume = Volume {
            values: &values,
            size: [N; 3],
            spacing: 1.0,
        };
        let surface = Surface::new(&volume, 1.0);
        let found = surface
            .first(&Point3::from(CENTRE), &Vector3::x(), 0.0, 100.0)
            .unwrap();
        assert!(found.inside_at_start && found.t == 0.0);
    }

    #[test]
    fn trilinear_is_exact_for_a_product_of_linear_functions() {
        let f = |x: f64, y: f64, z: f64| (1.0 + x) * (2.0 - 0.5 * y) * (3.0 + 0.25 * z);
        let (nx, ny, nz) = (5, 4, 3);
        let values: Vec<f32> = (0..nx * ny * nz)
            .map(|i| f((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64) as f32)
            .collect();
        let volume = Volume {
            values: &values,
            size: [nz, ny, nx],
            spacing: 0.5,
        };
        let surface = Surface::new(&volume, 1.0);
        for p in [
            [0.0, 0.0, 0.0],
            [3.7, 0.4, 1.2],
            [4.0, 3.0, 2.0],
            [1.5, 2.5, 0.5],
        ] {
            let value = surface.value(&Point3::from(p));
            // The samples are exact in f32, the rest is rounding in f64.
            assert!((value - f(p[0], p[1], p[2])).abs() < 1e-12);
        }
        // The volume's centre is at the origin.
        assert_eq!(surface.index(&Point3::origin()), Point3::new(2.0, 1.5, 1.0));
        assert_eq!(
            surface.index(&Point3::new(0.5, 0.0, -0.5)),
            Point3::new(3.0, 1.5, 0.0)
        );
    }
}
