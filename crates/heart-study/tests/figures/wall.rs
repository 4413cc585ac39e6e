//! Rays to the wall of the heart.

use crate::figures::WallState;
use crate::figures::wall::{Part, Wall, upper_half};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
/// Half an ellipse from the base at x = 0 to the apex at x = a, of radius b at the base.
fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
    (0..=400)
        .map(|i| FRAC_PI_2 * (1.0 - f64::from(i) / 200.0))
        .map(|t| [a * t.cos(), b * t.sin()])
        .collect()
}

fn wall(azimuths: [f64; 2]) -> Wall {
    let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
    let state = WallState {
        title: "",
        inner: &inner,
        outer: &outer,
    };
    Wall::new(&state, Pose::identity(), azimuths).unwrap()
}

#[test]
fn an_apex_on_the_axis_to_rounding_is_one_node() {
    for apex in [1e-16, 0.0, -1e-16] {
        let full = [
            [0.0, 3.0],
            [6.0, 2.0],
            [10.0, apex],
            [6.0, -2.0],
            [0.0, -3.0],
        ];
        let (knots, nodes) = upper_half(&full);
        assert_eq!(nodes.len(), 3);
        assert!((nodes[2][0] - 10.0).abs() < 1e-12 && nodes[2][1] == 0.0);
        assert!((knots[1] - 0.5).abs() < 1e-12 && knots[2] == 1.0);
    }
}

#[test]
fn the_outer_surface_has_the_normal_of_the_ellipse() {
    let wall = wall([0.0, TAU]);
    for k in 1..20 {
        let x = 0.5 * f64::from(k);
        let met = wall.met(Point3::new(x, 0.0, 50.0), -Vector3::z()).unwrap();
        let z = 3.0 * (1.0 - x * x / 100.0f64).sqrt();
        // 400 chords of a half ellipse: sagitta h^2 / 8 times the curvature, below 2e-4.
        assert!((met.point - Point3::new(x, 0.0, z)).norm() < 2e-4);
        let normal = Vector3::new(x / 100.0, 0.0, z / 9.0).normalize();
        // Normals are interpolated between nodes 0.08 apart, accurate to second order.
        assert!(
            (met.normal - normal).norm() < 2e-3,
            "{} {normal}",
            met.normal
        );
        let Part::Outer { material, .. } = met.part else {
            panic!("{:?}", met.part)
        };
        let angle = (x / 10.0).asin();
        assert!((material - angle / FRAC_PI_2).abs() < 1e-4);
    }
}

#[test]
fn the_cavity_is_open_at_the_base_and_the_ring_is_not() {
    let wall = wall([0.0, TAU]);
    let met = wall
        .met(Point3::new(-50.0, 0.0, 0.01), Vector3::x())
        .unwrap();
    assert!(matches!(met.part, Part::Inner));
    assert!((met.point.x - 8.0).abs() < 1e-3 && (met.normal + Vector3::x()).norm() < 0.1);
    let met = wall
        .met(Point3::new(-50.0, 2.5, 0.0), Vector3::x())
        .unwrap();
    assert!(matches!(met.part, Part::Flat(0)) && met.point.x.abs() < 1e-12);
    assert!((met.normal + Vector3::x()).norm() < 1e-12);
}

#[test]
fn a_wedge_opens_the_wall() {
    // All but the quarter of negative y and positive z.
    let wall = wall([PI, 2.5 * PI]);
    // Down through the quarter cut away, into the wall's face at z = 0.
    let met = wall
        .met(Point3::new(1.0, -2.5, 50.0), -Vector3::z())
        .unwrap();
    assert!(matches!(met.part, Part::Flat(2)) && met.point.z.abs() < 1e-12);
    assert!((met.normal - Vector3::z()).norm() < 1e-12);
    // From the front, into the wall's face at y = 0.
    let met = wall
        .met(Point3::new(1.0, -50.0, 2.5), Vector3::y())
        .unwrap();
    assert!(matches!(met.part, Part::Flat(1)) && met.point.y.abs() < 1e-12);
    assert!((met.normal + Vector3::y()).norm() < 1e-12);
    // Nearer the axis it falls through the cavity to the far side of the inner membrane.
    let met = wall
        .met(Point3::new(1.0, -0.5, 50.0), -Vector3::z())
        .unwrap();
    assert!(matches!(met.part, Part::Inner) && met.point.z < -1.8 && met.normal.z > 0.9);
    // The other quarters stay.
    let met = wall
        .met(Point3::new(1.0, 0.5, 50.0), -Vector3::z())
        .unwrap();
    assert!(matches!(met.part, Part::Outer { .. }));
}

#[test]
fn the_pose_transforms_points_and_normals() {
    let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
    let state = WallState {
        title: "",
        inner: &inner,
        outer: &outer,
    };
    let pose = Pose::axis_along_z(5.0).unwrap();
    let wall = Wall::new(&state, pose, [0.0, TAU]).unwrap();
    let met = wall
        .met(Point3::new(0.0, 0.0, 50.0), -Vector3::z())
        .unwrap();
    assert!((met.point - Point3::new(0.0, 0.0, 5.0)).norm() < 1e-9);
    assert!((met.normal - Vector3::z()).norm() < 1e-2);
    assert!((wall.centre - Point3::origin()).norm() < 1e-9);
}
