//! Work is proportional to the surface, not to the volume.

use crate::support;

use revolve_voxel::{ParallelDetector, VoxelCounters, VoxelGrid};
use support::*;

#[test]
fn the_number_of_evaluated_voxels_scales_with_the_surface() {
    let body = heart(200);
    let count = |n: usize| {
        // A grid without a mirror plane, so that every voxel is evaluated.
        let grid = VoxelGrid::centred([n; 3], [16.0 / n as f64; 3], [0.01, 0.02, 0.0]).unwrap();
        let tolerance = 1e-2;
        let mut slab = vec![0.0f32; grid.slice_len() * n];
        voxelize_add(&body, &grid, 0..n, tolerance, &[0.0, 1.0], &mut slab).unwrap()
    };
    let (a, b) = (count(64), count(128));
    // Twice the resolution: four times the surface, eight times the volume.
    let ratio = |x: u64, y: u64| y as f64 / x as f64;
    assert!((3.5..4.5).contains(&ratio(a.cut, b.cut)), "{a:?} {b:?}");
    assert!(ratio(a.evaluations, b.evaluations) < 4.5, "{a:?} {b:?}");
    // The part of the two solids that is not filled in blocks is a layer of this many voxels, which grows with the surface, too.
    let volume: f64 = body
        .layers()
        .iter()
        .map(|m| m.mass_properties().volume)
        .sum();
    let rest = |c: VoxelCounters, n: f64| volume / (16.0f64 / n).powi(3) - c.filled as f64;
    let growth = rest(b, 128.0) / rest(a, 64.0);
    assert!((3.0..4.5).contains(&growth), "{growth} {a:?} {b:?}");
    // A plane cuts about 3/2 voxels for each voxel face of its area; a voxel counts as cut if its circumscribed ball is:
    // at most sqrt(3).
    let area: f64 = body
        .layers()
        .iter()
        .map(|m| m.mass_properties().surface)
        .sum();
    assert!((b.cut as f64) < 1.9 * area / (16.0f64 / 128.0).powi(2));
}

#[test]
fn one_of_two_mirror_images_is_evaluated() {
    let body = heart(200);
    let count = |offset: f64| {
        let grid = VoxelGrid::centred([96; 3], [0.16; 3], [offset, 0.0, 0.0]).unwrap();
        let tolerance = 1e-2;
        let (_, counters) = body.voxelize::<f32>(&grid, tolerance, &[0.0, 1.0]).unwrap();
        counters
    };
    let (half, all) = (count(0.0), count(1e-9));
    assert_eq!(all.mirrored, 0);
    // Blocks on the plane, one in twelve of those through the axis, are evaluated completely.
    for (some, whole) in [
        (half.cut, all.cut),
        (half.filled, all.filled),
        (half.evaluations, all.evaluations),
    ] {
        let share = some as f64 / whole as f64;
        assert!((0.5..0.63).contains(&share), "{share} {half:?} {all:?}");
    }
    // Each cut voxel that is not evaluated has the value of its mirror image.
    assert!(half.cut + half.mirrored > all.cut);
}

#[test]
fn rays_outside_the_silhouette_are_skipped() {
    let body = heart(200);
    let rays = ParallelDetector::new(256, 256, [0.0625; 2])
        .unwrap()
        .rays(0.7)
        .unwrap();
    let (_, c) = body.project::<f32>(&rays, &[1.0, 1.0]).unwrap();
    let (_, outer) = body.project::<f32>(&rays, &[0.5, 0.5]).unwrap();
    assert_eq!(c.cast + c.skipped, 256 * 256);
    assert!(outer.cast as f64 <= 1.1 * outer.hit as f64, "{outer:?}");
    assert!(outer.skipped > 3 * outer.cast);
}

#[test]
fn a_smaller_tolerance_of_coverage_costs_little() {
    let body = heart(200);
    let grid = VoxelGrid::cube(64, 0.25).unwrap();
    let work = |tolerance| {
        let (_, counters) = body.voxelize::<f32>(&grid, tolerance, &[0.0, 1.0]).unwrap();
        counters.evaluations as f64
    };
    // Supersampling needs a thousand times the points for a tenth of the error. A quadratic instead of the sections' areas, or a missing break, would
    // increase the work.
    for log in 3..8 {
        let growth = work(10f64.powi(-log - 1)) / work(10f64.powi(-log));
        // At 1e-3 a local approximation is sufficient for most of these voxels, at 1e-4 for none.
        let most = if log == 3 { 3.0 } else { 2.0 };
        assert!(growth < most, "{log} {growth}");
    }
}

/// A tolerance needs the singular points of the surface to its own scale only: several segments of a fine meridian are processed together.
#[test]
fn the_work_for_large_voxels_does_not_grow_with_the_segments() {
    let grid = VoxelGrid::centred([16; 3], [1.0; 3], [0.01, 0.02, 0.0]).unwrap();
    let work = |nodes: usize| {
        let (_, counters) = (heart(nodes).voxelize::<f32>(&grid, 1e-3, &[0.0, 1.0])).unwrap();
        counters.evaluations as f64
    };
    let growth = work(800) / work(100);
    assert!(growth < 1.3, "{growth}");
}

/// Long voxels are divided into parts, so that those beside the surface are not counted as cut.
#[test]
fn long_voxels_are_cut_where_the_surface_is() {
    let body = heart(200);
    let sides: [[f64; 3]; 3] = [[16.0, 0.2, 0.2], [4.8, 0.3, 0.3], [0.2, 16.0, 0.2]];
    for spacing in sides {
        let shape = spacing.map(|side| (16.0 / side).ceil() as usize);
        let grid = VoxelGrid::centred(shape, spacing, [0.01, 0.02, 0.0]).unwrap();
        let (voxels, counters) = body.voxelize::<f64>(&grid, 1e-3, &[1.0, 1.0]).unwrap();
        let partial = voxels.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
        // The circumscribed ball of a part reaches beyond it by less than a side.
        let share = counters.cut as f64 / partial as f64;
        assert!((1.0..1.5).contains(&share), "{spacing:?} {share}");
    }
}
