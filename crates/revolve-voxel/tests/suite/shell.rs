//! The wall between two curves: its layers, its coordinates and their inverse, against closed forms and finite differences.

use proptest::prelude::*;
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{
    Body, Curve, Meridian, Piece, Pose, Ray, RevolveError, Sector, Shell, VoxelGrid,
};
use std::f64::consts::PI;

/// A cylinder closed by a half-ball, with the fraction of the length as parameter: polynomials of high degree for the cap.
fn balloon(length: f64, radius: f64, stretch: f64) -> Curve {
    let cap = 0.5 * PI * radius;
    let knee = length / (length + cap);
    Curve::new(vec![0.0, knee, 1.0], pieces(length, radius, stretch)).unwrap()
}

fn pieces(length: f64, radius: f64, stretch: f64) -> Vec<Piece> {
    // Chebyshev coefficients of the cap by interpolation at 24 points: accurate to rounding.
    let n = 24;
    let node = |j: usize| PI * (j as f64 + 0.5) / n as f64;
    let series = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..n)
            .map(|k| {
                let sum: f64 = (0..n)
                    .map(|j| f(node(j).cos()) * (k as f64 * node(j)).cos())
                    .sum();
                sum * if k == 0 { 1.0 } else { 2.0 } / n as f64
            })
            .collect()
    };
    let angle = |u: f64| 0.25 * PI * (1.0 + u);
    vec![
        Piece::Power {
            x: vec![0.0, length * stretch],
            r: vec![radius],
        },
        Piece::Chebyshev {
            x: series(&|u| length * stretch + radius * stretch * angle(u).sin()),
            r: series(&|u| radius * angle(u).cos()),
        },
    ]
}

fn study() -> Shell {
    Shell::new(balloon(8.5, 1.75, 1.0), balloon(8.5, 2.75, 1.0), [0.0, 1.0]).unwrap()
}

/// Volume of a balloon.
fn within(length: f64, radius: f64) -> f64 {
    PI * radius * radius * length + 2.0 / 3.0 * PI * radius.powi(3)
}

#[test]
fn the_volume_is_the_difference_of_outer_and_inner_balloon() {
    let exact = within(8.5, 2.75) - within(8.5, 1.75);
    assert!((study().volume() / exact - 1.0).abs() < 1e-13);
}

/// A body between polygons 0.02 cm off the curves: solids of the wall between the polygons end at the body, to rounding; solids between the
/// curves themselves extend beyond it, most where rays are tangent.
#[test]
fn a_wall_between_polygons_ends_at_the_body() {
    let curves = [1.75, 2.75].map(|radius| balloon(8.5, radius, 1.0));
    let tolerance = 0.02;
    let pose = Pose::axis_along_z(5.0).unwrap();
    // The same pieces, one after the other, as a meridian.
    let meridian = |radius: f64| Meridian::smooth(&pieces(8.5, radius, 1.0), tolerance).unwrap();
    let body = Body::new(vec![meridian(1.75), meridian(2.75)], pose).unwrap();
    let drawn = curves
        .each_ref()
        .map(|curve| curve.to_polyline(tolerance).unwrap());
    let worst = |[inner, outer]: [Curve; 2]| {
        let shell = Shell::new(inner, outer, [0.0, 1.0]).unwrap();
        let ring = shell.region([0.0, 1.0], [0.0, 1.0], 1e-6).unwrap();
        let wall = Sector::new(ring, [0.0, 2.0 * PI], pose).unwrap();
        let rays = (0..4000).map(|k| {
            let (sin, cos) = (f64::from(k) * 0.37).sin_cos();
            let across = Vector3::new(-sin, cos, 0.3 * (f64::from(k) * 0.11).sin());
            let aside = 2.76 * (f64::from(k) / 2000.0 - 1.0);
            let from = Point3::new(
                aside * cos,
                aside * sin,
                -5.0 + 11.3 * f64::from(k % 61) / 61.0,
            );
            Ray::new(from, across).unwrap()
        });
        let off = |ray: Ray| {
            (wall.chord(&ray) - (body.chord(1, &ray).unwrap() - body.chord(0, &ray).unwrap())).abs()
        };
        rays.map(off).fold(0.0, f64::max)
    };
    assert!(worst(drawn) < 1e-9);
    assert!(worst(curves) > 0.05);
}

