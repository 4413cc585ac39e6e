//! The misprints of Rohmer et al. 2006 (hal-03929238), row by row of `docs/errata.md`: what is printed fails, what we use holds.
//!
//! Nothing here calls the crates: the formulas stand as printed and as corrected, side by side, on a discretisation written
//! from scratch. That the crates use the corrected ones is the business of their own tests.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use std::f64::consts::PI;

type Curve = Vec<Vector2<f64>>;

const H: f64 = 8.5;
const INNER: f64 = 1.75;
const OUTER: f64 = 2.75;

/// `n` nodes of the rest shape, equally spaced along it: cylinder of length `h`, half circle of radius `r`, back.
fn balloon(n: usize, h: f64, r: f64) -> Curve {
    let length = 2.0 * h + PI * r;
    let at = |arc: f64| {
        if arc <= h {
            Vector2::new(arc, r)
        } else if arc >= h + PI * r {
            Vector2::new(length - arc, -r)
        } else {
            let angle = (arc - h) / r;
            Vector2::new(h + r * angle.sin(), r * angle.cos())
        }
    };
    (0..n)
        .map(|k| at(length * k as f64 / (n - 1) as f64))
        .collect()
}

/// The straight line from (0, r) to (0, -r): the rest shape of the appendix.
fn disc(n: usize, r: f64) -> Curve {
    (0..n)
        .map(|k| Vector2::new(0.0, r - 2.0 * r * k as f64 / (n - 1) as f64))
        .collect()
}

fn spacing(c: &Curve) -> f64 {
    1.0 / (c.len() - 1) as f64
}

/// f n at an interior node, by central differences.
fn pressure(c: &Curve, k: usize, f: f64) -> Vector2<f64> {
    let d = c[k + 1] - c[k - 1];
    Vector2::new(-d.y, d.x) * (f / d.norm())
}

/// lambda (c - c0)'' at an interior node, lambda = 1.
fn elastic(c: &Curve, c0: &Curve, k: usize) -> Vector2<f64> {
    let u = |j: usize| c[j] - c0[j];
    (u(k + 1) - 2.0 * u(k) + u(k - 1)) / spacing(c).powi(2)
}

/// Largest |F_p + F_e| over the interior nodes.
fn imbalance(c: &Curve, c0: &Curve, f: f64) -> f64 {
    (1..c.len() - 1)
        .map(|k| (pressure(c, k, f) + elastic(c, c0, k)).norm())
        .fold(0.0, f64::max)
}

/// Derivatives of the pressure at a node with respect to (the node before, the node after).
type PressureJacobian = fn(&Curve, usize, f64) -> (Matrix2<f64>, Matrix2<f64>);

/// Eq. 14 as it follows from the pressure: it depends on c(n+1) - c(n-1) only, so the two are opposite.
fn jacobian_corrected(c: &Curve, k: usize, f: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let d = c[k + 1] - c[k - 1];
    let n = d.norm();
    let n3 = n.powi(3);
    let after = Matrix2::new(
        d.x * d.y / n3,
        d.y * d.y / n3 - 1.0 / n,
        1.0 / n - d.x * d.x / n3,
        -d.x * d.y / n3,
    ) * f;
    (-after, after)
}

/// Eq. 14 as printed: a plus in two of the entries for the node before.
fn jacobian_printed(c: &Curve, k: usize, f: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let d = c[k + 1] - c[k - 1];
    let n = d.norm();
    let n3 = n.powi(3);
    let (mut before, after) = jacobian_corrected(c, k, f);
    before[(0, 1)] = f * (d.y * d.y / n3 + 1.0 / n);
    before[(1, 0)] = -f * (d.x * d.x / n3 + 1.0 / n);
    (before, after)
}

/// Solves the block tridiagonal system with blocks `before`, `at`, `after` (row k couples k-1, k, k+1).
fn block_tridiagonal(
    rows: &[(Matrix2<f64>, Matrix2<f64>, Matrix2<f64>)],
    rhs: &[Vector2<f64>],
) -> Vec<Vector2<f64>> {
    let n = rows.len();
    let mut upper = vec![Matrix2::zeros(); n];
    let mut x = vec![Vector2::zeros(); n];
    for k in 0..n {
        let (before, at, after) = rows[k];
        let (mut pivot, mut right) = (at, rhs[k]);
        if k > 0 {
            pivot -= before * upper[k - 1];
            right -= before * x[k - 1];
        }
        let inverse = pivot.try_inverse().expect("a regular pivot");
        upper[k] = inverse * after;
        x[k] = inverse * right;
    }
    for k in (0..n - 1).rev() {
        let next = x[k + 1];
        x[k] -= upper[k] * next;
    }
    x
}

