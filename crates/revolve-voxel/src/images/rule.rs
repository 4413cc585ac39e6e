//! Gauss-Legendre rules on panels between the points where a function is not smooth.
//!
//! At the outline of a solid a line integral is the root of the distance. In the variable x of `u = middle + half (3 x - x^3) / 2` it is smooth at
//! both ends of the panel, so that the rule converges exponentially.

use std::sync::OnceLock;

/// Largest number of nodes of a rule; longer panels are divided.
const MOST: usize = 192;

/// Nodes and weights on [-1, 1].
type Nodes = Vec<[f64; 2]>;

/// Returns the Gauss-Legendre rule with `n` nodes, at most [`MOST`].
pub(super) fn gauss(n: usize) -> &'static [[f64; 2]] {
    static RULES: [OnceLock<Nodes>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
    RULES[n].get_or_init(|| (0..n).map(|k| node(n, k)).collect())
}

/// Node `k` of `n`, ascending, by Newton's method for the Legendre polynomial, and its weight.
fn node(n: usize, k: usize) -> [f64; 2] {
    let mut x = -(std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
    let mut slope = 1.0;
    for _ in 0..20 {
        let (mut before, mut value) = (0.0, 1.0);
        for degree in 0..n {
            let degree = degree as f64;
            let next = ((2.0 * degree + 1.0) * x * value - degree * before) / (degree + 1.0);
            (before, value) = (value, next);
        }
        slope = n as f64 * (x * value - before) / (x * x - 1.0);
        let step = value / slope;
        x -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    [x, 2.0 / ((1.0 - x * x) * slope * slope)]
}

/// How the integrand behaves at the ends of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    Smooth,
    /// As the root of the distance.
    Roots,
}

/// Appends the nodes and weights of a panel with about `n` nodes.
pub(super) fn add_panel([from, to]: [f64; 2], n: usize, ends: Ends, nodes: &mut Nodes) {
    let parts = n.div_ceil(MOST).max(1);
    let rule = gauss(n.div_ceil(parts).max(1));
    let part = (to - from) / parts as f64;
    for k in 0..parts {
        let (half, middle) = (0.5 * part, from + (k as f64 + 0.5) * part);
        nodes.extend(rule.iter().map(|&[x, weight]| match ends {
            Ends::Smooth => [middle + half * x, half * weight],
            Ends::Roots => {
                let slope = 1.5 * (1.0 - x * x);
                [
                    middle + half * (0.5 * x * (3.0 - x * x)),
                    half * weight * slope,
                ]
            }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_and_roots_are_integrated() {
        for n in [1, 2, 3, 8, 33, 100, 192] {
            let sum = |power: i32| -> f64 { gauss(n).iter().map(|[x, w]| w * x.powi(power)).sum() };
            let degree = 2 * n as i32 - 2;
            // Rounding of n terms.
            assert!((sum(0) - 2.0).abs() < 1e-13);
            assert!((sum(degree) - 2.0 / f64::from(degree + 1)).abs() < 1e-13);
            assert!(sum(1).abs() < 1e-13);
        }
        // A half circle over [1, 4]: the error falls by far more than 10 for 4 nodes more.
        let area = |n: usize| {
            let mut nodes = Nodes::new();
            add_panel([1.0, 4.0], n, Ends::Roots, &mut nodes);
            let height = |u: f64| ((u - 1.0) * (4.0 - u)).max(0.0).sqrt();
            nodes.iter().map(|[u, w]| w * height(*u)).sum::<f64>()
        };
        let exact = 0.5 * std::f64::consts::PI * 1.5 * 1.5;
        let errors = [4, 8, 12, 400].map(|n| (area(n) / exact - 1.0).abs());
        assert!(
            errors[1] < 0.02 * errors[0] && errors[2] < 0.02 * errors[1],
            "{errors:?}"
        );
        assert!(errors[3] < 1e-6, "{errors:?}");
    }
}