#[test]
fn the_end_layers_are_the_curves() {
    let (shell, inner, outer) = (study(), balloon(8.5, 1.75, 1.0), balloon(8.5, 2.75, 1.0));
    for k in 0..=97 {
        let s = k as f64 / 97.0;
        assert_eq!(shell.point(0.0, s), inner.at(s).position);
        assert_eq!(shell.point(1.0, s), outer.at(s).position);
    }
}

#[test]
fn layers_of_concentric_balls_are_balls() {
    // The radius R(u) of a layer: R^3 = (1 - u) a^3 + u b^3.
    let angle = |s: f64| 0.5 * PI * s;
    let points = |radius: f64, knots: &[f64]| -> Vec<[f64; 2]> {
        knots
            .iter()
            .map(|&s| [radius * angle(s).sin(), radius * angle(s).cos()])
            .collect()
    };
    let knots: Vec<f64> = (0..=4000).map(|k| k as f64 / 4000.0).collect();
    let curve = |radius| Curve::polyline(&knots, &points(radius, &knots)).unwrap();
    let shell = Shell::new(curve(1.0), curve(2.0), [0.0, 1.0]).unwrap();
    for (u, s) in [(0.1, 0.3), (0.5, 0.0), (0.9, 0.77), (0.25, 1.0)] {
        let [x, r] = shell.point(u, s);
        let radius = (1.0 - u + 8.0 * u).cbrt();
        // A polyline of 4000 chords lies within (pi / 8000)^2 / 2 of the circle.
        assert!(
            (x.hypot(r) - radius).abs() < 2e-7,
            "{u} {s}: {}",
            x.hypot(r)
        );
    }
}

/// Volume inside a layer (about the axis, down to it) by Simpson's rule with the slope of finite differences.
fn volume_under(shell: &Shell, layer: f64, knots: &[f64]) -> f64 {
    let n = 400;
    let mut sum = 0.0;
    for pair in knots.windows(2) {
        let h = (pair[1] - pair[0]) / n as f64;
        for k in 0..n {
            let at = |f: f64| shell.point(layer, pair[0] + (k as f64 + f) * h);
            let [p0, p1, p2] = [at(0.0), at(0.5), at(1.0)];
            let slope = [
                -3.0 * p0[0] + 4.0 * p1[0] - p2[0],
                p2[0] - p0[0],
                p0[0] - 4.0 * p1[0] + 3.0 * p2[0],
            ];
            let f = [p0, p1, p2].map(|p| PI * p[1] * p[1]);
            sum += (f[0] * slope[0] + 4.0 * f[1] * slope[1] + f[2] * slope[2]) / 6.0;
        }
    }
    sum
}

#[test]
fn every_layer_contains_its_volume_fraction_for_any_shapes() {
    let (inner, outer) = (balloon(8.5, 1.75, 1.03), balloon(8.5, 2.75, 1.0));
    let knots = [0.0, inner.knots()[1], outer.knots()[1], 1.0];
    let mut knots = knots.to_vec();
    knots.sort_by(f64::total_cmp);
    let shell = Shell::new(inner, outer, [0.0, 1.0]).unwrap();
    let cavity = volume_under(&shell, 0.0, &knots);
    for u in [0.0, 0.2, 0.5, 0.83, 1.0] {
        let volume = volume_under(&shell, u, &knots);
        // Simpson's rule with 400 steps per piece: fourth order, about 1e-9.
        assert!((volume - cavity - u * shell.volume()).abs() < 1e-7 * shell.volume());
    }
}

