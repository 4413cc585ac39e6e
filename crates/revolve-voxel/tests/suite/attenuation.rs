//! Attenuated line integrals against closed forms and quadrature; the torso's voxels against its area.

use crate::support;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Assembly, Body, Lines, Meridian, Organ, OrganShape, Organs, ParallelDetector, Pose, Ray,
    RevolveError, Shown, VoxelGrid,
};
use std::f64::consts::PI;

fn torso() -> OrganShape {
    OrganShape::cylinder([1.0, -0.5], [7.0, 5.0]).unwrap()
}

/// A blunt cone within a larger one, off the axis and tilted.
fn body() -> Body {
    let layer = |scale: f64| {
        let points = [[0.0, 1.5], [3.0, 1.2], [4.0, 0.0]].map(|p| p.map(|v| v * scale));
        Meridian::new(&points).unwrap()
    };
    let pose = Pose::axis_along_z(2.0)
        .unwrap()
        .rotated_x(0.8)
        .unwrap()
        .rotated_z(0.3)
        .unwrap();
    let pose = pose.shifted(Vector3::new(1.5, -1.0, 0.4)).unwrap();
    Body::new(vec![layer(0.6), layer(1.0)], pose).unwrap()
}

fn rays(theta: f64) -> Lines {
    ParallelDetector::new(24, 20, [0.4, 0.4])
        .unwrap()
        .rays(theta)
        .unwrap()
}

/// A torso that attenuates, or none.
fn media(mu: f64, torso: Option<OrganShape>) -> Result<Organs, RevolveError> {
    let organ = |cylinder| Organ {
        shape: cylinder,
        activity: 0.0,
        attenuation: mu,
    };
    Organs::new(torso.map(organ).into_iter().collect())
}

/// The image of a body attenuated by a torso, or else by itself.
fn attenuated(
    body: &Body,
    rays: &Lines,
    activity: &[f64],
    mu: f64,
    torso: Option<OrganShape>,
) -> Vec<f64> {
    let (media, own) = (media(mu, torso).unwrap(), torso.is_none().then_some(mu));
    let assembly = Assembly::new(&media)
        .with_body(body, activity, own)
        .unwrap();
    let mut out = vec![0.0; rays.size().iter().product()];
    assembly
        .project_add(rays, Shown::Change, 1.0, &mut out)
        .unwrap();
    out
}

#[test]
fn zero_attenuation_equals_none() {
    let (body, rays) = (body(), rays(0.7));
    let (plain, _) = body.project::<f64>(&rays, &[0.3, 1.0]).unwrap();
    for medium in [Some(torso()), None] {
        let zero = attenuated(&body, &rays, &[0.3, 1.0], 0.0, medium);
        let tiny = attenuated(&body, &rays, &[0.3, 1.0], 1e-9, medium);
        for ((a, b), c) in plain.iter().zip(&zero).zip(&tiny) {
            // Rounding: the ends are those of the ray, not of the body.
            assert!((a - b).abs() < 1e-13);
            // At most 12 cm of medium.
            assert!((a - c).abs() <= 1.3e-8 * a + 1e-13, "{a} {c}");
        }
    }
}

#[test]
fn a_ball_in_the_middle_of_a_round_torso_has_the_closed_form() {
    let (radius, around, mu) = (1.5, 6.0, 0.17);
    // A half-circle as a polyline of many points.
    let n = 2000;
    let angle = |k: usize| PI * k as f64 / n as f64;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| {
            [
                -radius * angle(k).cos(),
                if k % n == 0 {
                    0.0
                } else {
                    radius * angle(k).sin()
                },
            ]
        })
        .collect();
    let pose = Pose::axis_along_z(0.0).unwrap().rotated_x(1.1).unwrap();
    let ball = Body::new(vec![Meridian::new(&points).unwrap()], pose).unwrap();
    let cylinder = OrganShape::cylinder([0.0; 2], [around; 2]).unwrap();
    for theta in [0.0, 1.0, 4.0] {
        let rays = rays(theta);
        let seen = attenuated(&ball, &rays, &[2.0], mu, Some(cylinder));
        for (k, value) in seen.iter().enumerate() {
            let (bin, row) = (k % 24, k / 24);
            let (s, z) = ((bin as f64 - 11.5) * 0.4, (row as f64 - 9.5) * 0.4);
            let half = (radius * radius - s * s - z * z).max(0.0).sqrt();
            let out = (around * around - s * s).sqrt();
            // From -half to half; the detector is beyond `out`.
            let exact = 2.0 * (-mu * (out - half)).exp() * (1.0 - (-2.0 * mu * half).exp()) / mu;
            // The polyline's depth, 2e-6, and its root at grazing rays.
            assert!((value - exact).abs() < 2e-5, "{s} {z}: {value} {exact}");
        }
    }
}