/// Newton from rest with a fixed f; the imbalance before each step and after the last.
fn newton(c0: &Curve, f: f64, jacobian: PressureJacobian, max_steps: usize) -> (Curve, Vec<f64>) {
    let mut c = c0.clone();
    let k_scale = spacing(c0).powi(-2);
    let mut history = vec![imbalance(&c, c0, f)];
    for _ in 0..max_steps {
        let nodes = 1..c.len() - 1;
        let rows: Vec<_> = nodes
            .clone()
            .map(|k| {
                let (before, after) = jacobian(&c, k, f);
                let spring = Matrix2::identity() * k_scale;
                (before + spring, spring * -2.0, after + spring)
            })
            .collect();
        let rhs: Vec<_> = nodes
            .map(|k| -(pressure(&c, k, f) + elastic(&c, c0, k)))
            .collect();
        for (node, step) in c[1..].iter_mut().zip(block_tridiagonal(&rows, &rhs)) {
            *node += step;
        }
        history.push(imbalance(&c, c0, f));
        if *history.last().expect("not empty") < 1e-9 {
            break;
        }
    }
    (c, history)
}

fn equilibrium(c0: &Curve, f: f64) -> Curve {
    let (c, history) = newton(c0, f, jacobian_corrected, 30);
    // 1/ds^2 is up to 1.6e5 here and lengths are about 10: rounding alone leaves 1e-16 * 10 * 1.6e5.
    assert!(history.last().expect("not empty") < &1e-8, "{history:?}");
    c
}

/// Signed shoelace sum.
fn area(c: &Curve) -> f64 {
    c.windows(2)
        .map(|p| (p[1].x - p[0].x) * (p[1].y + p[0].y) / 2.0)
        .sum()
}

fn cone(p: &[Vector2<f64>]) -> f64 {
    PI / 3.0 * (p[1].x - p[0].x) * (p[1].y * p[1].y + p[1].y * p[0].y + p[0].y * p[0].y)
}

/// Volume of revolution of the upper half of a curve with a node at the apex.
fn volume(c: &Curve) -> f64 {
    c[..=c.len() / 2].windows(2).map(cone).sum()
}

/// Lateral surface of revolution of the upper half.
fn surface(c: &Curve) -> f64 {
    c[..=c.len() / 2]
        .windows(2)
        .map(|p| PI * (p[0].y + p[1].y) * (p[1] - p[0]).norm())
        .sum()
}

/// Slope of the error between two refinements by a factor of 2.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

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
    // With lambda(s + ds/2) on both sides lambda' u' is lost.
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
    // Without pressure the rest shape is the equilibrium: z'' = z0'' at every node, z'' = z0 nowhere on the cylinder.
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
    // Divided by ds once, the springs weaken by ds: the same as a pressure of f/ds, and the shape depends on N.
    // (Eq. 3.1.2 times ds: f ds^-1 n + u''.)  f = 0.1 so that 50 and 100 times that still make a circle.
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
    // Still so at a load 20 times as high.
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

/// One scalar membrane of four free nodes: M_sys, M_e, the block dF_p/dc on the velocities, M_d, for U = (c, v).
struct SmallSystem {
    sys: DMatrix<f64>,
    elastic: DMatrix<f64>,
    pressure_slope: DMatrix<f64>,
    damping: DMatrix<f64>,
}

const FREE: usize = 4;
const MU: f64 = 0.7;