/// A wall whose fraction of volume before the line of s is s.
fn straight() -> Shell {
    let curve = |r| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [1.0, r]]).unwrap();
    Shell::new(curve(1.0), curve(2.0), [0.0, 1.0]).unwrap()
}

/// The fraction of the wall volume before the line of s.
fn volume_fraction(shell: &Shell, s: f64) -> f64 {
    shell.corresponding(s, &straight())
}

/// The s with this fraction of the wall volume before its line.
fn at_volume_fraction(shell: &Shell, share: f64) -> f64 {
    straight().corresponding(share, shell)
}

#[test]
fn strips_add_up_to_volume_fractions() {
    let shell = study();
    let n = 20_000;
    let mut sum = 0.0;
    for k in 0..n {
        let s = (k as f64 + 0.5) / n as f64;
        sum += shell.volume_rate(s) / n as f64;
        if k % 997 == 0 {
            let share = volume_fraction(&shell, (k + 1) as f64 / n as f64);
            // The midpoint rule with jumps at two knots.
            assert!((share - sum / shell.volume()).abs() < 1e-4);
            assert!((at_volume_fraction(&shell, share) - (k + 1) as f64 / n as f64).abs() < 1e-13);
        }
    }
    // Rounding of sums of a polynomial's coefficients.
    assert!(volume_fraction(&shell, 0.0) < 1e-15 && volume_fraction(&shell, 1.0) > 1.0 - 1e-15);
    assert_eq!(
        (
            at_volume_fraction(&shell, 0.0),
            at_volume_fraction(&shell, 1.0)
        ),
        (0.0, 1.0)
    );
}

#[test]
fn corresponding_positions_have_full_accuracy_near_the_axis() {
    // Discs between x = 0 and x = 1 that narrow to the axis: for the first, whose radii fall as z = 1 - s, the fraction z^2 is beyond s;
    // for the second, whose radii fall as 1 - s^2, the fraction (1 - s^2)^2.
    let disc = |x: f64, r: &[f64]| {
        let r = r.iter().map(|c| c * (1.0 + 0.5 * x)).collect();
        Curve::new(vec![0.0, 1.0], vec![Piece::Power { x: vec![x], r }]).unwrap()
    };
    let shell = |r: &[f64]| Shell::new(disc(0.0, r), disc(1.0, r), [0.0, 1.0]).unwrap();
    let (straight, bent) = (shell(&[1.0, -1.0]), shell(&[1.0, 0.0, -1.0]));
    for k in 0..=60 {
        let s = 1.0 - 10f64.powf(-0.25 * f64::from(k));
        let z = 1.0 - s;
        let there = straight.corresponding(s, &bent);
        // 1 - sqrt(1 - z), without cancellation.
        let exact = z / (1.0 + (1.0 - z).sqrt());
        // Rounding of s and of the coefficients of the polynomials.
        assert!(
            ((1.0 - there) - exact).abs() <= 2e-15 * exact + 3e-16,
            "{z:e}: {there}"
        );
        let back = bent.corresponding(there, &straight);
        assert!((back - s).abs() <= 2e-15 * z + 4e-16, "{z:e}: {back}");
    }
    assert_eq!(
        (
            straight.corresponding(0.0, &bent),
            straight.corresponding(1.0, &bent)
        ),
        (0.0, 1.0)
    );
}

#[test]
fn a_wall_with_both_ends_on_the_axis_has_full_accuracy_at_both() {
    // A shell between two balls: fractions before an angle are those of the sphere, (1 - cos) / 2.
    let ball = |radius: f64, n: usize| {
        let s: Vec<f64> = (0..=n).map(|k| k as f64 / n as f64).collect();
        let at = |s: &f64| [-radius * (PI * s).cos(), radius * (PI * s).sin()];
        let mut points: Vec<[f64; 2]> = s.iter().map(at).collect();
        (points[0][1], points[n][1]) = (0.0, 0.0);
        Curve::polyline(&s, &points).unwrap()
    };
    let shell = |n| Shell::new(ball(1.0, n), ball(2.0, n), [0.0, 1.0]).unwrap();
    let (coarse, fine) = (shell(24), shell(48));
    for k in 0..=48 {
        let near = 0.5 * 10f64.powf(-0.25 * f64::from(k));
        let [low, high] = [near, 1.0 - near].map(|s| coarse.corresponding(s, &fine));
        // The same at both ends, and the inverse.
        assert!(
            (low - (1.0 - high)).abs() < 1e-14 * low + 3e-16,
            "{near:e}: {low} {high}"
        );
        let back = fine.corresponding(low, &coarse);
        assert!((back / near - 1.0).abs() < 1e-13, "{near:e}: {back}");
    }
}

