//! The progress that operations report adds up to the whole.

use crate::support;

use revolve_voxel::{Curve, Pose, Shell, Sweep, VoxelGrid};
use simd_set::Watch;
use std::sync::Arc;
use support::*;

/// The progress of an operation that is the first quarter of a computation, relative to this quarter.
fn progress(work: impl Fn() + Sync) -> f64 {
    let watch = Arc::new(Watch::default());
    let own = watch.clone();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
    let pool = pool.start_handler(move |_| simd_set::watch_with(own.clone()));
    pool.build().unwrap().install(|| {
        watch.restart();
        let _quarter = simd_set::part(0..1, 4);
        work();
        4.0 * watch.fraction()
    })
}

#[test]
fn the_units_of_an_operation_are_its_whole() {
    let body = heart(60);
    // With a mirror plane and without.
    for offset in [0.0, 1e-9] {
        for n in [10, 33, 50] {
            let grid =
                VoxelGrid::centred([n; 3], [16.0 / n as f64; 3], [offset, 0.0, 0.0]).unwrap();
            let voxels = progress(|| drop(body.voxelize::<f32>(&grid, 0.1, &[0.0, 1.0]).unwrap()));
            let shapes = [body.layers()];
            let sweep = progress(|| drop(Sweep::of(&shapes, body.pose(), &grid).unwrap()));
            let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [3.0, r]]).unwrap();
            let wall = Shell::new(line(1.0), line(2.0), [0.0, 1.0]).unwrap();
            let map = progress(|| {
                let found = wall.map_voxels(&Pose::identity(), &grid, 1..n - 1, 0.0, |_, _, _| ());
                drop(found.unwrap());
            });
            for done in [voxels, sweep, map] {
                // Rounding down of the units, each to 2^-62.
                assert!(
                    (done - 1.0).abs() < 1e-9,
                    "{n} {offset}: {voxels} {sweep} {map}"
                );
            }
        }
    }
}