#[test]
fn the_detector_is_in_the_direction_of_the_rays() {
    // A rod near the torso's edge at +y: little attenuation at theta = 0 (rays run to +y), strong attenuation from the opposite side.
    let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]]).unwrap();
    let pose = Pose::axis_along_z(0.0)
        .unwrap()
        .shifted(Vector3::new(0.0, 4.0, 0.0))
        .unwrap();
    let rod = Body::new(vec![rod], pose).unwrap();
    let torso = OrganShape::cylinder([0.0; 2], [6.0, 5.0]).unwrap();
    let one = ParallelDetector::new(1, 1, [1.0; 2]).unwrap();
    let [front, back] = [0.0, PI]
        .map(|theta| attenuated(&rod, &one.rays(theta).unwrap(), &[1.0], 0.2, Some(torso))[0]);
    let own = (1.0 - (-0.2_f64).exp()) / 0.2;
    assert!((front - (-0.2_f64 * 0.5).exp() * own).abs() < 1e-13);
    assert!((back - (-0.2_f64 * 8.5).exp() * own).abs() < 1e-13);
}

/// Midpoint rule along a ray, by point tests only.
fn quadrature(
    body: &Body,
    ray: &Ray,
    activity: &[f64],
    mu: f64,
    medium: Option<OrganShape>,
) -> f64 {
    let (n, from, to) = (40_000, -15.0, 15.0);
    let h = (to - from) / n as f64;
    let (mut sum, mut path) = (0.0, 0.0);
    for k in (0..n).rev() {
        let p = ray.at(from + (k as f64 + 0.5) * h);
        let weakens = match medium {
            None => body.signed_distance(1, &p).unwrap() < 0.0,
            Some(torso) => {
                let ([x, y, _], [a, b, _]) = torso.bounds();
                ((p.x - x) / a).hypot((p.y - y) / b) < 1.0
            }
        };
        let step = if weakens { mu * h } else { 0.0 };
        let inside = (0..2).find(|&layer| body.signed_distance(layer, &p).unwrap() < 0.0);
        if let Some(region) = inside {
            sum += activity[region] * (-(path + 0.5 * step)).exp() * h;
        }
        path += step;
    }
    sum
}

#[test]
fn quadrature_by_point_tests_agrees() {
    let body = body();
    // The second torso cuts through the body: it is partly outside.
    let small = OrganShape::cylinder([1.5, -2.0], [2.0, 1.2]).unwrap();
    for medium in [Some(torso()), Some(small), None] {
        for theta in [0.2, 2.9] {
            let rays = rays(theta);
            let seen = attenuated(&body, &rays, &[0.4, 1.0], 0.35, medium);
            for (bin, row) in [(15, 10), (13, 11), (16, 8), (12, 13), (17, 10)] {
                let other = quadrature(
                    &body,
                    &rays.ray(bin, row).unwrap(),
                    &[0.4, 1.0],
                    0.35,
                    medium,
                );
                // Four ends of stretches, each with an error of half a step of 7.5e-4 of either sign.
                assert!((seen[row * 24 + bin] - other).abs() < 2e-3, "{medium:?}");
            }
        }
    }
}

#[test]
fn a_bent_body_attenuates_piece_by_piece() {
    // A ring crossed transversely: two intervals with a gap.
    let ring = Meridian::ring(&[[-0.5, 2.0], [-0.5, 3.0], [0.5, 3.0], [0.5, 2.0]]).unwrap();
    let body = Body::new(vec![ring], Pose::axis_along_z(0.0).unwrap()).unwrap();
    let one = ParallelDetector::new(1, 1, [1.0; 2])
        .unwrap()
        .rays(0.3)
        .unwrap();
    let mu: f64 = 0.4;
    let seen = attenuated(&body, &one, &[1.0], mu, None)[0];
    let single = (1.0 - (-mu).exp()) / mu;
    assert!((seen - single * (1.0 + (-mu).exp())).abs() < 1e-13);
}

#[test]
fn the_voxels_of_a_torso_have_its_area() {
    let grid = VoxelGrid::new([40, 31, 3], [0.4, 0.43, 1.0], [-7.1, -6.7, 0.0]).unwrap();
    let torso = Organs::new(vec![Organ {
        shape: torso(),
        activity: 1.0,
        attenuation: 0.15,
    }])
    .unwrap();
    let map = torso.voxelize(&grid, 0..3, |organ| organ.attenuation);
    let map: Vec<f64> = map.unwrap();
    let total: f64 = map.iter().sum::<f64>() * grid.voxel_volume();
    assert!((total / (0.15 * 3.0 * PI * 35.0) - 1.0).abs() < 1e-13);
    assert!(map.iter().all(|v| (0.0..=0.15).contains(v)));
    let one: Vec<f64> = torso.voxelize(&grid, 1..2, |o| o.attenuation).unwrap();
    assert_eq!(one[..], map[..grid.slice_len()]);
    // One voxel that contains the whole torso, and one inside it.
    for (h, share) in [(20.0, PI * 35.0 / 400.0), (1.0, 1.0)] {
        let grid = VoxelGrid::centred([1; 3], [h; 3], [1.0, -0.5, 0.0]).unwrap();
        let map: Vec<f64> = torso.voxelize(&grid, 0..1, |o| o.activity).unwrap();
        assert!((map[0] - share).abs() < 1e-14);
    }
}

