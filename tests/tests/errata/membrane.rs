//! Sections 2 and 3.1: areas, forces, the Jacobian.

use super::*;

#[test]
fn table_2_area_is_two_rectangles_and_a_half_disc() {
    let corrected = INNER * (2.0 * H + PI * INNER / 2.0);
    assert!((corrected - 34.560563750809).abs() < 1e-12);
    // A polygon inscribed in the half circle: relative error (pi/m)^2/6 of the half disc with m segments on it.
    assert!((area(&balloon(20_001, H, INNER)) - corrected).abs() < 1e-6);
    let printed = PI * INNER * (2.0 * H + INNER / 2.0);
    assert!((printed / corrected - 1.0).abs() > 1.0);
}

#[test]
fn eq_4_surface_needs_the_upper_half_only() {
    let c = balloon(2001, H, INNER);
    let whole: f64 = c
        .windows(2)
        .map(|p| PI * (p[0].y + p[1].y) * (p[1] - p[0]).norm())
        .sum();
    let exact = 2.0 * PI * INNER * H + 2.0 * PI * INNER * INNER;
    assert!(whole.abs() < 1e-9 * exact, "the two halves cancel: {whole}");
    // Inscribed polygon, as above, with 500 segments on the quarter circle.
    assert!((surface(&c) / exact - 1.0).abs() < 1e-5);
}

/// (F_e by Eq. 5 with the stiffness at `left` and `right` of s, undivided) for u = sin(2 s), lambda = 1 + s^2, at s = 0.3.
fn spring_force(ds: f64, left: f64, right: f64) -> f64 {
    let (s, u) = (0.3, |s: f64| (2.0 * s).sin());
    let lambda = |s: f64| 1.0 + s * s;
    lambda(s + right) * (u(s + ds) - u(s)) + lambda(s + left) * (u(s - ds) - u(s))
}

/// (lambda u')' and (lambda u)' of the same functions, by hand.
const fn divergence_form() -> f64 {
    // lambda' u' + lambda u'' with u' = 2 cos 0.6, u'' = -4 sin 0.6.
    0.6 * 2.0 * COS_06 - 1.09 * 4.0 * SIN_06
}
const COS_06: f64 = 0.825_335_614_909_678_3;
const SIN_06: f64 = 0.564_642_473_395_035_4;

#[test]
fn eq_5_second_spring_has_the_stiffness_of_its_own_side() {
    let error = |ds: f64, left: f64| {
        (spring_force(ds, left, ds / 2.0) / (ds * ds) - divergence_form()).abs()
    };
    let slope = order(error(0.02, -0.01), error(0.01, -0.005));
    assert!((slope - 2.0).abs() < 0.05, "corrected: order {slope}");
    // With lambda(s + ds/2) on both sides lambda' u' is missing.
    let printed = error(1e-3, 0.5e-3);
    assert!((printed - 0.6 * 2.0 * COS_06).abs() < 1e-2, "{printed}");
}

#[test]
fn eq_5_to_6_needs_the_division_by_ds_squared() {
    let undivided = |ds: f64| spring_force(ds, -ds / 2.0, ds / 2.0);
    assert!((order(undivided(0.02), undivided(0.01)) - 2.0).abs() < 0.01);
    assert!((undivided(1e-3) / 1e-6 - divergence_form()).abs() < 1e-4);
}

#[test]
fn eq_6_and_10_have_a_prime_on_the_displacement() {
    let limit = spring_force(1e-3, -0.5e-3, 0.5e-3) / 1e-6;
    let printed = 0.6 * SIN_06 + 1.09 * 2.0 * COS_06; // (lambda u)'
    assert!((limit - divergence_form()).abs() < 1e-4);
    assert!((limit - printed).abs() > 1.0);
}

#[test]
fn eq_11_has_the_curvature_of_the_rest_shape_on_the_right() {
    // Without pressure the reference configuration is the equilibrium: z'' = z0'' at every node, z'' = z0 nowhere on the cylinder.
    let c0 = balloon(101, H, INNER);
    assert!(imbalance(&c0, &c0, 0.0) == 0.0);
    let second = (c0[11] - 2.0 * c0[10] + c0[9]) / spacing(&c0).powi(2);
    assert!(second.norm() < 1e-9 && c0[10].norm() > 1.0);
    // And F_p is i f z'/|z'|, as the equation has it.
    let c = balloon(101, H, OUTER);
    let z = |k: usize| Complex::new(c[k].x, c[k].y);
    let d = z(61) - z(59);
    let expected = Complex::new(0.0, 1.0) * d / d.norm() * 3.0;
    assert!((pressure(&c, 60, 3.0) - Vector2::new(expected.re, expected.im)).norm() < 1e-14);
}

