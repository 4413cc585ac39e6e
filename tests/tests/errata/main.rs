//! The misprints of Rohmer et al. 2006 (hal-03929238), row by row of `docs/theory.md`: the printed formula fails, the corrected one passes.
//!
//! Nothing here calls the crates: the formulas are implemented as printed and as corrected on an independent discretisation. The tests of
//! the crates check that they use the corrected ones.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod measures;
mod membrane;
mod motion;

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use std::f64::consts::PI;

type Curve = Vec<Vector2<f64>>;

const H: f64 = 8.5;
const INNER: f64 = 1.75;
const OUTER: f64 = 2.75;

/// `n` equally spaced nodes of the reference configuration: cylinder of length `h`, half circle of radius `r`, back.
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

/// The straight line from (0, r) to (0, -r): the reference configuration of the appendix.
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

/// Eq. 14 as derived from the pressure: it depends on c(n+1) - c(n-1) only, so the two are opposite.
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

/// Newton's method from the reference configuration with a fixed f; the imbalance before each step and after the last.
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
    // 1/ds^2 is up to 1.6e5 here and lengths are about 10: the rounding error is 1e-16 * 10 * 1.6e5.
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