fn small_system() -> SmallSystem {
    let springs = DMatrix::from_fn(FREE, FREE, |i, j| match i.abs_diff(j) {
        0 => -2.0,
        1 => 1.0,
        _ => 0.0,
    });
    let slope = DMatrix::from_fn(FREE, FREE, |i, j| {
        0.4 * (j as f64 - i as f64).clamp(-1.0, 1.0)
    });
    let block = |row: usize, column: usize, entries: &DMatrix<f64>| {
        let mut whole = DMatrix::zeros(2 * FREE, 2 * FREE);
        whole
            .view_mut((row, column), (FREE, FREE))
            .copy_from(entries);
        whole
    };
    let identity = DMatrix::identity(FREE, FREE);
    SmallSystem {
        sys: block(0, FREE, &identity),
        elastic: block(FREE, 0, &springs),
        pressure_slope: block(FREE, FREE, &slope),
        damping: block(FREE, FREE, &(identity * -MU)),
    }
}

/// A vector (0, g(i)): a force on the velocities.
fn force(g: impl Fn(usize) -> f64) -> DVector<f64> {
    DVector::from_fn(2 * FREE, |i, _| if i < FREE { 0.0 } else { g(i - FREE) })
}

#[test]
fn eq_24_subtracts_the_elastic_force_of_the_rest_shape() {
    // M_e U - F^0 must vanish at c = c0 whatever the velocity, so F^0 = K c0: there is no damping in it.
    let system = small_system();
    let at_rest = DVector::from_fn(2 * FREE, |i, _| if i < FREE { 1.0 + i as f64 } else { 5.0 });
    let moving_less =
        DVector::from_fn(2 * FREE, |i, _| if i < FREE { 1.0 + i as f64 } else { 2.0 });
    let elastic_rest = &system.elastic * &at_rest;
    assert_eq!((&system.elastic * &moving_less - &elastic_rest).norm(), 0.0);
    assert!((&system.elastic * &moving_less - &system.damping * &at_rest).norm() > 1.0);
}

/// Which of the misprints of Eq. 28 and 29 to make.
#[derive(Default)]
struct Misprints {
    elastic_sign: bool,
    pressure_slope: bool,
    forces_without_dt: bool,
    damping_without_dt: bool,
}

/// How far one step is from implicit Euler with a linear F_p: c+ = c + dt v+ and
/// v+ = v + dt (K (c+ - c0) + F_p(c) + F_p' (c+ - c) - mu v). Zero but for rounding if the step is right.
fn step_defect(misprints: Misprints) -> f64 {
    let SmallSystem {
        sys,
        elastic,
        pressure_slope,
        damping,
    } = small_system();
    let dt = 0.1;
    let identity = DMatrix::<f64>::identity(2 * FREE, 2 * FREE);
    let state = DVector::from_fn(2 * FREE, |i, _| (i as f64 * 0.9).sin());
    let (push, rest) = (force(|i| 1.0 + 0.1 * i as f64), force(|i| 0.3 * i as f64));
    let dm_p = &pressure_slope * dt;

    let elastic_sign = if misprints.elastic_sign { -1.0 } else { 1.0 };
    let slope_factor = if misprints.pressure_slope { -dt } else { 1.0 };
    let matrix = &identity - (&sys + &elastic * elastic_sign + &dm_p * slope_factor) * dt;
    let force_factor = if misprints.forces_without_dt { 1.0 } else { dt };
    let damping_factor = if misprints.damping_without_dt {
        1.0
    } else {
        dt
    };
    let right = (&identity + &damping * damping_factor) * &state + (&push - &rest) * force_factor;
    let next = matrix.lu().solve(&right).expect("a regular matrix");

    let moved = DVector::from_fn(2 * FREE, |i, _| {
        if i < FREE {
            0.0
        } else {
            next[i - FREE] - state[i - FREE]
        }
    });
    let euler = &state
        + (&sys * &next + &elastic * &next - &rest
            + &push
            + &pressure_slope * moved
            + &damping * &state)
            * dt;
    (next - euler).norm()
}

#[test]
fn eq_28_and_29_signs_and_time_steps_of_implicit_euler() {
    assert!(step_defect(Misprints::default()) < 1e-14);
    let printed = [
        Misprints {
            elastic_sign: true,
            ..Misprints::default()
        },
        Misprints {
            pressure_slope: true,
            ..Misprints::default()
        },
        Misprints {
            forces_without_dt: true,
            ..Misprints::default()
        },
        Misprints {
            damping_without_dt: true,
            ..Misprints::default()
        },
    ];
    for (which, misprints) in printed.into_iter().enumerate() {
        assert!(step_defect(misprints) > 1e-3, "misprint {which}");
    }
}

