//! One extra unknown and one extra equation, or a rank-one term, around any factorisation.

use crate::error::NewtonError;

/// Solves the bordered system
///
/// ```text
/// [ A  b ] [x]   [r]
/// [ g' d ] [y] = [q]
/// ```
///
/// by block elimination from a factorisation of A: y = (q - g' A^-1 r) / (d - g' A^-1 b).
/// A rank-one term is a border too: (A + b g') x = r is the case d = -1, q = 0
/// (Sherman and Morrison 1950). Cost: one solve with A for b, then O(n) a right-hand side.
///
/// ```
/// use membrane_newton::{BandMatrix, BandedLu, Border};
/// let mut a = BandMatrix::zeros(2, 1, 1)?;
/// a.add(0, 0, 2.0)?;
/// a.add(1, 1, 4.0)?;
/// let mut lu = BandedLu::for_matrix(&a);
/// lu.factor(&a)?;
/// // (A + b g') x = r with b = (1, 0), g = (0, 1): 2 x0 + x1 = 4, 4 x1 = 8
/// let mut border = Border::new(2);
/// border.column.copy_from_slice(&[1.0, 0.0]);
/// border.row.copy_from_slice(&[0.0, 1.0]);
/// border.eliminate(-1.0, |column| lu.solve_into(column))?;
/// let mut x = [4.0, 8.0];
/// lu.solve_into(&mut x);
/// border.correct(&mut x, 0.0);
/// assert_eq!(x, [1.0, 2.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Border {
    /// b before [`Border::eliminate`], A^-1 b after it.
    pub column: Vec<f64>,
    /// g.
    pub row: Vec<f64>,
    pivot: f64,
}

impl Border {
    /// A border of zeros for `n` unknowns.
    pub fn new(n: usize) -> Self {
        Self {
            column: vec![0.0; n],
            row: vec![0.0; n],
            pivot: 0.0,
        }
    }

    /// Takes the corner d and a way to overwrite a vector with A^-1 times it; call after `column`
    /// and `row` are set.
    ///
    /// # Errors
    /// The bordered matrix is singular to working precision.
    pub fn eliminate(
        &mut self,
        corner: f64,
        solve: impl FnOnce(&mut [f64]),
    ) -> Result<(), NewtonError> {
        solve(&mut self.column);
        self.pivot = corner - dot(&self.row, &self.column);
        if self.pivot == 0.0 || !self.pivot.is_finite() {
            return Err(NewtonError::Singular {
                row: self.row.len(),
                pivot: self.pivot,
            });
        }
        Ok(())
    }

    /// Sign of what the border multiplies the determinant by, d - g' A^-1 b: 1 or -1.
    pub(crate) fn sign(&self) -> f64 {
        self.pivot.signum()
    }

    /// Turns `x` = A^-1 r into the solution's x and returns its y.
    pub fn correct(&self, x: &mut [f64], q: f64) -> f64 {
        let y = (q - dot(&self.row, x)) / self.pivot;
        for (x, column) in x.iter_mut().zip(&self.column) {
            *x -= y * column;
        }
        y
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
