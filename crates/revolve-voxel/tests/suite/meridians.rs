//! Meridians of many points, and of functions with straight parts.

use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Meridian, Pose, Ray};

/// Faces perpendicular to the axis, cylinders and a cone, as a function that passes each at an even rate: one segment each.
#[test]
fn straight_parts_of_a_function_are_single_segments() {
    let path = [
        [0.0, 0.0],
        [0.0, 1.5],
        [1.0, 1.5],
        [1.0, 0.75],
        [3.0, 0.75],
        [4.0, 0.0],
    ];
    let curve = |s: f64| {
        let at = (5.0 * s).clamp(0.0, 5.0);
        let k = (at as usize).min(4);
        [0, 1].map(|a| path[k][a] + (at - k as f64) * (path[k + 1][a] - path[k][a]))
    };
    let made = Meridian::from_function(curve, &[0.2, 0.4, 0.6, 0.8], 1e-6).unwrap();
    let exact = Meridian::new(&path).unwrap();
    assert_eq!(made.n_segments(), exact.n_segments());
    assert!((made.mass_properties().volume - exact.mass_properties().volume).abs() < 1e-13);
}

/// Lines along the axis of a solid with many teeth have half of its length at half of their height.
#[test]
fn a_meridian_of_many_teeth_has_their_chords() {
    let n = 20_000;
    let teeth = (0..=2 * n).map(|k| [f64::from(k) / f64::from(n), 1.0 + f64::from(k % 2)]);
    let meridian = Meridian::new(&teeth.collect::<Vec<_>>()).unwrap();
    let body = Body::new(vec![meridian], Pose::identity()).unwrap();
    for (r, exact) in [(1.5, 1.0), (1.75, 0.5), (0.5, 2.0), (2.5, 0.0)] {
        let ray = Ray::new(Point3::new(0.3, 0.0, r), Vector3::x()).unwrap();
        // Rounding of 40 000 ends.
        assert!((body.chord(0, &ray).unwrap() - exact).abs() < 1e-9, "{r}");
    }
}

/// A disc that is thinner than the rounding of distances from a far origin.
#[test]
fn intervals_of_lines_have_a_length() {
    for thin in [20, 26, 30, 34] {
        let thickness = 0.5f64.powi(thin);
        let disc = Meridian::new(&[[0.0, 1.0], [thickness, 1.0]]).unwrap();
        let body = Body::new(vec![disc], Pose::identity()).unwrap();
        for far in 0..40 {
            let from = Point3::new(-2.0f64.powi(far), 0.25, 0.5);
            let spans = body
                .spans(0, &Ray::new(from, Vector3::x()).unwrap())
                .unwrap();
            assert!(
                spans.iter().all(|span| span.exit > span.enter),
                "{thin} {far}"
            );
        }
    }
}
