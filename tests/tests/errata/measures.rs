//! Area, volume and surface; the pair, the appendix, the pose.

use super::*;

#[test]
fn eq_31_takes_signed_terms() {
    // A unit square with a slot cut into it from the right, traversed once: 1 - 0.2 * 0.5.
    let square: Curve = [
        (0., 0.),
        (0., 1.),
        (1., 1.),
        (1., 0.6),
        (0.5, 0.6),
        (0.5, 0.4),
        (1., 0.4),
        (1., 0.),
        (0., 0.),
    ]
    .map(|(x, y)| Vector2::new(x, y))
    .to_vec();
    assert!((area(&square) - 0.9).abs() < 1e-15);
    let printed: f64 = square
        .windows(2)
        .map(|p| ((p[1].x - p[0].x) * (p[1].y + p[0].y) / 2.0).abs())
        .sum();
    assert!((printed - 0.9).abs() > 0.1, "{printed}");
}

#[test]
fn eq_34_sums_the_segments_of_the_upper_half() {
    let exact = PI * INNER * INNER * (H + 4.0 * INNER / 6.0);
    let printed = |c: &Curve| -> f64 {
        let last = c.len().div_ceil(2); // i < N/2, i from 0
        c[..=last].windows(2).map(cone).sum()
    };
    // N odd, a node at the apex: the printed bound includes one segment of the lower half, which cancels the last cone.
    let odd = balloon(41, H, INNER);
    let last_cone = cone(&odd[19..=20]);
    assert!(last_cone > 0.01);
    assert!((volume(&odd) - printed(&odd) - last_cone).abs() < 1e-12);
    let error = |n: usize| (volume(&balloon(n, H, INNER)) / exact - 1.0).abs();
    assert!(error(401) < 1e-4 && error(401) < error(41) / 50.0);
    // N even, an asymmetric curve: the middle segment crosses the axis and has to be split there.
    let mut even: Curve = balloon(40, H, INNER);
    even[20].x -= 0.3;
    let (p, q) = (even[19], even[20]);
    let crossing = Vector2::new(p.x + (q.x - p.x) * p.y / (p.y - q.y), 0.0);
    let split: f64 = even[..=19].windows(2).map(cone).sum::<f64>() + cone(&[p, crossing]);
    assert!((split - printed(&even)).abs() > 1e-3);
}

#[test]
fn eq_35_is_a_volume_gain() {
    let (end_systolic, end_diastolic) = (1.0, 1.6);
    let gain: f64 = (end_diastolic - end_systolic) / end_systolic;
    let ejection_fraction: f64 = (end_diastolic - end_systolic) / end_diastolic;
    assert!((gain - 0.6).abs() < 1e-15 && (ejection_fraction - 0.375).abs() < 1e-15);
    assert!((ejection_fraction - gain / (1.0 + gain)).abs() < 1e-15);
}