#[test]
fn voxels_of_the_wall_have_their_centres_in_it() {
    let shell = study();
    let grid = VoxelGrid::new([30, 28, 26], [0.45, 0.5, 0.55], [-6.0, -6.5, -6.8]).unwrap();
    for pose in [
        Pose::axis_along_z(5.0).unwrap(),
        Pose::axis_along_z(4.0)
            .unwrap()
            .rotated_x(0.9)
            .unwrap()
            .rotated_y(-0.4)
            .unwrap(),
        Pose::identity(),
    ] {
        let found = shell
            .map_voxels(&pose, &grid, 3..20, 0.0, |p, [layer, s], _| (p.x, layer, s))
            .unwrap();
        let mut all = Vec::new();
        for k in 0..17 * grid.slice_len() {
            let p = pose.to_body(&grid.centre(k % 30, k / 30 % 28, 3 + k / 840));
            if let Some([layer, s]) = shell.locate([p.x, (p.y * p.y + p.z * p.z).sqrt()]) {
                all.push((k, (p.x, layer, s)));
            }
        }
        assert!(
            found == all && all.len() > 500,
            "{} {}",
            found.len(),
            all.len()
        );
    }
    let refused = shell.map_voxels(&Pose::identity(), &grid, 20..27, 0.0, |_, _, _| ());
    assert!(matches!(refused, Err(RevolveError::BadRange { .. })));
}

#[test]
fn the_volume_of_a_region_is_the_product_of_its_fractions() {
    let shell = study();
    for (layers, s) in [
        ([0.0, 1.0], [0.0, 1.0]),
        ([0.2, 0.7], [0.1, 0.6]),
        ([0.0, 0.5], [0.9, 1.0]),
    ] {
        let region = shell.region(layers, s, 1e-7).unwrap();
        let share = (layers[1] - layers[0])
            * (volume_fraction(&shell, s[1]) - volume_fraction(&shell, s[0]));
        let exact = share * shell.volume();
        // The polyline may deviate by its tolerance over about 200 cm^2.
        assert!(
            (region.mass_properties().volume - exact).abs() < 3e-5,
            "{layers:?} {s:?}"
        );
    }
}

#[test]
fn tangents_agree_with_differences_of_points() {
    let shell = Shell::new(
        balloon(8.5, 1.75, 0.96),
        balloon(8.5, 2.75, 1.0),
        [0.0, 1.0],
    )
    .unwrap();
    let h = 1e-5;
    for (u, s) in [
        (0.3, 0.2),
        (0.01, 0.5),
        (0.5, 0.9),
        (0.99, 0.97),
        (0.6, 0.7),
        (0.4, 0.9999),
    ] {
        let [by_layer, by_s] = shell.tangents(u, s);
        let difference = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k| (b[k] - a[k]) / (2.0 * h));
        let other = [
            difference(shell.point(u - h, s), shell.point(u + h, s)),
            difference(shell.point(u, s - h), shell.point(u, s + h)),
        ];
        for k in 0..2 {
            // Second order in h, and rounding divided by h.
            assert!((by_layer[k] - other[0][k]).abs() < 1e-7, "{u} {s}");
            assert!(
                (by_s[k] - other[1][k]).abs() < 1e-6,
                "{u} {s}: {by_s:?} {other:?}"
            );
        }
        // The volume element does not depend on the layer.
        let element =
            2.0 * PI * shell.point(u, s)[1] * (by_s[0] * by_layer[1] - by_s[1] * by_layer[0]);
        assert!((element / shell.volume_rate(s) - 1.0).abs() < 1e-10);
    }
}

