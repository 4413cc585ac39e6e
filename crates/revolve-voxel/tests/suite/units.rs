//! Changes of units. Lengths times a power of two, or values times another one, change no digit of a result.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use revolve_voxel::{
    Assembly, BinValue, Body, Curve, DepthResponse, Meridian, Organs, ParallelDetector, Pose, Ray,
    Sector, Shell, Shown, View, VoxelGrid, WallTwist, nalgebra,
};
use std::sync::Arc;

/// The unit of the other results, and units by which lengths become smaller or larger.
const UNITS: [f64; 3] = [1.0, 1.0 / 128.0, 512.0];

/// An oblique pose.
fn placed(unit: f64, shift: [f64; 3]) -> Pose {
    let shift = Translation3::from(Vector3::from(shift) * unit);
    let turn = UnitQuaternion::from_euler_angles(0.5, -0.8, 1.1);
    Pose::new(Isometry3::from_parts(shift, turn)).unwrap()
}

/// A solid with cones, a step, a crease and an end disc.
fn solid(unit: f64) -> Meridian {
    let path = [
        [-1.0, 0.4],
        [-0.6, 1.1],
        [0.1, 1.3],
        [0.1, 0.9],
        [0.8, 0.7],
        [1.3, 0.0],
    ];
    Meridian::new(&path.map(|p| p.map(|v| v * unit))).unwrap()
}

#[test]
fn measures_and_chords_scale() {
    let of = |unit: f64| {
        let m = solid(unit).mass_properties();
        let body = Body::new(vec![solid(unit)], placed(unit, [0.1, 0.2, -0.1])).unwrap();
        let chords = (1..200).map(|k| {
            let at = [0.5, 0.3, 0.7].map(|rate| (f64::from(k) * rate).sin() * unit);
            let ray = Ray::new(Point3::from(at), Vector3::new(at[2], at[0], -at[1])).unwrap();
            body.chord(0, &ray).unwrap() / unit
        });
        let chords: Vec<f64> = chords.collect();
        let measures = [m.volume, m.first_moment, m.second_moment, m.polar_inertia];
        let powers = [3, 4, 5, 5].map(|power| unit.powi(power));
        let measures: [f64; 4] = std::array::from_fn(|k| measures[k] / powers[k]);
        (measures, m.surface / (unit * unit), chords)
    };
    let [one, others @ ..] = UNITS.map(of);
    for other in others {
        assert_eq!(other, one);
    }
}

/// Cubes, and boxes of several shapes that are divided into parts, at tolerances with different methods.
#[test]
fn covered_fractions_and_their_work_do_not_depend_on_the_unit() {
    for spacing in [[0.3; 3], [1.7; 3], [0.1, 0.1, 1.6], [2.0, 0.2, 0.7]] {
        for tolerance in [1.0, 0.3, 0.03, 1e-3, 1e-5] {
            let of = |unit: f64| {
                let body = Body::new(vec![solid(unit)], placed(unit, [0.1, 0.2, -0.1])).unwrap();
                let shape = spacing.map(|side: f64| (4.0 / side).ceil() as usize);
                let offset = [0.01, 0.02, 0.0].map(|v| v * unit);
                let spacing = spacing.map(|side| side * unit);
                let grid = VoxelGrid::centred(shape, spacing, offset).unwrap();
                body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap()
            };
            let [one, others @ ..] = UNITS.map(of);
            for other in others {
                assert!(other == one, "{spacing:?} {tolerance}");
            }
        }
    }
}

#[test]
fn voxels_of_a_twisted_sector_do_not_depend_on_the_unit() {
    let of = |unit: f64| {
        let line = |r: f64| [[0.0, r], [3.0, r]].map(|p| p.map(|v| v * unit));
        let curve = |r: f64| Curve::polyline(&[0.0, 1.0], &line(r)).unwrap();
        let shell = Arc::new(Shell::new(curve(1.0), curve(2.0), [0.0, 1.0]).unwrap());
        let twist = WallTwist::new(shell, |s| [0.7 * s, 0.4 * s]).unwrap();
        let ring = [[0.0, 1.0], [0.0, 2.0], [3.0, 2.0], [3.0, 1.0]];
        let ring = Meridian::ring(&ring.map(|p| p.map(|v| v * unit))).unwrap();
        let sector = Sector::new(ring, [0.4, 2.9], placed(unit, [0.0, 0.3, -1.0])).unwrap();
        let sector = sector.with_twist(Arc::new(twist));
        let grid = VoxelGrid::centred([9; 3], [0.55 * unit; 3], [0.0; 3]).unwrap();
        let mut voxels = vec![0.0f64; grid.len()];
        let counters = sector
            .voxelize_add(&grid, 0..9, 1e-2, 1.0, &mut voxels)
            .unwrap();
        (voxels, counters)
    };
    let [one, others @ ..] = UNITS.map(of);
    assert!(one.1.cut > 50, "{:?}", one.1);
    for other in others {
        assert!(other == one, "{:?} {:?}", other.1, one.1);
    }
}

/// The widths of the response are those of several bins, of less than one, and of a small part of one.
#[test]
fn images_and_their_work_do_not_depend_on_the_unit() {
    let widths = [1.1, 0.2, 0.03].map(|sigma| (sigma, BinValue::Average));
    for (sigma, value) in widths.into_iter().chain([(0.03, BinValue::Centre)]) {
        let of = |unit: f64| {
            let body = Body::new(vec![solid(unit)], placed(unit, [0.1, 0.2, -0.1])).unwrap();
            let organs = Organs::new(Vec::new()).unwrap();
            let detector = ParallelDetector::new(9, 8, [0.4 * unit, 0.5 * unit]).unwrap();
            let response = DepthResponse::constant(sigma * unit).unwrap();
            let lines = detector.rays(0.4).unwrap();
            let view = View::new(&lines, detector.pitch(), value, &response, 1.0).unwrap();
            let assembly = Assembly::new(&organs)
                .with_body(&body, &[1.0], Some(0.15 / unit))
                .unwrap();
            let image = view.image(&assembly, Shown::Change, 0..8).unwrap();
            let samples: Vec<f64> = image.samples.iter().map(|v| v / unit).collect();
            let bytes = View::bytes(&detector, value, &response, 1.0);
            (samples, image.rays, bytes)
        };
        let [one, others @ ..] = UNITS.map(of);
        for other in others {
            assert_eq!(other, one, "{sigma}");
        }
    }
}

/// A ramp from 6 to 2 between x = -2 and 2, above a background of 2.
#[test]
fn the_width_of_an_edge_does_not_depend_on_units() {
    let width = |unit: f64, value: f64| {
        let grid = VoxelGrid::cube(32, 0.5 * unit).unwrap();
        let ramp: Vec<f64> = (0..32768)
            .map(|k| ((2.0 - grid.centre(k % 32, 0, 0).x / unit) / 4.0).clamp(0.0, 1.0))
            .map(|v| value * (2.0 + 4.0 * v))
            .collect();
        let ends = [-6.0, 6.0].map(|x| Point3::new(x * unit, 0.0, 0.0));
        let line = grid.profile(&ramp, ends, 241).unwrap();
        line.above(2.0 * value).edge_width(0.9, 0.1).unwrap() / unit
    };
    for unit in UNITS {
        for value in [1.0, 0.25, 8.0] {
            // 0.8 of the ramp, interpolated linearly in a linear function.
            assert!((width(unit, value) - 3.2).abs() < 1e-9, "{unit} {value}");
        }
    }
}