#[test]
fn after_eq_29_the_norm_to_stop_at_is_that_of_pressure_and_springs() {
    let c0 = balloon(201, H, INNER);
    let c = equilibrium(&c0, 17.5);
    assert!(imbalance(&c, &c0, 17.5) < 1e-8);
    // At equilibrium |F_e| = f at every node: |F_e + F_e| never gets below 2 f.
    let springs = elastic(&c, &c0, 50) * 2.0;
    assert!((springs.norm() - 35.0).abs() < 1e-8);
}

/// The evolving method, total force, banded part of the Jacobian; the imbalance after each step until 1e-4.
fn evolve(dt: f64, mu: f64, max_steps: usize) -> Vec<f64> {
    const TOTAL_FORCE: f64 = 2588.9;
    let c0 = balloon(201, H, INNER);
    let k_scale = spacing(&c0).powi(-2);
    let (mut c, mut v) = (c0.clone(), vec![Vector2::zeros(); 199]);
    let mut norms = Vec::new();
    while norms.len() < max_steps {
        let f = TOTAL_FORCE / surface(&c);
        let rows: Vec<_> = (1..200)
            .map(|k| {
                let (before, after) = jacobian_corrected(&c, k, f);
                let spring = Matrix2::identity() * k_scale;
                let at = Matrix2::identity() * (1.0 + dt * mu + 2.0 * dt * dt * k_scale);
                (
                    (before + spring) * -(dt * dt),
                    at,
                    (after + spring) * -(dt * dt),
                )
            })
            .collect();
        let rhs: Vec<_> = (1..200)
            .map(|k| v[k - 1] + (pressure(&c, k, f) + elastic(&c, &c0, k)) * dt)
            .collect();
        v = block_tridiagonal(&rows, &rhs);
        for (node, velocity) in c[1..].iter_mut().zip(&v) {
            *node += velocity * dt;
        }
        norms.push(imbalance(&c, &c0, TOTAL_FORCE / surface(&c)));
        if *norms.last().expect("just pushed") < 1e-4 {
            break;
        }
    }
    norms
}

#[test]
fn section_4_2_the_norm_falls_at_every_step_for_large_steps_only() {
    for mu in [0.0, 0.5, 1.0] {
        for dt in [2.0, 4.0] {
            let norms = evolve(dt, mu, 30);
            assert!(
                norms.windows(2).all(|pair| pair[1] < pair[0]),
                "dt {dt}, mu {mu}: {norms:?}"
            );
            assert!(norms.len() <= 12, "dt {dt}, mu {mu}: {norms:?}");
        }
        let norms = evolve(0.5, mu, 30);
        assert!(
            norms.windows(2).any(|pair| pair[1] > pair[0]),
            "dt 0.5, mu {mu}: {norms:?}"
        );
    }
}

#[test]
fn eq_31_takes_signed_terms() {
    // A unit square with a slot cut into it from the right, traced once round: 1 - 0.2 * 0.5.
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
    // N odd, a node at the apex: the printed bound takes one segment of the lower half, which undoes the last cone.
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
    // Gain 0.6 and constant wall volume in the limit of fine meshes; N = 401 leaves 1e-5 or so of discretisation.
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

/// The circle of the appendix.
struct Circle {
    mu: f64,
    radius: f64,
    centre: f64,
}

/// Root of R mu^2 = (f/lambda) sin(mu/2) in (0, 2 pi), by bisection; radius and centre on the x axis.
fn circle(r: f64, f: f64) -> Circle {
    let (mut low, mut high) = (0.0, 2.0 * PI);
    for _ in 0..200 {
        let mu = 0.5 * (low + high);
        if r * mu * mu < f * (mu / 2.0).sin() {
            low = mu;
        } else {
            high = mu;
        }
    }
    let mu = 0.5 * (low + high);
    Circle {
        mu,
        radius: r / (mu / 2.0).sin(),
        centre: -r / (mu / 2.0).tan(),
    }
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
    // The other order of the two turns points elsewhere, so the order belongs to the convention.
    let other = [sin, -sin * cos, cos * cos];
    assert!((other[0] - 0.5f64).abs() > 0.1 && (other[1] + 0.5).abs() < 1e-15);
}