#[test]
fn points_outside_the_wall_have_no_coordinates() {
    let shell = study();
    for p in [
        [4.0, 1.7499999],
        [4.0, 2.7500001],
        [-1e-9, 2.0],
        [0.0, 0.0],
        [11.3, 0.0],
        [10.2, 0.1],
        [4.0, f64::NAN],
        [f64::INFINITY, 2.0],
        [1e300, 1e300],
    ] {
        assert_eq!(shell.locate(p), None, "{p:?}");
    }
}

/// Both surfaces have the same tip, where the wall has no thickness and its lines are perpendicular to the axis.
#[test]
fn the_tip_of_a_wall_without_thickness_is_located() {
    let curve = |scale: f64| {
        let scaled = pieces(8.5, 1.75, 1.0).into_iter().map(|piece| match piece {
            Piece::Power { x, r } => Piece::Power {
                x,
                r: r.into_iter().map(|r| scale * r).collect(),
            },
            Piece::Chebyshev { x, r } => Piece::Chebyshev {
                x,
                r: r.into_iter().map(|r| scale * r).collect(),
            },
        });
        Curve::new(vec![0.0, 0.7, 1.0], scaled.collect()).unwrap()
    };
    for scale in [1.001, 1.011, 1.2, 1.5, 2.0] {
        let shell = Shell::new(curve(1.0), curve(scale), [0.0, 1.0]).unwrap();
        for layer in [0.0, 0.5, 1.0] {
            let [x, r] = shell.point(layer, 1.0);
            for aside in [0.0, 1e-18, 1e-17, 1e-16] {
                let found = shell.locate([x, r.abs() + aside]);
                assert!(
                    found.is_some_and(|[_, s]| (s - 1.0).abs() < 1e-6),
                    "{scale} {layer} {aside} {found:?}"
                );
            }
        }
    }
}

#[test]
fn invalid_input_is_rejected() {
    let curve = || balloon(8.5, 1.75, 1.0);
    assert!(matches!(
        Shell::new(balloon(8.5, 2.75, 1.0), curve(), [0.0, 1.0]),
        Err(RevolveError::Folded { .. })
    ));
    assert!(matches!(
        Shell::new(curve(), curve(), [0.0, 1.0]),
        Err(RevolveError::NotPositive { .. })
    ));
    for range in [
        [0.0, f64::NAN],
        [1.0, 0.0],
        [0.0, 0.0],
        [f64::NEG_INFINITY, 1.0],
    ] {
        let refused = Shell::new(curve(), balloon(8.5, 2.75, 1.0), range).err();
        assert!(
            matches!(
                refused,
                Some(RevolveError::NotPositive { .. } | RevolveError::NotFinite { .. })
            ),
            "{range:?}: {refused:?}"
        );
    }
    let piece = |x: Vec<f64>| vec![Piece::Power { x, r: vec![] }];
    for refused in [
        Curve::new(vec![0.0], vec![]).err(),
        Curve::polyline(&[0.0, 1.0], &[[0.0, 1.0]]).err(),
    ] {
        assert!(
            matches!(refused, Some(RevolveError::WrongLength { .. })),
            "{refused:?}"
        );
    }
    assert!(matches!(
        Curve::new(vec![0.0, 0.0], piece(vec![])),
        Err(RevolveError::NotPositive { .. })
    ));
    assert!(matches!(
        Curve::new(vec![0.0, 1.0], piece(vec![f64::NAN])),
        Err(RevolveError::NotFinite { .. })
    ));
    let shell = study();
    for (layers, s, tolerance) in [
        ([0.5, 0.5], [0.0, 1.0], 1e-3),
        ([0.0, 1.0], [0.3, 0.3], 1e-3),
        ([0.0, 1.0], [0.0, 1.0], 0.0),
        ([0.0, f64::NAN], [0.0, 1.0], 1e-3),
    ] {
        let refused = shell.region(layers, s, tolerance).err();
        assert!(
            matches!(
                refused,
                Some(RevolveError::NotPositive { .. } | RevolveError::NotFinite { .. })
            ),
            "{refused:?}"
        );
    }
}