#[test]
fn section_3_1_2_divides_by_ds_squared() {
    let apex = |n: usize, f: f64| equilibrium(&disc(n, 1.0), f)[n / 2].x;
    let exact = circle(1.0, 10.0);
    let exact = exact.radius + exact.centre;
    let slope = order(
        (apex(51, 10.0) - exact).abs(),
        (apex(101, 10.0) - exact).abs(),
    );
    assert!((slope - 2.0).abs() < 0.1, "order {slope}");
    // Division by ds once softens the springs by a factor ds, as would a pressure of f/ds, and the shape depends on N.
    // (Eq. 3.1.2 times ds: f ds^-1 n + u''.)  f = 0.1 so that 50 and 100 times this value still give a circle.
    let printed = |n: usize| apex(n, 0.1 * (n - 1) as f64);
    assert!((printed(51) - printed(101)).abs() > 0.3);
}

#[test]
fn eq_14_the_two_derivatives_of_the_pressure_are_opposite() {
    let c = balloon(41, H, INNER);
    // A node on the cap, where the tangent has both components.
    let (k, f, step) = (17, 2.0, 1e-6);
    for (which, node) in [(0, k - 1), (1, k + 1)] {
        let mut difference = Matrix2::zeros();
        for axis in 0..2 {
            let (mut plus, mut minus) = (c.clone(), c.clone());
            plus[node][axis] += step;
            minus[node][axis] -= step;
            let column = (pressure(&plus, k, f) - pressure(&minus, k, f)) / (2.0 * step);
            difference.set_column(axis, &column);
        }
        let pick = |pair: (Matrix2<f64>, Matrix2<f64>)| if which == 0 { pair.0 } else { pair.1 };
        // Central differences: 1e-12 of truncation and 1e-16/1e-6 of rounding, times derivatives of order 1.
        assert!((pick(jacobian_corrected(&c, k, f)) - difference).norm() < 1e-8);
        let printed_is_right = (pick(jacobian_printed(&c, k, f)) - difference).norm() < 1e-8;
        assert_eq!(printed_is_right, which == 1);
    }
}

#[test]
fn eq_14_as_printed_makes_newton_stall_and_corrected_converges_quadratically() {
    let c0 = balloon(201, H, INNER);
    let (_, printed) = newton(&c0, 17.5, jacobian_printed, 60);
    assert_eq!(printed.len(), 61);
    assert!(printed[50..].iter().all(|&norm| norm > 1.0), "{printed:?}");
    let (_, corrected) = newton(&c0, 17.5, jacobian_corrected, 60);
    assert!(corrected[2] < 1e-4 && corrected.len() <= 5, "{corrected:?}");
    // The same at a load 20 times as high.
    let (_, heavy) = newton(&c0, 400.0, jacobian_corrected, 60);
    assert!(heavy.len() <= 7, "{heavy:?}");
}

#[test]
fn section_3_2_2_second_difference_is_divided_by_ds_squared() {
    let second = |ds: f64| ((0.5 + ds).exp() - 2.0 * 0.5f64.exp() + (0.5 - ds).exp()) / (ds * ds);
    let error = |ds: f64| (second(ds) - 0.5f64.exp()).abs();
    assert!((order(error(0.1), error(0.05)) - 2.0).abs() < 0.01);
    // Divided by 2 ds it tends to zero.
    let printed = |ds: f64| second(ds) * ds / 2.0;
    assert!(printed(1e-3) < 1e-3);
}

#[test]
fn section_3_2_2_pressure_is_another_law_than_eq_4() {
    // Eq. 4 has the same size at every node and scales as 1/length^2; the printed one as r and 1/length^3.
    let rough: Curve = balloon(41, H, INNER)
        .iter()
        .map(|p| Vector2::new(p.x * (1.0 + 0.02 * p.x), p.y))
        .collect();
    let eq_4 = |c: &Curve, k: usize| pressure(c, k, 1.0 / surface(c)).norm();
    let rest = surface(&rough);
    let printed = |c: &Curve, k: usize, rest: f64| {
        let d = (c[k + 1] - c[k - 1]) / (2.0 * spacing(c));
        d.norm() / (rest * surface(c))
    };
    let twice: Curve = rough.iter().map(|p| p * 2.0).collect();
    assert!((eq_4(&rough, 3) / eq_4(&rough, 12) - 1.0).abs() < 1e-13);
    assert!((printed(&rough, 3, rest) / printed(&rough, 12, rest) - 1.0).abs() > 0.1);
    assert!((eq_4(&rough, 3) / eq_4(&twice, 3) - 4.0).abs() < 1e-12);
    assert!((printed(&rough, 3, rest) / printed(&twice, 3, 4.0 * rest) - 8.0).abs() < 1e-12);
}