/// f of the outer membrane that carries the same total force as the inner one at `f_inner`.
fn outer_f_of_equal_force(rest: &Curve, force: f64) -> f64 {
    let (mut low, mut high) = (1.0, 40.0); // f S(f) grows with f
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if middle * surface(&equilibrium(rest, middle)) < force {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[test]
fn section_4_2_water_keeps_the_volume_and_not_the_area() {
    let (inner_rest, outer_rest) = (balloon(401, H, INNER), balloon(401, H, OUTER));
    let wall = |measure: fn(&Curve) -> f64, inner: &Curve, outer: &Curve| {
        (measure(outer) - measure(inner)) / (measure(&outer_rest) - measure(&inner_rest)) - 1.0
    };
    // Gain 0.6 and constant wall volume in the limit of fine meshes; the discretisation error at N = 401 is about 1e-5.
    let inner = equilibrium(&inner_rest, 17.48357527761);
    assert!((volume(&inner) / volume(&inner_rest) - 1.6).abs() < 1e-3);
    let outer = equilibrium(&outer_rest, 10.30942447850);
    assert!(
        wall(volume, &inner, &outer).abs() < 5e-4,
        "{}",
        wall(volume, &inner, &outer)
    );
    let change = wall(area, &inner, &outer);
    assert!(
        (change + 0.113).abs() < 1e-3,
        "2-D area changes by {change}"
    );

    // The same total force on both membranes.
    let f = outer_f_of_equal_force(&outer_rest, 17.48357527761 * surface(&inner));
    let outer = equilibrium(&outer_rest, f);
    let (by_volume, by_area) = (wall(volume, &inner, &outer), wall(area, &inner, &outer));
    assert!((by_volume - 0.0473).abs() < 1e-3, "{by_volume}");
    assert!((by_area + 0.0735).abs() < 1e-3, "{by_area}");

    // The same f on both.
    let outer = equilibrium(&outer_rest, 17.48357527761);
    let by_volume = wall(volume, &inner, &outer);
    assert!((by_volume - 0.285).abs() < 2e-3, "{by_volume}");
}

#[test]
fn appendix_z_of_zero_is_the_held_end() {
    let (r, mu) = (1.3, 2.1);
    let turn = Complex::new(0.0, -mu).exp();
    let one = Complex::new(1.0, 0.0);
    let a = Complex::new(0.0, 2.0 * r) / (one - turn);
    let corrected = -Complex::new(0.0, r) * (one + turn) / (one - turn);
    assert!(
        (a + corrected - Complex::new(0.0, r)).norm() < 1e-14,
        "z(0) = i R"
    );
    assert!(
        (a * turn + corrected + Complex::new(0.0, r)).norm() < 1e-14,
        "z(1) = -i R"
    );
    let printed = -(one - turn) / (one - turn) * r;
    assert!((a + printed - Complex::new(0.0, r)).norm() > 0.1);
}

#[test]
fn appendix_alpha_is_the_radius_with_its_sign() {
    for mu in [0.4, 2.0, PI, 5.9] {
        let r = 1.3;
        let phi = (mu.sin() / (mu.cos() - 1.0)).atan();
        let beta = r * mu.sin() / (mu.cos() - 1.0);
        let point = |alpha: f64, s: f64| {
            Vector2::new(
                alpha * (mu * s - phi).sin() + beta,
                alpha * (mu * s - phi).cos(),
            )
        };
        let alpha = 2.0 * r * (mu / 2.0).sin() / (1.0 - mu.cos());
        assert!((alpha - r / (mu / 2.0).sin()).abs() < 1e-12);
        assert!((point(alpha, 0.0) - Vector2::new(0.0, r)).norm() < 1e-12);
        assert!((point(alpha, 1.0) - Vector2::new(0.0, -r)).norm() < 1e-12);
        let printed = point(-alpha, 0.0);
        assert!((printed - Vector2::new(-2.0 * r / (mu / 2.0).tan(), -r)).norm() < 1e-12);
    }
}

#[test]
fn appendix_c_comes_with_the_solution() {
    // mu of three loads from an independent collocation solver.
    for (f, mu) in [
        (3.0, 1.383242729251169),
        (10.0, 3.1621937791231236),
        (200.0, 5.929731185627694),
    ] {
        assert!((circle(1.0, f).mu - mu).abs() < 1e-12);
    }
    let Circle { mu, radius, centre } = circle(1.0, 10.0);
    let speed = radius * mu; // |z'| = C, and mu = f/(lambda C)
    assert!((mu - 10.0 / speed).abs() < 1e-12);
    assert!((mu - 10.0 / 2.0).abs() > 1.0, "C = 2R would make mu = 5");
    // The finite-difference equilibrium converges to this circle with order 2.
    let error = |n: usize| {
        equilibrium(&disc(n, 1.0), 10.0)
            .iter()
            .map(|p| ((p - Vector2::new(centre, 0.0)).norm() - radius).abs())
            .fold(0.0, f64::max)
    };
    let slope = order(error(101), error(201));
    assert!((slope - 2.0).abs() < 0.05, "order {slope}");
}

#[test]
fn figure_13_the_pose_is_fixed_by_its_direction() {
    // Axis along z, 45 degrees about x, then 45 degrees about y, right-handed.
    let (sin, cos) = (PI / 4.0).sin_cos();
    let after_x = [0.0, -sin, cos];
    let after_y = [
        cos * after_x[0] + sin * after_x[2],
        after_x[1],
        cos * after_x[2] - sin * after_x[0],
    ];
    let expected = [0.5, -0.5f64.sqrt(), 0.5];
    assert!(
        after_y
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-15)
    );
    // The other order of the two rotations gives another direction, so the order belongs to the convention.
    let other = [sin, -sin * cos, cos * cos];
    assert!((other[0] - 0.5f64).abs() > 0.1 && (other[1] + 0.5).abs() < 1e-15);
}