#[test]
fn thickness_is_the_distance_between_the_surfaces() {
    // Cylinder and half-ball about one axis: 1 cm everywhere, also where points of equal s are farther apart.
    let even = study().thicknesses();
    assert!(
        (even.minimum - 1.0).abs() < 1e-12 && (even.mean - 1.0).abs() < 1e-12,
        "{even:?}"
    );
    assert!((study().thickness(0.0) - 1.0).abs() < 1e-14);
    // A cone within a cylinder: r = 2 - s, x = 4 s, around it r = 3, up to x = 4.
    let line = |a: [f64; 2], b: [f64; 2]| Curve::polyline(&[0.0, 1.0], &[a, b]).unwrap();
    let cone = Shell::new(
        line([0.0, 2.0], [4.0, 1.0]),
        line([0.0, 3.0], [4.0, 3.0]),
        [0.0, 1.0],
    )
    .unwrap();
    for k in 0..=10 {
        let s = f64::from(k) / 10.0;
        assert!((cone.thickness(s) - 1.0 - s).abs() < 1e-14);
    }
    let all = cone.thicknesses();
    // Mean of (1 + s) weighed by (2 - s): (2 + 1/2 - 1/3) / (3/2).
    assert!((all.mean - 13.0 / 9.0).abs() < 1e-12, "{all:?}");
    assert!((all.minimum - 1.0).abs() < 1e-14 && all.thinnest_at < 1e-7);
    // Brute force on a bent wall.
    let shell = Shell::new(
        balloon(8.5, 1.75, 1.03),
        balloon(8.5, 2.75, 1.0),
        [0.0, 1.0],
    )
    .unwrap();
    let (inner, outer) = (balloon(8.5, 1.75, 1.03), balloon(8.5, 2.75, 1.0));
    let brute = |s: f64| {
        let from = inner.at(s).position;
        let places = (0..=20_000).map(|k| outer.at(f64::from(k) / 20_000.0).position);
        places
            .map(|p| (p[0] - from[0]).hypot(p[1] - from[1]))
            .fold(f64::INFINITY, f64::min)
    };
    for k in 0..=20 {
        let s = f64::from(k) / 20.0;
        // Half a step of 6e-4 from the nearest point: its square divided by the distance.
        assert!((shell.thickness(s) - brute(s)).abs() < 1e-6, "{s}");
    }
    let all = shell.thicknesses();
    let least = (0..=1000)
        .map(|k| brute(f64::from(k) / 1000.0))
        .fold(f64::INFINITY, f64::min);
    assert!(
        (all.minimum - least).abs() < 1e-5 && all.mean > all.minimum,
        "{all:?} {least}"
    );
}

proptest! {
    #[test]
    fn locate_inverts_point(u in 0.0..=1.0f64, s in 0.0..=1.0f64, stretch in 0.95..1.03f64) {
        let shell = Shell::new(balloon(8.5, 1.75, stretch), balloon(8.5, 2.75, 1.0), [0.0, 1.0]).unwrap();
        let found = shell.locate(shell.point(u, s));
        prop_assert!(found.is_some());
        let [layer, at] = found.unwrap();
        // Rounding of a point, 1e-15 of 11 cm, divided by the thinnest wall, 0.65 cm.
        prop_assert!((layer - u).abs() < 1e-12 && (at - s).abs() < 1e-12, "{u} {s}: {layer} {at}");
    }

    #[test]
    fn volume_fractions_are_inverted(share in 0.0..=1.0f64) {
        let shell = study();
        prop_assert!((volume_fraction(&shell, at_volume_fraction(&shell, share)) - share).abs() < 1e-13);
    }
}
