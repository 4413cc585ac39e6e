//! L D L' of a symmetric positive definite matrix with two diagonals on either side.

use membrane_newton::NewtonError;

/// Factors of a matrix that acts on x and y of points separately and equally, such as that of a chain of springs between neighbours and second
/// neighbours. Factoring and solving cost O(n), a tenth of a band matrix for x and y together.
#[derive(Debug, Clone)]
pub(crate) struct PentadiagonalLdl {
    /// Per row: multipliers of the row before and of the one before that, and 1 / D.
    rows: Vec<[f64; 3]>,
}

impl PentadiagonalLdl {
    /// Storage for matrices of `n` rows.
    pub(crate) fn new(n: usize) -> Self {
        Self {
            rows: vec![[0.0; 3]; n],
        }
    }

    /// Factors the matrix `entry(i, j)`, which is evaluated for j = i, i - 1 and i - 2.
    ///
    /// # Errors
    /// [`NewtonError::Singular`]: the matrix is not positive definite to working precision.
    pub(crate) fn factor(
        &mut self,
        entry: impl Fn(usize, usize) -> f64,
    ) -> Result<(), NewtonError> {
        let (mut before, mut second) = ([0.0; 3], [0.0; 3]);
        let (mut d1, mut d2) = (1.0, 1.0);
        for (row, out) in self.rows.iter_mut().enumerate() {
            let mut two = 0.0;
            if row > 1 {
                two = entry(row, row - 2) * second[2];
            }
            let mut one = 0.0;
            if row > 0 {
                one = (entry(row, row - 1) - two * d2 * before[0]) * before[2];
            }
            let pivot = entry(row, row) - one * one * d1 - two * two * d2;
            let inverse = 1.0 / pivot;
            if !(pivot > 0.0 && pivot.is_finite() && inverse.is_finite()) {
                return Err(NewtonError::Singular { row, pivot });
            }
            *out = [one, two, inverse];
            (second, before) = (before, *out);
            (d2, d1) = (d1, pivot);
        }
        Ok(())
    }

    /// Overwrites `points` with A^-1 times them, for the matrix A of the last factorisation.
    pub(crate) fn solve_into(&self, points: &mut [[f64; 2]]) {
        let (mut one, mut two) = ([0.0; 2], [0.0; 2]);
        for (x, l) in points.iter_mut().zip(&self.rows) {
            for k in 0..2 {
                // the value that is computed last is used last
                x[k] = (x[k] - l[1] * two[k]) - l[0] * one[k];
            }
            (two, one) = (one, *x);
        }
        // multipliers of the two rows below
        let (mut one, mut two) = ([0.0; 2], [0.0; 2]);
        let (mut l1, mut l2, mut l2_next) = (0.0, 0.0, 0.0);
        for (x, l) in points.iter_mut().zip(&self.rows).rev() {
            for k in 0..2 {
                x[k] = (x[k] * l[2] - l2 * two[k]) - l1 * one[k];
            }
            (two, one) = (one, *x);
            (l1, l2, l2_next) = (l[0], l2_next, l[1]);
        }
    }
}
