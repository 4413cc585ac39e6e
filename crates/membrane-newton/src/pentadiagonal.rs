//! L D L' of a symmetric positive definite matrix with two diagonals on either side.

use crate::error::{NewtonError, Result, length, reciprocal};

/// Storage for A = L D L' of a matrix that acts on x and y of points separately and equally.
///
/// Chains of springs between neighbours and second neighbours have such a matrix. Factoring and solving cost O(n), a tenth of a band matrix
/// for x and y together.
///
/// ```
/// use membrane_newton::PentadiagonalLdl;
/// let mut ldl = PentadiagonalLdl::new(3);
/// // 2 on the diagonal, 1 beside it
/// ldl.factor(|i, j| match i - j { 0 => 2.0, 1 => 1.0, _ => 0.0 })?;
/// let mut points = [[3.0, 5.0], [4.0, 6.0], [3.0, 5.0]];
/// ldl.solve_into(&mut points)?;
/// for (point, exact) in points.iter().zip([[1.0, 2.0], [1.0, 1.0], [1.0, 2.0]]) {
///     assert!((point[0] - exact[0]).abs() < 1e-14 && (point[1] - exact[1]).abs() < 1e-14);
/// }
/// # Ok::<(), membrane_newton::NewtonError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PentadiagonalLdl {
    /// Per row: multipliers of the row before and of the one before that, and 1 / D.
    rows: Vec<[f64; 3]>,
    /// Whether the storage contains a factorisation.
    factored: bool,
}

impl PentadiagonalLdl {
    /// Storage for matrices of `n` rows; 0 is allowed.
    ///
    /// # Panics
    /// As `vec![[0.0; 3]; n]`: for more than `isize::MAX` bytes, which no allocation has.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            rows: vec![[0.0; 3]; n],
            factored: false,
        }
    }

    /// Factors the matrix `entry(i, j)`, which is evaluated for j = i, i - 1 and i - 2; after an error there is no factorisation.
    ///
    /// # Errors
    /// [`NewtonError::Singular`]: the matrix is not positive definite to working precision.
    pub fn factor(&mut self, entry: impl Fn(usize, usize) -> f64) -> Result<()> {
        self.factored = false;
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
            if d < 0.0 {
                return Err(NewtonError::Singular { row: i, pivot: d });
            }
            *row = [one, two, reciprocal(i, d)?];
            (second, before) = (before, *row);
            (d2, d1) = (d1, d);
        }
        self.factored = true;
        Ok(())
    }

    /// Overwrites `points` with A^-1 times them.
    ///
    /// # Errors
    /// [`NewtonError::NotFactored`]; [`NewtonError::WrongLength`] for other than n points.
    pub fn solve_into(&self, points: &mut [[f64; 2]]) -> Result<()> {
        length("points", points.len(), self.rows.len())?;
        if !self.factored {
            return Err(NewtonError::NotFactored);
        }
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
        Ok(())
    }
}
