//! Voxels of any shape: the tolerance is met, and the work is bounded.

use crate::support;

use nalgebra::Point3;
use proptest::prelude::*;
use revolve_voxel::{Body, Meridian, Pose, VoxelGrid};
use support::*;

/// Side of the grid of the finest voxels.
const N: usize = 64;

/// Counts evaluations of the surface and cut voxels in a grid of the heart; of many slices only those in the middle.
fn work(spacing: [f64; 3], tolerance: f64) -> [f64; 2] {
    let shape = spacing.map(|h| (18.0 / h).ceil() as usize);
    let grid = VoxelGrid::centred(shape, spacing, [0.01, -0.02, 0.03]).unwrap();
    let n = shape[2].min(64);
    let first = (shape[2] - n) / 2;
    let mut slices = vec![0.0; grid.slice_len() * n];
    let counters = voxelize_add(
        &heart(400),
        &grid,
        first..first + n,
        tolerance,
        &[0.0, 1.0],
        &mut slices,
    )
    .unwrap();
    [counters.evaluations as f64, counters.cut as f64]
}

#[test]
fn long_voxels_cost_no_more_than_their_cubes() {
    let h = 0.3;
    for tolerance in [1e-2, 1e-3] {
        let [cubes, _] = work([h; 3], tolerance);
        for log in [1, 2, 3, 6, 12] {
            let long = h * f64::from(1 << log);
            for spacing in [[long, h, h], [h, h, long], [long, long, h], [h, long, long]] {
                let [all, cut] = work(spacing, tolerance);
                // One more evaluation per bisection of an edge, which is significant compared with the few of a cube.
                assert!(
                    all < (1.6 + 0.3 * f64::from(log)) * cubes,
                    "{spacing:?} {all} {cubes}"
                );
                assert!(all < 5_000.0 * cut, "{spacing:?} {all} {cut}");
            }
        }
    }
}

#[test]
fn the_cost_of_thin_voxels_is_bounded() {
    for log in [0, 2, 4, 8, 12, 18] {
        let thin = 0.5f64.powi(log);
        let [all, cut] = work([9.0, 9.0, thin], 1e-3);
        assert!(all < 3_000.0 * cut, "{thin} {all} {cut}");
    }
}

/// A grid of N cubes per side about the origin, and one of boxes of as many cubes.
fn grids(h: f64, cubes: [usize; 3], offset: [f64; 3]) -> [VoxelGrid; 2] {
    let fine = VoxelGrid::centred([N; 3], [h; 3], offset).unwrap();
    let long = VoxelGrid::centred(cubes.map(|n| N / n), cubes.map(|n| n as f64 * h), offset);
    [fine, long.unwrap()]
}

/// Returns the long voxels beyond their tolerance, compared with the mean of their cubes at a tolerance that uses sections only; other tests compare
/// these with closed forms, chords and the volume.
fn missed(body: &Body, h: f64, cubes: &[[usize; 3]], offset: [f64; 3]) -> Vec<String> {
    let coverage =
        |grid: &VoxelGrid, tolerance: f64| body.voxelize::<f64>(grid, tolerance, &[1.0]).unwrap().0;
    let mut missed = Vec::new();
    let fine = coverage(&grids(h, [1; 3], offset)[0], 1e-7);
    for &cubes in cubes {
        let [_, grid] = grids(h, cubes, offset);
        let [nx, ny, _] = grid.shape();
        let mut exact = vec![0.0; grid.len()];
        for (k, share) in fine.iter().enumerate() {
            let [x, y, z] = [k % N, k / N % N, k / (N * N)];
            exact[(z / cubes[2] * ny + y / cubes[1]) * nx + x / cubes[0]] += share;
        }
        let each = cubes.iter().product::<usize>() as f64;
        for tolerance in [0.1, 0.05, 0.03, 0.02, 0.01, 3e-3, 1e-3] {
            let worst = (coverage(&grid, tolerance).iter().zip(&exact))
                .map(|(got, exact)| (got - exact / each).abs())
                .fold(0.0, f64::max);
            if worst > tolerance {
                missed.push(format!(
                    "{:.3} of {tolerance} by {cubes:?} of {h}",
                    worst / tolerance
                ));
            }
        }
    }
    missed
}

fn cubes() -> impl Strategy<Value = [usize; 3]> {
    prop::array::uniform3((0..=6u32).prop_map(|log| 1 << log))
}

/// Voxels that are larger than the heart by any factor contain it once, and the time does not grow with them.
#[test]
fn voxels_of_any_size_have_a_covered_fraction() {
    let body = heart(100);
    let volume = body.layers()[1].mass_properties().volume;
    for side in [20.0, 1e6, 1e15, 1e40, 1e100] {
        let grid = VoxelGrid::centred([2, 1, 1], [side, side, 50.0], [0.3, 0.2, 0.1]).unwrap();
        let tolerance = 1e-4;
        let mut fractions = vec![0.0f64; 2];
        voxelize_add(&body, &grid, 0..1, tolerance, &[1.0, 1.0], &mut fractions).unwrap();
        let off = fractions[0] + fractions[1] - volume / side / side / 50.0;
        // Two layers and two voxels, each within the tolerance.
        assert!(off.abs() <= 4e-4, "{side}: {fractions:?}");
    }
    assert!(VoxelGrid::centred([1; 3], [1e101; 3], [0.0; 3]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn voxels_of_any_shape_meet_the_tolerance((path, meridian) in meridian(), at in pose(), cubes in prop::collection::vec(cubes(), 4), log in -9.0..-3.6f64, pick in 0..100usize, azimuth in 0.0..7.0f64) {
        // Around a corner of the meridian: creases, where a surface differs most from a plane.
        let [x, r] = path[pick % path.len()];
        let corner = at.to_lab(&Point3::new(x, r * azimuth.cos(), r * azimuth.sin()));
        let body = Body::new(vec![meridian], at).unwrap();
        let missed = missed(&body, log.exp2(), &cubes, corner.coords.into());
        prop_assert!(missed.is_empty(), "{missed:?}");
    }
}

/// Of several segments on one line each is the nearest to a voxel at its end; the next segment is not.
#[test]
fn a_crease_behind_segments_on_one_line_meets_the_tolerance() {
    let path = [
        [0.338, 0.0],
        [0.401, 1.0],
        [0.464, 1.0],
        [0.527, 1.0],
        [0.59, 1.0],
        [1.0, 0.914],
    ];
    let body = Body::new(vec![Meridian::new(&path).unwrap()], Pose::identity()).unwrap();
    for h in [0.038, 0.0407, 0.043] {
        let found = missed(&body, h, &[[1; 3], [2, 1, 1]], [0.275, 0.0, 0.0]);
        assert!(found.is_empty(), "{found:?}");
    }
}
