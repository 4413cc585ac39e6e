//! Many weighted bodies together against single bodies; mirror images against voxels on grids of their own.

use crate::support;

use nalgebra::Vector3;
use revolve_voxel::{Body, Pose, RevolveError, VoxelGrid};
use std::f64::consts::FRAC_PI_4;
use support::*;

const TOLERANCE: f64 = 1e-3;

/// The balloon in three poses with a mirror plane each, on a grid that they map onto itself.
fn mirrored() -> [(Body, VoxelGrid); 3] {
    let cube = VoxelGrid::cube(44, 0.3).unwrap();
    let flat = VoxelGrid::centred([40, 44, 44], [0.34, 0.3, 0.3], [0.07, 0.2, 0.2]).unwrap();
    let along_z = Pose::axis_along_z(5.6).unwrap();
    let tilted = along_z.rotated_x(FRAC_PI_4).unwrap();
    let body = |pose| Body::new(heart(150).layers().to_vec(), pose).unwrap();
    [
        (body(tilted.rotated_y(FRAC_PI_4).unwrap()), cube),
        (body(along_z), cube),
        (
            // The axis along (0, -1, 1) turned to (0, 1, 1), through the middle of the grid.
            body(
                along_z
                    .rotated_x(-FRAC_PI_4)
                    .unwrap()
                    .shifted(Vector3::new(0.4, 0.2, 0.2))
                    .unwrap(),
            ),
            flat,
        ),
    ]
}

#[test]
fn mirror_images_equal_single_voxels() {
    for (body, grid) in mirrored() {
        let (volume, counters) = body.voxelize::<f64>(&grid, TOLERANCE, &[0.3, 1.0]).unwrap();
        assert!(counters.mirrored > 0);
        let [nx, ny, nz] = grid.shape();
        let (mut looked_at, mut partial) = (0, 0);
        for k in (0..nx * ny * nz).step_by(13) {
            let (x, y, z) = (k % nx, k / nx % ny, k / (nx * ny));
            // All voxels at the surface, which are neither full nor empty, and a few others.
            let cut = ![0.0, 0.3, 1.0].contains(&volume[k]);
            if !cut && k % 10 != 0 {
                continue;
            }
            let own: [f64; 3] = grid.centre(x, y, z).coords.into();
            let alone = VoxelGrid::new([1; 3], grid.spacing(), own).unwrap();
            let (one, _) = body
                .voxelize::<f64>(&alone, TOLERANCE, &[0.3, 1.0])
                .unwrap();
            // The same arithmetic on coordinates that differ by rounding.
            assert!((one[0] - volume[k]).abs() < 1e-11, "{x} {y} {z}");
            looked_at += 1;
            partial += usize::from(cut);
        }
        assert!(looked_at > 500 && partial > 200, "{looked_at} {partial}");
    }
}

#[test]
fn several_bodies_equal_the_sum_of_single_bodies() {
    let bodies = [heart(60), heart(80), heart(100)];
    let grid = VoxelGrid::cube(40, 0.32).unwrap();
    let activities = [[0.0, 1.0], [0.4, 0.9], [1.0, 0.0]];
    let moments: Vec<(&Body, &[f64])> = (bodies.iter().zip(&activities))
        .map(|(body, activity)| (body, &activity[..]))
        .collect();
    for tolerance in [TOLERANCE, 0.1] {
        let mut sum = vec![1.0f64; grid.len()];
        let together = Body::voxelize_add(&moments, &grid, 0..40, tolerance, &mut sum).unwrap();
        let (mut one_by_one, mut counters) = (vec![1.0f64; grid.len()], vec![]);
        for m in &moments {
            counters
                .push(Body::voxelize_add(&[*m], &grid, 0..40, tolerance, &mut one_by_one).unwrap());
        }
        for (a, b) in sum.iter().zip(&one_by_one) {
            assert!((a - b).abs() < 1e-14);
        }
        let total = |of: fn(&revolve_voxel::VoxelCounters) -> u64| {
            assert_eq!(of(&together), counters.iter().map(of).sum::<u64>());
        };
        total(|c| c.cut);
        total(|c| c.filled);
        total(|c| c.evaluations);
    }
}

#[test]
fn mirrored_volumes_are_bitwise_independent_of_slabs_and_threads() {
    let (body, grid) = &mirrored()[0];
    let moments = [(body, &[0.05, 0.25][..]), (body, &[0.1, 0.5])];
    let run = |threads: usize, slices: std::ops::Range<usize>| {
        let mut out = vec![0.0f32; grid.slice_len() * slices.len()];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let counters = pool
            .build()
            .unwrap()
            .install(|| Body::voxelize_add(&moments, grid, slices, TOLERANCE, &mut out).unwrap());
        (out, counters)
    };
    let whole = run(1, 0..44);
    assert_eq!(whole, run(3, 0..44));
    let mut at = 0;
    for end in [0, 1, 5, 21, 24, 40, 44] {
        let (slab, _) = run(2, at..end);
        assert!(slab == whole.0[at * grid.slice_len()..end * grid.slice_len()]);
        at = end;
    }
}

#[test]
fn bad_activities_are_rejected() {
    let body = heart(40);
    let grid = VoxelGrid::cube(4, 1.0).unwrap();
    let mut out = vec![0.0f32; 64];
    let mut add = |activity: &[f64], slices| {
        Body::voxelize_add(&[(&body, activity)], &grid, slices, TOLERANCE, &mut out)
    };
    assert!(matches!(
        add(&[1.0], 0..4),
        Err(RevolveError::WrongLength { .. })
    ));
    assert!(matches!(
        add(&[1.0, f64::NAN], 0..4),
        Err(RevolveError::NotFinite { .. })
    ));
    assert!(matches!(
        add(&[f64::INFINITY, 1.0], 0..4),
        Err(RevolveError::NotFinite { .. })
    ));
    for slices in [0..3, 2..6] {
        assert!(matches!(
            add(&[1.0, 1.0], slices),
            Err(RevolveError::WrongLength { .. } | RevolveError::BadRange { .. })
        ));
    }
    assert!(out.iter().all(|v| *v == 0.0));
    assert_eq!(
        Body::voxelize_add(&[], &grid, 0..4, TOLERANCE, &mut out),
        Ok(revolve_voxel::VoxelCounters::default())
    );
}
