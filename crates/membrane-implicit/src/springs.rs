//! The springs with mass and damping as one constant matrix, factored once for a step length.

use membrane_newton::BandMatrix;

/// L D L' of (m + h mu) I - h^2 K, K = dF_e/dc.
///
/// K does not mix x and y and is the same for both, so this is a symmetric positive definite
/// matrix of the moving nodes, with one diagonal on either side, or two with second neighbours;
/// x and y are solved side by side. Cost O(N), a tenth of the general band's.
#[derive(Debug, Clone)]
pub(crate) struct Springs {
    /// Per moving node: multipliers of the node before and of the one before that, and 1 / D.
    rows: Vec<[f64; 3]>,
    /// h for which `rows` stand, NaN before the first factorisation.
    factored: f64,
}

impl Springs {
    pub(crate) fn new(n_nodes: usize) -> Self {
        Self {
            rows: vec![[0.0; 3]; n_nodes - 2],
            factored: f64::NAN,
        }
    }

    /// Factors for `h` unless that is at hand; tells whether it was not. `diagonal` is m + h mu.
    pub(crate) fn factor(&mut self, elastic: &BandMatrix, diagonal: f64, h: f64) -> bool {
        if self.factored == h {
            return false;
        }
        let entry = |i: usize, j: usize| {
            let k = elastic.get(2 * i + 2, 2 * j + 2).unwrap_or(0.0);
            if i == j {
                diagonal - h * h * k
            } else {
                -h * h * k
            }
        };
        let (mut before, mut second) = ([0.0; 3], [0.0; 3]);
        let (mut d1, mut d2) = (1.0, 1.0);
        for (i, row) in self.rows.iter_mut().enumerate() {
            let two = if i > 1 {
                entry(i, i - 2) * second[2]
            } else {
                0.0
            };
            let one = if i > 0 {
                (entry(i, i - 1) - two * d2 * before[0]) * before[2]
            } else {
                0.0
            };
            let d = entry(i, i) - one * one * d1 - two * two * d2;
            *row = [one, two, 1.0 / d];
            (second, before) = (before, *row);
            (d2, d1) = (d1, d);
        }
        self.factored = h;
        true
    }

    /// Overwrites the moving nodes of `values` with the inverse times them; the ends become zero.
    pub(crate) fn solve_in_place(&self, values: &mut [f64]) {
        let points = values.as_chunks_mut::<2>().0;
        let last = points.len() - 1;
        (points[0], points[last]) = ([0.0; 2], [0.0; 2]);
        let inner = &mut points[1..last];
        let (mut one, mut two) = ([0.0; 2], [0.0; 2]);
        for (x, l) in inner.iter_mut().zip(&self.rows) {
            for k in 0..2 {
                // the value known last comes last
                x[k] = (x[k] - l[1] * two[k]) - l[0] * one[k];
            }
            (two, one) = (one, *x);
        }
        // multipliers of the two rows below
        let (mut one, mut two) = ([0.0; 2], [0.0; 2]);
        let (mut l1, mut l2, mut l2_next) = (0.0, 0.0, 0.0);
        for (x, l) in inner.iter_mut().zip(&self.rows).rev() {
            for k in 0..2 {
                x[k] = (x[k] * l[2] - l2 * two[k]) - l1 * one[k];
            }
            (two, one) = (one, *x);
            (l1, l2, l2_next) = (l[0], l2_next, l[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use membrane_newton::membrane_forces::FiniteDifferences;
    use membrane_newton::{Membrane, RestShape, Stiffness};

    /// The matrix times the solution gives the right-hand side back.
    #[test]
    fn solves_the_band() {
        for second in [false, true] {
            for n in [3, 4, 5, 6, 40] {
                let mut membrane = Membrane::new(RestShape::balloon(8.5, 1.75).unwrap())
                    .with_stiffness(Stiffness::function(|s| 1.0 + s, &[]).unwrap());
                if second {
                    let stiffness = Stiffness::function(|s| 0.3 + 0.2 * s, &[]).unwrap();
                    membrane = membrane.with_second_neighbours(stiffness);
                }
                let d = FiniteDifferences::new(&membrane, n).unwrap();
                let mut elastic = d.band();
                d.add_elastic_tangent_into(1.0, &mut elastic);
                let mut springs = Springs::new(n);
                let (diagonal, h) = (1.3, 0.4);
                assert!(springs.factor(&elastic, diagonal, h));
                assert!(!springs.factor(&elastic, diagonal, h));
                let b: Vec<f64> = (0..2 * n).map(|i| (i as f64 * 0.9).cos()).collect();
                let mut x = b.clone();
                springs.solve_in_place(&mut x);
                assert_eq!((&x[..2], &x[2 * n - 2..]), (&[0.0; 2][..], &[0.0; 2][..]));
                let mut product = vec![0.0; 2 * n];
                elastic.mul_into(&x, &mut product);
                for i in 2..2 * n - 2 {
                    let off = diagonal * x[i] - h * h * product[i] - b[i];
                    // rounding of terms of the size of b
                    assert!(off.abs() < 1e-13, "N {n}, second {second}: {off:e}");
                }
            }
        }
    }
}
