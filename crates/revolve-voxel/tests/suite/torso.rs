//! The scale of a torso that contains a body, against points and rays.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{Body, Meridian, OrganShape, Pose, Ray};
use std::f64::consts::TAU;

proptest! {
    #[test]
    fn the_scale_agrees_with_points_of_the_surface(
        meridian in prop::collection::vec((0.05..1.0, 0.0..3.0), 2..6),
        turns in prop::array::uniform2(-3.0..3.0),
        shift in prop::array::uniform3(-4.0..4.0),
        centre in prop::array::uniform2(-3.0..3.0),
        semi_axes in prop::array::uniform2(0.5..8.0),
    ) {
        let steps = meridian.iter().scan(0.0, |x, (dx, r)| {
            *x += dx;
            Some([*x, *r + 0.1])
        });
        let points: Vec<[f64; 2]> = steps.collect();
        let pose = Pose::axis_along_z(1.0).unwrap();
        let pose = pose.rotated_x(turns[0]).unwrap().rotated_y(turns[1]).unwrap();
        let pose = pose.shifted(Vector3::from(shift)).unwrap();
        let body = Body::new(vec![Meridian::new(&points).unwrap()], pose).unwrap();
        let torso = OrganShape::cylinder(centre, semi_axes).unwrap();
        let growth = torso.scale_to_contain(&body);

        const N: usize = 4000;
        let mut most = 0.0_f64;
        for [x, r] in &points {
            for k in 0..N {
                let (sin, cos) = (TAU * k as f64 / N as f64).sin_cos();
                let place = pose.to_lab(&Point3::new(*x, r * cos, r * sin));
                let share = [0, 1].map(|a| (place[a] - centre[a]) / semi_axes[a]);
                most = most.max(share[0].hypot(share[1]));
            }
        }
        // The distance of the farthest point is too small by at most the square of half the spacing.
        prop_assert!(growth >= most && growth < most * (1.0 + 1e-4 + 1e-5), "{growth} {most}");

        // Scaled by this factor, the torso contains every chord of the body.
        let grown = OrganShape::cylinder(centre, semi_axes.map(|a| a * growth)).unwrap();
        for k in 0..200 {
            let (sin, cos) = (0.1 + TAU * f64::from(k) / 37.0).sin_cos();
            let aside = f64::from(k % 13) - 6.0;
            let start = pose.to_lab(&Point3::new(0.3 * f64::from(k % 7), 0.0, 0.0));
            let start = start + 0.4 * aside * Vector3::new(cos, sin, 0.0);
            let ray = Ray::new(start, Vector3::new(-sin, cos, 0.0)).unwrap();
            let around = grown.span(&ray).map_or(0.0, |span| span.length());
            prop_assert!(body.chord(0, &ray).unwrap() <= around + 1e-9);
        }
    }
}
