//! Chords, measures and voxels against closed forms that share no code with the crate.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, Ray, Sampling, VoxelGrid};
use std::f64::consts::{FRAC_PI_4, PI};

fn solid(points: &[[f64; 2]]) -> Body {
    Body::new(vec![Meridian::new(points).unwrap()], Pose::identity()).unwrap()
}

/// Chord of a finite cylinder 0 <= x <= h, radius a: the overlap of two intervals.
fn cylinder_chord(o: Point3<f64>, d: Vector3<f64>, h: f64, a: f64) -> f64 {
    let (mut lo, mut hi) = (f64::NEG_INFINITY, f64::INFINITY);
    if d.x != 0.0 {
        let (t0, t1) = (-o.x / d.x, (h - o.x) / d.x);
        lo = t0.min(t1);
        hi = t0.max(t1);
    } else if o.x < 0.0 || o.x > h {
        return 0.0;
    }
    let s2 = d.y * d.y + d.z * d.z;
    let cross = o.y * d.z - o.z * d.y;
    if s2 > 0.0 {
        let disc = a * a * s2 - cross * cross;
        if disc <= 0.0 {
            return 0.0;
        }
        let mid = -(o.y * d.y + o.z * d.z) / s2;
        lo = lo.max(mid - disc.sqrt() / s2);
        hi = hi.min(mid + disc.sqrt() / s2);
    } else if o.y * o.y + o.z * o.z > a * a {
        return 0.0;
    }
    (hi - lo).max(0.0)
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    prop_oneof![
        4 => (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_filter_map("not zero", |(a, b, c)| {
            let v = Vector3::new(a, b, c);
            (v.norm() > 0.1).then(|| v.normalize())
        }),
        1 => Just(Vector3::x()),
        1 => Just(-Vector3::x()),
        1 => Just(Vector3::y()),
        1 => Just(Vector3::new(0.0, 0.6, -0.8)),
        1 => Just(Vector3::new(1e-17, 0.6, -0.8)),
        1 => Just(Vector3::new(1.0, 1e-17, 0.0)),
        1 => Just(Vector3::new(1.0, -1e-9, 1e-9)),
        1 => Just(Vector3::new(1e-9, -1.0, 0.0)),
    ]
}

proptest! {
    #[test]
    fn a_cylinder_in_many_segments_has_the_closed_form_chord(
        d in direction(), p in prop::array::uniform3(-1.2..1.2f64), n in 1usize..30, on_axis in 0..4,
    ) {
        let (h, a) = (2.0, 1.0);
        let points: Vec<_> = (0..=n).map(|k| [h * k as f64 / n as f64, a]).collect();
        let p = if on_axis == 0 { [p[0], 0.0, 0.0] } else { p };
        let o = Point3::new(1.0 + p[0], p[1], p[2]);
        let expected = cylinder_chord(o, d, h, a);
        let got = solid(&points).chord(0, &Ray::new(o, d).unwrap());
        // Grazing the curved side or the rim: the chord is the root of a difference, known to the root of the rounding.
        let tolerance = if expected > 1e-3 { 1e-12 } else { 1e-7 };
        prop_assert!((got - expected).abs() < tolerance, "{got} {expected} {o:?} {d:?}");
    }
}

#[test]
fn volume_is_the_integral_of_chords_and_of_coverage() {
    let pose = Pose::axis_along_z(5.625)
        .unwrap()
        .turned_x(FRAC_PI_4)
        .unwrap()
        .turned_y(FRAC_PI_4)
        .unwrap();
    // Cylinder and hemisphere as cylinder and cone: a polyline with closed-form volume.
    let body = |r: f64| Meridian::new(&[[0.0, r], [8.5, r], [8.5 + r, 0.0]]).unwrap();
    let both = Body::new(vec![body(1.75), body(2.75)], pose).unwrap();
    let volume = |r: f64| PI * r * r * (8.5 + r / 3.0);
    let expected = volume(2.75) - volume(1.75);
    assert!((both.region_measures(1).volume / expected - 1.0).abs() < 1e-14);

    let detector = ParallelDetector::new(256, 256, [0.0625; 2]).unwrap();
    let rays = detector.rays(0.3).unwrap();
    let (image, counters) = both.project::<f64>(&rays, &[0.0, 1.0]).unwrap();
    let sum = image.iter().sum::<f64>() * 0.0625 * 0.0625;
    // Midpoint rule on an integrand with square-root edges.
    assert!((sum / expected - 1.0).abs() < 1e-3, "{sum} {expected}");
    assert!(counters.skipped > 2 * counters.cast);

    let grid = VoxelGrid::cube(64, 0.25).unwrap();
    let (v, counters) = both
        .voxelize::<f64>(&grid, Sampling::Coverage { tolerance: 1e-3 }, &[0.0, 1.0])
        .unwrap();
    let sum = v.iter().sum::<f64>() * grid.voxel_volume();
    // Errors of single voxels differ in sign: the sum is better than each.
    assert!((sum / expected - 1.0).abs() < 1e-4, "{sum} {expected}");
    assert!(counters.cut < 30_000, "{counters:?}");
}

#[test]
fn the_study_pose_points_where_the_conventions_say() {
    let pose = Pose::axis_along_z(5.625)
        .unwrap()
        .turned_x(FRAC_PI_4)
        .unwrap()
        .turned_y(FRAC_PI_4)
        .unwrap();
    let expected = Vector3::new(0.5, -(0.5f64.sqrt()), 0.5);
    assert!((pose.axis() - expected).norm() < 1e-15);
    assert!(pose.to_lab(&Point3::new(5.625, 0.0, 0.0)).coords.norm() < 1e-14);
}

#[test]
fn a_hit_knows_its_point_and_normal() {
    let body = solid(&[[0.0, 1.0], [2.0, 1.0]]);
    let hit = body
        .first_hit(
            0,
            &Ray::new(Point3::new(1.0, -5.0, 0.0), Vector3::y()).unwrap(),
        )
        .unwrap();
    assert!((hit.t - 4.0).abs() < 1e-14);
    assert!((hit.normal + Vector3::y()).norm() < 1e-14);
    let spans = body.spans(
        0,
        &Ray::new(Point3::new(-3.0, 0.5, 0.0), Vector3::x()).unwrap(),
    );
    assert_eq!(spans.len(), 1);
    assert!((spans[0].enter - 3.0).abs() < 1e-14 && (spans[0].exit - 5.0).abs() < 1e-14);
}
