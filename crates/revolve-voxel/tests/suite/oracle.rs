//! Chords, measures, distances and hits against independent closed forms.

use crate::support;

use approx::assert_relative_eq;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Body, MassProperties, Meridian, Piece, Pose, Ray, RevolveError, Sector, VoxelGrid,
};
use std::f64::consts::{PI, TAU};
use support::*;

/// Overlap with a slab 0 <= x <= h.
fn slab(o: Point3<f64>, d: Vector3<f64>, h: f64) -> [f64; 2] {
    if d.x != 0.0 {
        let (t0, t1) = (-o.x / d.x, (h - o.x) / d.x);
        [t0.min(t1), t0.max(t1)]
    } else if (0.0..=h).contains(&o.x) {
        [f64::NEG_INFINITY, f64::INFINITY]
    } else {
        [0.0, 0.0]
    }
}

/// Chord of a finite cylinder 0 <= x <= h, radius a: the overlap of two intervals.
fn cylinder_chord(o: Point3<f64>, d: Vector3<f64>, h: f64, a: f64) -> f64 {
    let [mut lo, mut hi] = slab(o, d, h);
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

/// Chebyshev coefficients of a function on [-1, 1], by interpolation.
fn chebyshev(f: impl Fn(f64) -> f64) -> Vec<f64> {
    let n = 24;
    (0..n)
        .map(|k| {
            let scale = if k == 0 { 1.0 } else { 2.0 } / n as f64;
            (0..n)
                .map(|j| {
                    let a = PI * (j as f64 + 0.5) / n as f64;
                    scale * f(a.cos()) * (k as f64 * a).cos()
                })
                .sum()
        })
        .collect()
}

/// Half an ellipse, semi-axes a (along x) and 1.
fn ellipse(a: f64) -> Piece {
    Piece::Chebyshev {
        x: chebyshev(|u| a * (0.5 * PI * u).sin()),
        r: chebyshev(|u| (0.5 * PI * u).cos()),
    }
}

proptest! {
    #[test]
    fn a_cylinder_in_many_segments_has_the_closed_form_chord(
        d in direction(), p in prop::array::uniform3(-1.2..1.2f64), n in 1usize..30, place in 0..5,
    ) {
        let (h, a) = (2.0, 1.0);
        let points: Vec<_> = (0..=n).map(|k| [h * k as f64 / n as f64, a]).collect();
        let p = match place {
            0 => [p[0], 0.0, 0.0], // through the axis
            1 => [h * (n / 2) as f64 / n as f64 - 1.0, p[1], p[2]], // at a vertex's plane
            _ => p,
        };
        let o = Point3::new(1.0 + p[0], p[1], p[2]);
        let expected = cylinder_chord(o, d, h, a);
        let got = solid(&points).chord(0, &Ray::new(o, d).unwrap()).unwrap();
        let tolerance = chord_tolerance(&[[0.0, a], [h, a]], o, d);
        prop_assert!((got - expected).abs() < tolerance, "{got} {expected} {o:?} {d:?}");
    }

    #[test]
    fn a_square_ring_is_the_difference_of_cylinders(d in direction(), p in prop::array::uniform3(-1.2..1.2f64)) {
        let ring = Meridian::ring(&[[0.0, 0.5], [0.0, 1.0], [2.0, 1.0], [2.0, 0.5]]).unwrap();
        let body = Body::new(vec![ring], Pose::identity()).unwrap();
        let o = Point3::new(1.0 + p[0], p[1], p[2]);
        let expected = cylinder_chord(o, d, 2.0, 1.0) - cylinder_chord(o, d, 2.0, 0.5);
        let got = body.chord(0, &Ray::new(o, d).unwrap()).unwrap();
        let tolerance = chord_tolerance(&[[0.0, 1.0], [2.0, 1.0]], o, d) + chord_tolerance(&[[0.0, 0.5], [2.0, 0.5]], o, d);
        prop_assert!((got - expected).abs() < tolerance, "{got} {expected}");
    }

    #[test]
    fn chords_of_a_smooth_ellipsoid_meet_the_tolerance(
        d in direction(), p in prop::array::uniform3(-1.2..1.2f64), log in 3..10i32, a in 0.5..3.0f64,
    ) {
        let tolerance = 10f64.powi(-log);
        let body = Body::new(vec![Meridian::smooth(&[ellipse(a)], tolerance).unwrap()], Pose::identity()).unwrap();
        let o = Point3::new(a * p[0], p[1], p[2]);
        // In coordinates where the ellipsoid is a unit sphere.
        let (os, ds) = (Vector3::new(o.x / a, o.y, o.z), Vector3::new(d.x / a, d.y, d.z));
        let b = os.dot(&ds) / ds.norm_squared();
        let impact = (os - ds * b).norm();
        let half = |radius: f64| (radius * radius - impact * impact).max(0.0).sqrt() / ds.norm();
        // The polyline lies between two ellipsoids: the chord lies between theirs, for a grazing line too.
        // Displacement in the scaled coordinates: at most the tolerance divided by the shorter semi-axis.
        let off = tolerance / a.min(1.0) + 1e-13;
        let got = body.chord(0, &Ray::new(o, d).unwrap()).unwrap();
        prop_assert!(got <= 2.0 * half(1.0 + off) + 1e-12, "{got}");
        prop_assert!(got >= 2.0 * half(1.0 - off) - 1e-12, "{got} {}", 2.0 * half(1.0));
    }
}

#[test]
fn a_cone_has_the_closed_form_chords() {
    // Apex at the origin, opening towards +x to radius 1 at x = 1; open end closed by a disc.
    let cone = solid(&[[0.0, 0.0], [1.0, 1.0]]);
    let chord = |o: [f64; 3], d: [f64; 3]| {
        cone.chord(0, &Ray::new(Point3::from(o), Vector3::from(d)).unwrap())
            .unwrap()
    };
    // Across at height x, distance q from the axis: 2 sqrt(x^2 - q^2).
    assert!((chord([0.5, 0.0, 0.3], [0.0, 1.0, 0.0]) - 0.8).abs() < 1e-15);
    // Along the axis, parallel to it, along a generator inside by a shift.
    assert!((chord([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]) - 1.0).abs() < 1e-15);
    assert!((chord([0.0, 0.6, 0.0], [-2.0, 0.0, 0.0]) - 0.4).abs() < 1e-15);
    // Parallel to a generator, entering at (0.5, -0.5) in the plane z = 0 and leaving at the disc.
    let s = 0.5f64.sqrt();
    assert!((chord([0.5, -0.5, 0.0], [1.0, 1.0, 0.0]) - 0.5 / s).abs() < 1e-14);
    // Through the apex only, and beside it.
    assert_eq!(chord([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]), 0.0);
    assert_eq!(chord([-0.1, 0.0, 0.0], [0.0, 1.0, 0.0]), 0.0);
    // A frustum from radius 1 to 2, across half-way.
    let frustum = solid(&[[0.0, 1.0], [2.0, 2.0]]);
    let across = frustum
        .chord(
            0,
            &Ray::new(Point3::new(1.0, 0.0, 0.9), Vector3::y()).unwrap(),
        )
        .unwrap();
    assert!((across - 2.4).abs() < 1e-14);
}

#[test]
fn a_chord_along_the_axis_is_the_same_in_both_directions_where_the_profile_touches_the_axis() {
    // Two cones with a common apex at the middle and off it, and a cone that ends in the middle of the others.
    for tip in [0.5, 0.3] {
        let double = solid(&[[0.0, 1.0], [tip, 0.0], [1.0, 1.0]]);
        let single = solid(&[[0.0, 0.0], [tip, 0.0], [1.0, 1.0]]);
        for d in [Vector3::x(), -Vector3::x()] {
            for x in [-1.0, 0.0, tip, 0.7] {
                let ray = Ray::new(Point3::new(x, 0.0, 0.0), d).unwrap();
                assert!((double.chord(0, &ray).unwrap() - 1.0).abs() < 1e-15);
                assert!((single.chord(0, &ray).unwrap() - (1.0 - tip)).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn measures_of_textbook_solids() {
    let transverse_inertia = |m: &MassProperties| {
        0.5 * m.polar_inertia + m.second_moment - m.first_moment * m.first_moment / m.volume
    };
    let (a, h) = (1.3, 2.1);
    let m = Meridian::new(&[[0.0, a], [h, 0.0]])
        .unwrap()
        .mass_properties();
    let volume = PI * a * a * h / 3.0;
    let slant = (a * a + h * h).sqrt();
    assert!((m.volume / volume - 1.0).abs() < 1e-14);
    assert!((m.surface / (PI * a * (a + slant)) - 1.0).abs() < 1e-14);
    assert!((m.centroid() / (h / 4.0) - 1.0).abs() < 1e-14);
    assert!((m.polar_inertia / (0.3 * volume * a * a) - 1.0).abs() < 1e-14);
    // About the centroid, across the axis: 3/80 V (4 a^2 + h^2).
    let across = 3.0 / 80.0 * volume * (4.0 * a * a + h * h);
    assert!((transverse_inertia(&m) / across - 1.0).abs() < 1e-13);

    // A truncated cone: pi h / 10 times (a^5 - b^5) / (a - b).
    let b = 0.7;
    let m = Meridian::new(&[[-0.3, a], [h - 0.3, b]]).unwrap();
    let polar = PI * h / 10.0 * (a.powi(5) - b.powi(5)) / (a - b);
    assert!((m.mass_properties().polar_inertia / polar - 1.0).abs() < 1e-14);

    // Smooth: the prolate spheroid, errors of the order of the tolerance.
    let m = Meridian::smooth(&[ellipse(2.0)], 1e-8)
        .unwrap()
        .mass_properties();
    let volume = 8.0 * PI / 3.0;
    assert!((m.volume / volume - 1.0).abs() < 4e-8);
    assert!(m.centroid().abs() < 1e-12);
    let e = 0.75f64.sqrt();
    let surface = 2.0 * PI * (1.0 + 2.0 / e * e.asin());
    assert!((m.surface / surface - 1.0).abs() < 4e-8);
    assert!((transverse_inertia(&m) / (volume * 5.0 / 5.0) - 1.0).abs() < 1e-7);
}

#[test]
fn a_smooth_profile_meets_the_tolerance_with_few_segments() {
    for log in 2..9 {
        let tolerance = 10f64.powi(-log);
        let m = Meridian::smooth(&[ellipse(1.0)], tolerance).unwrap();
        // Distance of circle points from the polyline, by the signed distance.
        let worst = (1..2000)
            .map(|k| {
                let a = PI * k as f64 / 2000.0;
                m.signed_distance(&Point3::new(a.cos(), a.sin(), 0.0)).abs()
            })
            .fold(0.0, f64::max);
        assert!(worst <= tolerance, "{worst} {tolerance}");
        // A chord of sagitta e on the unit circle spans an angle sqrt(8 e); halving gives up to twice as many, and the first division has 24
        // stretches.
        let ideal = PI / (8.0 * tolerance).sqrt();
        assert!(
            (m.n_segments() as f64) < 4.0 * ideal.max(24.0),
            "{} {ideal}",
            m.n_segments()
        );
    }
}

#[test]
fn distances_agree_with_the_definition() {
    let body = heart(300);
    let m = &body.layers()[1];
    // The distance to the sampled surface is at least the exact distance and exceeds it by at most the sampling.
    let mut path = Vec::new();
    let n = 300;
    let point = |u: f64| {
        let k = ((u * n as f64) as usize).min(n - 1);
        let at = |k: usize| {
            let u = k as f64 / n as f64;
            [
                12.25 * (1.0 - (0.5 * PI * u).cos()) - 0.5 * (PI * u).sin(),
                2.75 * (0.5 * PI * u).cos() + 1.6 * (PI * u).sin(),
            ]
        };
        let f = u * n as f64 - k as f64;
        let (a, b) = (at(k), at(k + 1));
        [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])]
    };
    path.extend((0..=100_000).map(|k| point(f64::from(k) * 1e-5)));
    path.extend((0..=2000).map(|k| [0.0, 2.75 * f64::from(k) / 2000.0]));
    for (x, r) in [
        (3.0, 0.5),
        (-0.1, 2.8),
        (-0.1, 1.0),
        (6.0, 4.0),
        (13.0, 0.0),
        (11.0, 0.1),
        (-0.4, 3.2),
        (5.0, 2.8),
    ] {
        let sampled = path
            .iter()
            .map(|p| (p[0] - x).hypot(p[1] - r))
            .fold(f64::INFINITY, f64::min);
        let got = m.signed_distance(&Point3::new(x, 0.6 * r, -0.8 * r));
        assert!(
            (got.abs() - sampled).abs() < 1e-6,
            "{x} {r}: {got} {sampled}"
        );
    }
    for (x, r, inside) in [
        (3.0, 0.5, true),
        (-0.02, 3.0, true),
        (-0.1, 1.0, false),
        (6.0, 4.5, false),
        (12.2499, 0.0, true),
    ] {
        assert_eq!(m.contains(&Point3::new(x, 0.0, r)), inside, "{x} {r}");
    }
}

/// A solid without sides.
fn whole(meridian: Meridian, pose: Pose) -> Sector {
    Sector::new(meridian, [0.0, TAU], pose).unwrap()
}

#[test]
fn a_hit_contains_its_point_and_normal() {
    let rod = Meridian::new(&[[0.0, 1.0], [2.0, 1.0]]).unwrap();
    let body = whole(rod, Pose::identity());
    let ray = |o: [f64; 3], d: [f64; 3]| Ray::new(Point3::from(o), Vector3::from(d)).unwrap();
    let hit = body
        .first_hit(&ray([1.0, -5.0, 0.0], [0.0, 1.0, 0.0]))
        .unwrap();
    assert!((hit.t - 4.0).abs() < 1e-14);
    assert!((hit.normal + Vector3::y()).norm() < 1e-14);
    // The discs.
    let hit = body
        .first_hit(&ray([-3.0, 0.5, 0.0], [1.0, 0.0, 0.0]))
        .unwrap();
    assert!((hit.t - 3.0).abs() < 1e-14 && (hit.normal + Vector3::x()).norm() < 1e-14);
    let hit = body
        .first_hit(&ray([5.0, 0.5, 0.0], [-1.0, 0.0, 0.0]))
        .unwrap();
    assert!((hit.t - 3.0).abs() < 1e-14 && (hit.normal - Vector3::x()).norm() < 1e-14);
    // There is no hit behind the origin of the ray.
    let behind = ray([1.0, 5.0, 0.0], [0.0, 1.0, 0.0]);
    assert!(body.first_hit(&behind).is_none());
    // The normal of a sphere is radial, in any pose.
    let ball = Meridian::smooth(&[ellipse(1.0)], 1e-9).unwrap();
    let sphere = whole(ball, study_pose());
    let centre = study_pose().to_lab(&Point3::origin());
    let ray = Ray::new(centre + Vector3::new(0.3, -9.0, 0.2), Vector3::y()).unwrap();
    let hit = sphere.first_hit(&ray).unwrap();
    // A chord of sagitta e is turned from the arc by at most 2 sqrt(2 e).
    assert!((hit.normal - (hit.point - centre)).norm() < 1e-4);
}

#[test]
fn the_study_pose_follows_the_conventions() {
    let pose = study_pose();
    let expected = Vector3::new(0.5, -(0.5f64.sqrt()), 0.5);
    assert!((pose.axis() - expected).norm() < 1e-15);
    assert!(pose.to_lab(&Point3::new(5.625, 0.0, 0.0)).coords.norm() < 1e-14);
}

#[test]
fn bounding_box_of_a_tilted_cylinder() {
    let body = Body::new(
        vec![Meridian::new(&[[0.0, 1.0], [2.0, 1.0]]).unwrap()],
        Pose::identity().rotated_z(0.3).unwrap(),
    )
    .unwrap();
    let [low, high] = body.bounding_box(0).unwrap();
    let (sin, cos) = 0.3f64.sin_cos();
    let expected = [[-sin, -cos, -1.0], [2.0 * cos + sin, 2.0 * sin + cos, 1.0]];
    assert!((low - Point3::from(expected[0])).norm() < 1e-14);
    assert!((high - Point3::from(expected[1])).norm() < 1e-14);
}

#[test]
fn a_rotation_by_any_valid_angle_agrees_with_its_sine_and_cosine() {
    for angle in [0.3, -7.0, 12.5] {
        let (sin, cos) = f64::sin_cos(angle);
        let turned = Pose::axis_along_z(0.0).unwrap().rotated_x(angle).unwrap();
        let expected = Vector3::new(0.0, -sin, cos);
        // A quaternion stores half the angle, which is exact.
        assert!((turned.axis() - expected).norm() < 1e-15, "{angle:e}");
    }
}

#[test]
fn a_solid_far_from_the_origin_is_valid() {
    for x in [1e5, -1e8, 1e10] {
        let meridian = Meridian::new(&[[x, 1.0], [x + 3.0, 1.0]]).unwrap();
        assert_relative_eq!(
            meridian.mass_properties().volume,
            3.0 * PI,
            max_relative = 1e-14
        );
        let body = Body::new(vec![meridian], Pose::axis_along_z(x + 1.5).unwrap()).unwrap();
        let across = Ray::new(Point3::new(-5.0, 0.6, 0.3), Vector3::x()).unwrap();
        // Two sides of cos(asin(0.6)). The position has so many digits.
        assert!((body.chord(0, &across).unwrap() - 1.6).abs() < 1e-15 * x.abs());
        let grid = VoxelGrid::cube(8, 0.5).unwrap();
        let tolerance = 1e-6;
        let (voxels, _) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
        let volume = voxels.iter().sum::<f64>() * grid.voxel_volume();
        assert_relative_eq!(volume, 3.0 * PI, max_relative = 1e-5);
    }
    // A value due to rounding counts as zero.
    let thin = [[1e10, 1.0], [1e10 + 2e-6, 1.0]];
    assert!(matches!(
        Meridian::new(&thin),
        Err(RevolveError::NoVolume { .. })
    ));
}

#[test]
fn a_normal_near_the_axis_has_full_accuracy() {
    // A cone of 45 degrees, intersected so near the axis that squares of the distance vanish.
    let cone = Meridian::new(&[[0.0, 1.0], [1.0, 0.0]]).unwrap();
    let cone = whole(cone, Pose::identity());
    for aside in [1e-3, 1e-160, 1e-300] {
        let ray = Ray::new(Point3::new(2.0, 3.0 * aside, 4.0 * aside), -Vector3::x()).unwrap();
        let hit = cone.first_hit(&ray).unwrap();
        let expected = Vector3::new(1.0, 0.6, 0.8) * 0.5f64.sqrt();
        assert!((hit.normal - expected).norm() < 1e-12, "{aside:e} {hit:?}");
    }
}

#[test]
fn a_face_perpendicular_to_the_axis_up_to_rounding_is_perpendicular() {
    // Back to x = 0, inwards to a radius of 1.8 up to a denormal number, and out again.
    for x in [2.781342323134e-309, 1e-17] {
        let back = x * (1.0 - 4e-12);
        let points = [[-1.0, 3.0], [1.0, 4.0], [x, 2.5], [back, 1.8], [3.0, 2.5]];
        let body = solid(&points);
        for aside in [0.0, 0.5, 1.9] {
            let chord = |x: f64| {
                let ray = Ray::new(Point3::new(x, -9.0, aside), Vector3::y()).unwrap();
                let spans = body.spans(0, &ray).unwrap();
                let chord = body.chord(0, &ray).unwrap();
                let sum: f64 = spans.iter().map(|span| span.exit - span.enter).sum();
                assert_relative_eq!(sum, chord, max_relative = 1e-12);
                chord
            };
            let beside = [chord(-1e-9), chord(1e-9)];
            for at in [0.0, back, x] {
                let here = chord(at);
                assert!(
                    beside.iter().any(|beside| (beside - here).abs() < 1e-7),
                    "{x:e} {aside} {at:e}: {here}, beside it {beside:?}"
                );
            }
        }
    }
}

/// A funnel with a conical bore: two cones that end at one point of the axis, from the same side. Points on the axis beyond it are outside, in any
/// order of the cones; those before it are in the bore.
#[test]
fn the_axis_beyond_the_common_point_of_two_cones_is_outside() {
    let funnel = [[0.0, 0.0], [-0.75, 0.75], [-0.75, 1.0], [-0.25, 0.5]];
    for mirrored in [1.0, -1.0] {
        let points = funnel.map(|[x, r]| [mirrored * x, r]);
        for points in [
            [&points[..], &[[0.0, 0.0]]].concat(),
            [&[[0.0, 0.0]], &points[1..], &points[..1]].concat(),
        ] {
            let m = Meridian::new(&points).unwrap();
            for (x, r) in [
                (0.25, 0.0),
                (0.25, 1e-17),
                (1.0, 0.3),
                (0.1, 0.02),
                (1e-9, 0.0),
            ] {
                let p = Point3::new(mirrored * x, r, 0.0);
                assert_relative_eq!(m.signed_distance(&p), x.hypot(r), max_relative = 1e-14);
            }
            // In the bore, whose surface is at 45 degrees.
            let p = Point3::new(mirrored * -0.5, 0.0, 0.0);
            assert_relative_eq!(
                m.signed_distance(&p),
                0.5_f64.powf(1.5),
                max_relative = 1e-14
            );
            // In the wall.
            assert!(m.contains(&Point3::new(mirrored * -0.1, 0.15, 0.0)));
        }
    }
}

#[test]
fn a_function_with_a_corner_and_a_jump_has_the_volume_of_its_closed_form() {
    // A hemisphere of radius 1 on a cylinder of length 2 and radius 1, which jumps to the radius 1.5 at its middle.
    let curve = |s: f64| match s {
        ..0.25 => [4.0 * s, 1.5],
        ..0.5 => [4.0 * s, 1.0],
        _ => {
            let angle = PI * (s - 0.5);
            [2.0 + angle.sin(), angle.cos()]
        }
    };
    let volume = PI * (1.5 * 1.5 + 1.0 + 2.0 / 3.0);
    for breakpoints in [&[][..], &[0.25, 0.5], &[0.1, 0.3, 0.6]] {
        let tolerance = 1e-7;
        let m = Meridian::from_function(curve, breakpoints, tolerance).unwrap();
        // The polyline lies within the tolerance of the curve: the error is at most surface times tolerance.
        let error = m.mass_properties().volume - volume;
        assert!(
            error.abs() <= 30.0 * tolerance,
            "{breakpoints:?}: {error:e}"
        );
        assert_eq!(m.x_range()[0], 0.0);
    }
}
