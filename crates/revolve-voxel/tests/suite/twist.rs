//! Sectors of a twisted tube, whose sides are helicoids.

use proptest::prelude::*;
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Curve, Meridian, Pose, Ray, Sector, Shell, VoxelGrid, WallTwist};
use std::f64::consts::TAU;
use std::sync::Arc;

const LENGTH: f64 = 3.0;

/// A tube of radii 1 and 2 along x from 0, rotated by angles from 0 at x = 0 to `turn` at its other end, on the inner and the outer surface.
fn tube(turn: [f64; 2], azimuths: [f64; 2], pose: Pose) -> Sector {
    let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [LENGTH, r]]).unwrap();
    let shell = Arc::new(Shell::new(line(1.0), line(2.0), [0.0, 1.0]).unwrap());
    let twist = WallTwist::new(shell, |s| turn.map(|turn| s * turn)).unwrap();
    let ring = [[0.0, 1.0], [0.0, 2.0], [LENGTH, 2.0], [LENGTH, 1.0]];
    let sector = Sector::new(Meridian::ring(&ring).unwrap(), azimuths, pose).unwrap();
    sector.with_twist(Arc::new(twist))
}

/// The size of the tube is its length: an angle of 0.05 within 1/256 of it is 12.8 over the whole.
#[test]
fn a_twist_is_steep_above_a_rate() {
    let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [LENGTH, r]]).unwrap();
    let shell = Arc::new(Shell::new(line(1.0), line(2.0), [0.0, 1.0]).unwrap());
    for (turn, is_steep) in [(1.0, false), (12.79, false), (12.81, true), (-30.0, true)] {
        let twist = WallTwist::new(shell.clone(), |s| [s * turn; 2]).unwrap();
        assert_eq!(twist.is_steep(), is_steep, "{turn}");
    }
}

proptest! {
    /// A line parallel to the axis crosses the sides at known x; in a plane perpendicular to the axis the sector is rotated.
    #[test]
    fn lines_along_and_across_the_axis_have_closed_forms(
        turn in -3.0f64..3.0, from in -4.0f64..4.0, open in 0.05f64..6.2, place in 0.0f64..TAU, r in 1.05f64..1.95, x in 0.1f64..2.9,
    ) {
        let sector = tube([turn; 2], [from, from + open], Pose::identity());
        let at = Point3::new(0.0, r * place.cos(), r * place.sin());
        let along = sector.chord(&Ray::new(at, Vector3::x()).unwrap());
        // Azimuth minus angle, relative to the first side, falls from `start` by `turn`.
        let start = place - from;
        let mut expected = 0.0;
        for k in -2..=2 {
            let ends = [0.0, open].map(|end| (start - end - TAU * f64::from(k)) / turn);
            let [low, high] = [ends[0].min(ends[1]).max(0.0), ends[0].max(ends[1]).min(1.0)];
            expected += LENGTH * (high - low).max(0.0);
        }
        // A slow twist makes the ends of the line sensitive to rounding.
        prop_assert!((along - expected).abs() < 1e-9 / turn.abs().min(1.0), "{along} {expected}");

        let turned = turn * x / LENGTH;
        let flat = tube([0.0; 2], [from + turned, from + turned + open], Pose::identity());
        let across = Ray::new(Point3::new(x, 0.3, 0.2), Vector3::new(0.0, place.cos(), place.sin())).unwrap();
        let [found, expected] = [&sector, &flat].map(|sector| sector.chord(&across));
        prop_assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    /// The first hit is on the surface, and its normal points out of the solid.
    #[test]
    fn the_normal_at_the_first_hit_points_outward(
        turn in prop::array::uniform2(-1.0f64..1.0), open in 0.1f64..6.0, p in prop::array::uniform3(-4.0f64..4.0), aim in prop::array::uniform3(-1.0f64..1.0),
    ) {
        let pose = Pose::axis_along_z(1.5).unwrap();
        let sector = tube(turn, [0.4, 0.4 + open], pose);
        let ray = Ray::new(Point3::from(p), Vector3::from(aim) - Vector3::from(p));
        prop_assume!(ray.is_ok());
        let ray = ray.unwrap();
        prop_assume!(!sector.contains(&ray.origin()));
        if let Some(hit) = sector.first_hit(&ray) {
            prop_assert!(hit.t >= 0.0 && (ray.at(hit.t) - hit.point).norm() < 1e-12);
            prop_assert!((hit.normal.norm() - 1.0).abs() < 1e-12);
            let inside = |way: f64| sector.contains(&(hit.point + way * hit.normal));
            prop_assert!(inside(-1e-5) && !inside(1e-5), "{hit:?}");
        } else {
            // No point of the ray is inside.
            prop_assert!((0..2000).all(|k| !sector.contains(&ray.at(0.006 * f64::from(k)))));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// Columns of voxels have the average chord, and all voxels the volume.
    #[test]
    fn voxels_add_up_to_chords_and_to_the_volume(
        turn in prop::array::uniform2(-1.0f64..1.0), from in -3.0f64..3.0, open in 0.1f64..6.0, way in prop::array::uniform3(-1.0f64..1.0),
    ) {
        let [x, y, z] = way.map(|angle| 3.0 * angle);
        let pose = Pose::axis_along_z(1.5).and_then(|pose| pose.rotated_x(x)?.rotated_y(y)?.rotated_z(z));
        let sector = tube(turn, [from, from + open], pose.unwrap());
        let (n, h, tolerance) = (12, 0.45, 1e-3);
        let grid = VoxelGrid::cube(n, h).unwrap();
        let mut voxels = vec![0.0f64; grid.len()];
        sector.voxelize_add(&grid, 0..n, tolerance, 1.0, &mut voxels).unwrap();
        prop_assert!(voxels.iter().all(|v| (0.0..=1.0 + 1e-12).contains(v)));
        let volume = voxels.iter().sum::<f64>() * h.powi(3);
        // Voxels that a surface cuts have the tolerance.
        let cut = voxels.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
        let most = tolerance * h.powi(3) * cut as f64;
        prop_assert!((volume - sector.volume()).abs() < most, "{volume}");
        let points = 60;
        for (x, y) in [(5, 5), (4, 7), (6, 3)] {
            let column: f64 = (0..n).map(|z| voxels[(z * n + y) * n + x] * h).sum();
            let mut mean = 0.0;
            for k in 0..points * points {
                let at = |k: usize| h * (((k % points) as f64 + 0.5) / points as f64 - 0.5);
                let start = grid.centre(x, y, 0) + Vector3::new(at(k), at(k / points), 0.0);
                mean += sector.chord(&Ray::new(start, Vector3::z()).unwrap());
            }
            mean /= (points * points) as f64;
            // The tolerance of twelve voxels, and the midpoint rule near edges, where chords jump: a fraction of a row of points.
            let most = 12.0 * tolerance * h + 2.0 * h / points as f64;
            prop_assert!((column - mean).abs() < most, "{column} {mean}");
        }
    }
}