#[test]
fn invalid_input_is_rejected() {
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        for semi_axes in [[bad, 1.0], [1.0, bad]] {
            let refused = OrganShape::cylinder([0.0; 2], semi_axes);
            assert!(
                matches!(
                    refused,
                    Err(RevolveError::NotPositive { .. } | RevolveError::NotFinite { .. })
                ),
                "{bad}: {refused:?}"
            );
        }
    }
    assert!(matches!(
        OrganShape::cylinder([f64::NAN, 0.0], [1.0; 2]),
        Err(RevolveError::NotFinite { .. })
    ));
    let (body, none) = (body(), Organs::default());
    for bad in [f64::NAN, f64::INFINITY, -0.1] {
        let own = Assembly::new(&none).with_body(&body, &[0.0, 1.0], Some(bad));
        for refused in [media(bad, Some(torso())).err(), own.err()] {
            assert!(
                matches!(
                    refused,
                    Some(RevolveError::NotFinite { .. } | RevolveError::Negative { .. })
                ),
                "{bad}: {refused:?}"
            );
        }
    }
    let along = Lines::parallel(
        [2, 2],
        Point3::origin(),
        Vector3::x(),
        Vector3::y(),
        Vector3::z(),
    )
    .unwrap();
    let media = media(0.1, Some(torso())).unwrap();
    let assembly = |activity: &[f64]| Assembly::new(&media).with_body(&body, activity, None);
    let one = assembly(&[0.0, 1.0]).unwrap();
    let mut out = [0.0_f32; 4];
    let across = rays(0.0);
    let mut add = |rays, weight| one.project_add(rays, Shown::Change, weight, &mut out);
    assert!(matches!(
        add(&along, 1.0),
        Err(RevolveError::NotPositive { .. })
    ));
    // an image of a wrong length, a wrong number of activities, an invalid activity
    assert!(matches!(
        add(&across, 1.0),
        Err(RevolveError::WrongLength { .. })
    ));
    assert!(matches!(
        add(&along, f64::NAN),
        Err(RevolveError::NotFinite { .. })
    ));
    assert!(matches!(
        assembly(&[1.0]),
        Err(RevolveError::WrongLength { .. })
    ));
    assert!(matches!(
        assembly(&[1.0, f64::NAN]),
        Err(RevolveError::NotFinite { .. })
    ));
    let organs = Organs::new(vec![Organ {
        shape: torso(),
        activity: 1.0,
        attenuation: 0.0,
    }])
    .unwrap();
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    assert!(matches!(
        organs.voxelize::<f64>(&grid, 0..3, |organ| organ.activity),
        Err(RevolveError::BadRange { .. })
    ));
    assert!(matches!(
        organs.voxelize::<f64>(&grid, 0..2, |_| f64::NAN),
        Err(RevolveError::NotFinite { .. })
    ));
}

proptest! {
    #[test]
    fn attenuation_increases_with_mu(theta in -7.0..7.0f64, mu in 0.0..30.0f64, more in 0.0..5.0f64) {
        let (body, rays) = (body(), rays(theta));
        let seen = |mu| attenuated(&body, &rays, &[0.4, 1.0], mu, Some(torso()));
        let (plain, some, stronger) = (seen(0.0), seen(mu), seen(mu + more));
        for k in 0..plain.len() {
            prop_assert!(stronger[k] >= 0.0 && stronger[k] <= some[k] + 1e-13 && some[k] <= plain[k] + 1e-13);
        }
    }

    #[test]
    fn a_span_ends_on_the_ellipse(x in -9.0..9.0f64, y in -9.0..9.0f64, d in support::direction()) {
        let ray = Ray::new(Point3::new(x, y, 0.3), d).unwrap();
        let across = ray.direction().x.hypot(ray.direction().y);
        if let Some(span) = torso().span(&ray) {
            for t in [span.enter, span.exit] {
                let p = ray.at(t);
                let off = ((p.x - 1.0) / 7.0).hypot((p.y + 0.5) / 5.0) - 1.0;
                // Rounding of a parameter that grows as the ray approaches the direction of the axis.
                prop_assert!(off.abs() < 1e-13 / across, "{off}");
            }
        } else {
            let inside = ((x - 1.0) / 7.0).hypot((y + 0.5) / 5.0) < 1.0;
            prop_assert!(!inside || across < 1e-15);
        }
    }
}
