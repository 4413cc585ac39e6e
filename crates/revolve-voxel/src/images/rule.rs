//! Gauss-Legendre rules on panels between the points where a function is not smooth.

use std::sync::OnceLock;

/// Largest number of nodes of a rule; longer panels have several rules.
const MOST: usize = 192;
/// Smallest number of nodes of an evenly spaced rule: with fewer, a Gauss-Legendre rule is more accurate.
const EVEN: usize = 12;

/// Returns the Gauss-Legendre rule with `n` nodes, at most [`MOST`]: nodes and weights on [-1, 1], ascending.
pub(crate) fn gauss(n: usize) -> &'static [[f64; 2]] {
    static RULES: [OnceLock<Vec<[f64; 2]>>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
    RULES[n].get_or_init(|| (0..n).map(|k| node(n, k)).collect())
}

/// Node `k` of `n`, by Newton's method for the Legendre polynomial, and its weight.
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

/// Returns the Gauss-Legendre rule with `n` nodes, at most [`MOST`]; from [`EVEN`] nodes on, transformed by the Taylor polynomial of degree 9 of
/// `arcsin`, scaled to [-1, 1] (Hale and Trefethen, SIAM J. Numer. Anal. 46 (2008) 930, section 3). In the middle the distance of the nodes is
/// 0.76 of that of the Gauss-Legendre rule, so that fewer nodes resolve a function of one scale.
fn even(n: usize) -> &'static [[f64; 2]] {
    static RULES: [OnceLock<Vec<[f64; 2]>>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
    if n < EVEN {
        return gauss(n);
    }
    let moved = |[x, weight]: &[f64; 2]| {
        let (value, slope) = arcsin(*x);
        [value * x, slope * weight]
    };
    RULES[n].get_or_init(|| gauss(n).iter().map(moved).collect())
}

/// The Taylor polynomial of degree 9 of `arcsin`, scaled to be 1 at 1: its value over x, and its derivative.
fn arcsin(x: f64) -> (f64, f64) {
    const TERMS: [f64; 5] = [1.0, 1.0 / 6.0, 3.0 / 40.0, 5.0 / 112.0, 35.0 / 1152.0];
    let of = |factor: &dyn Fn(usize) -> f64| {
        let sum = TERMS.iter().enumerate().rev();
        sum.fold(0.0, |sum, (k, term)| sum * x * x + factor(k) * term)
    };
    let scale = TERMS.iter().sum::<f64>();
    (of(&|_| 1.0) / scale, of(&|k| (2 * k + 1) as f64) / scale)
}

/// Returns nodes and weights on [-1, 1]: about `n` of them, in rules on equal parts.
fn composite(n: usize) -> Vec<[f64; 2]> {
    let parts = n.div_ceil(MOST).max(1);
    let rule = even(n.div_ceil(parts).max(1));
    let half = 1.0 / parts as f64;
    let middle = |part: usize| (2 * part + 1) as f64 * half - 1.0;
    (0..parts)
        .flat_map(|part| {
            rule.iter()
                .map(move |[x, w]| [middle(part) + half * x, half * w])
        })
        .collect()
}

/// The behaviour of an integrand at the ends of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    Smooth,
    /// Like the root of the distance. It is smooth in the variable x of `u = middle + half (3 x - x^3) / 2`.
    Roots,
}

/// A panel with the nodes of the quadrature: `fine` nodes resolve the weights of the bins. The values of the integrand are computed at `own`
/// nodes and interpolated, where these resolve it.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    pub(super) ends: [f64; 2],
    kind: Ends,
    fine: usize,
    own: usize,
}

impl Panel {
    /// The integrand needs `own` nodes; values are interpolated from these if there are fewer of them than fine ones.
    pub(super) fn new(ends: [f64; 2], kind: Ends, fine: usize, own: usize) -> Self {
        let own = match own < fine {
            true => own.min(MOST),
            false => fine,
        };
        Self {
            ends,
            kind,
            fine,
            own,
        }
    }

    /// Returns position and weight of a node on [-1, 1].
    fn place(&self, [x, weight]: [f64; 2]) -> [f64; 2] {
        let [from, to] = self.ends;
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        match self.kind {
            Ends::Smooth => [middle + half * x, half * weight],
            Ends::Roots => [
                middle + half * (0.5 * x * (3.0 - x * x)),
                half * weight * 1.5 * (1.0 - x * x),
            ],
        }
    }

    /// Whether values are interpolated.
    pub(super) fn interpolates(&self) -> bool {
        self.own < self.fine
    }

    /// Returns the numbers of own and of fine nodes.
    pub(super) fn sizes(&self) -> [usize; 2] {
        [self.own, self.fine]
    }

    /// Returns the positions at which the integrand is computed.
    pub(super) fn positions(&self) -> Vec<f64> {
        let nodes = match self.interpolates() {
            true => gauss(self.own).to_vec(),
            false => composite(self.fine),
        };
        nodes.into_iter().map(|node| self.place(node)[0]).collect()
    }

    /// Returns positions and weights of the quadrature.
    pub(super) fn nodes(&self) -> Vec<[f64; 2]> {
        composite(self.fine)
            .into_iter()
            .map(|node| self.place(node))
            .collect()
    }

    /// Returns the weights `[node][position]` of the polynomial through the values at the positions, at the nodes.
    pub(super) fn interpolation(&self) -> Vec<f64> {
        let own = gauss(self.own);
        // The barycentric formula for Legendre points (Berrut and Trefethen, SIAM Rev. 46 (2004) 501, section 5; Wang and Xiang, Math.
        // Comput. 81 (2012) 861, Eq. 3.2).
        let factor = |(k, [x, weight]): (usize, &[f64; 2])| {
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            sign * ((1.0 - x * x) * weight).sqrt()
        };
        let factors: Vec<f64> = own.iter().enumerate().map(factor).collect();
        let mut matrix = Vec::with_capacity(self.fine * own.len());
        for [at, _] in composite(self.fine) {
            if let Some(hit) = own.iter().position(|[x, _]| *x == at) {
                matrix.extend((0..own.len()).map(|k| f64::from(u8::from(k == hit))));
                continue;
            }
            let start = matrix.len();
            matrix.extend(
                factors
                    .iter()
                    .zip(own)
                    .map(|(factor, [x, _])| factor / (at - x)),
            );
            let sum: f64 = matrix[start..].iter().sum();
            matrix[start..].iter_mut().for_each(|weight| *weight /= sum);
        }
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nineteen Gaussians with the width of a bin, like those of the bins of a row.
    #[test]
    fn evenly_spaced_nodes_resolve_a_scale_with_fewer() {
        let sigma: f64 = 1.0 / 40.0;
        let error = |rule: &[[f64; 2]]| {
            let middles = (-9..=9).map(|k| f64::from(k) / 10.0);
            let sum = |at: f64| -> f64 {
                let bell = |[x, w]: &[f64; 2]| w * (-0.5 * ((x - at) / sigma).powi(2)).exp();
                rule.iter().map(bell).sum()
            };
            let exact = sigma * std::f64::consts::TAU.sqrt();
            middles
                .map(|at| (sum(at) / exact - 1.0).abs())
                .fold(0.0, f64::max)
        };
        // The error of a lattice of the step h is 2 exp(-2 (pi sigma / h)^2); in the middle h is pi / n, and 0.76 of that.
        let [gauss, even] = [gauss(64), even(64)].map(error);
        assert!(gauss > 1e-2 && even < 3e-4, "{gauss} {even}");
    }
}
