//! Rays to an iso-surface, and values between voxels.

use crate::figures::Volume;
use crate::figures::surface::{STEP, Surface};
use heart_phantom::revolve_voxel::VoxelGrid;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};

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
    let grid = VoxelGrid::cube(N, 1.0).unwrap();
    let values = &values[..];
    let surface = Surface::new(Volume { grid, values }, 1e-6);
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
fn trilinear_is_exact_for_a_product_of_linear_functions() {
    let f = |x: f64, y: f64, z: f64| (1.0 + x) * (2.0 - 0.5 * y) * (3.0 + 0.25 * z);
    let (nx, ny, nz) = (5, 4, 3);
    let values: Vec<f32> = (0..nx * ny * nz)
        .map(|i| f((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64) as f32)
        .collect();
    let grid = VoxelGrid::centred([nx, ny, nz], [0.5; 3], [0.0; 3]).unwrap();
    let values = &values[..];
    let volume = Volume { grid, values };
    for p in [
        [0.0, 0.0, 0.0],
        [3.7, 0.4, 1.2],
        [4.0, 3.0, 2.0],
        [1.5, 2.5, 0.5],
    ] {
        let value = volume.value(&Point3::from(p));
        // The samples are exact in f32, the rest is rounding in f64.
        assert!((value - f(p[0], p[1], p[2])).abs() < 1e-12);
    }
    // The volume's centre is at the origin.
    assert_eq!(volume.index(&Point3::origin()), Point3::new(2.0, 1.5, 1.0));
    assert_eq!(
        volume.index(&Point3::new(0.5, 0.0, -0.5)),
        Point3::new(3.0, 1.5, 0.0)
    );
}
