//! One extra unknown and one extra equation, or a rank-one term, around any factorisation.

use membrane_forces::MembraneError;

use crate::error::{NewtonError, Result, reciprocal};

/// Solves the bordered system
///
/// ```text
/// [ A  b ] [x]   [r]
/// [ g' d ] [y] = [q]
/// ```
///
/// by block elimination from a factorisation of A: y = (q - g' A^-1 r) / (d - g' A^-1 b). A rank-one term is a border too: (A + b g') x = r
/// is the case d = -1, q = 0 (Sherman and Morrison 1950). Cost: one solve with A for b, then O(n) per right-hand side. If A is nearly singular,
/// x has a relative error of epsilon times the condition number of A, even if the bordered matrix is well conditioned; y is accurate.
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
/// let (b, g) = border.column_and_row_mut();
/// b.copy_from_slice(&[1.0, 0.0]);
/// g.copy_from_slice(&[0.0, 1.0]);
/// let mut x = [4.0, 8.0];
/// lu.solve_into(&mut x)?;
/// border.eliminate(-1.0, |column| lu.solve_into(column))?;
/// border.correct(&mut x, 0.0)?;
/// assert_eq!(x, [1.0, 2.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Border {
    /// b.
    column: Vec<f64>,
    /// g.
    row: Vec<f64>,
    /// A^-1 b.
    solved: Vec<f64>,
    /// d - g' A^-1 b, if known.
    pivot: Option<f64>,
}

impl Border {
    /// Creates a border of zeros for `n` unknowns, the length of the vectors that it corrects; 0 is allowed.
    ///
    /// # Panics
    /// As `vec![0.0; n]`: for more than `isize::MAX` bytes, of which no such vector exists.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            column: vec![0.0; n],
            row: vec![0.0; n],
            solved: vec![0.0; n],
            pivot: None,
        }
    }

    /// Returns the column b and the row g for writing; requires a new [`Border::eliminate`].
    pub fn column_and_row_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        self.pivot = None;
        (&mut self.column, &mut self.row)
    }

    /// Eliminates with the corner d and a function that overwrites a vector with A^-1 times it.
    ///
    /// # Errors
    /// Errors of `solve`; [`NewtonError::Singular`] for d - g' A^-1 b. The border is then not eliminated.
    pub fn eliminate(
        &mut self,
        corner: f64,
        solve: impl FnOnce(&mut [f64]) -> Result<()>,
    ) -> Result<()> {
        self.pivot = None;
        self.solved.copy_from_slice(&self.column);
        solve(&mut self.solved)?;
        let pivot = corner - dot_in_eight(&self.row, &self.solved);
        reciprocal(self.row.len(), pivot)?;
        self.pivot = Some(pivot);
        Ok(())
    }

    /// A^-1 b of the last elimination.
    #[must_use]
    pub fn solved(&self) -> &[f64] {
        &self.solved
    }

    /// Sign of the border's factor on the determinant, d - g' A^-1 b: 1 or -1; 0 if the border is not eliminated.
    #[must_use]
    pub fn sign(&self) -> f64 {
        self.pivot.map_or(0.0, f64::signum)
    }

    /// Turns `x` = A^-1 r into the solution's x and returns its y.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`](membrane_forces::MembraneError::WrongLength) if the lengths of `x` and border differ; [`NewtonError::NotFactored`] if column or row may have changed
    /// since the elimination, or if it failed.
    pub fn correct(&self, x: &mut [f64], q: f64) -> Result<f64> {
        MembraneError::length("unknowns within a border", x.len(), self.row.len())?;
        let pivot = self.pivot.ok_or(NewtonError::NotFactored)?;
        let y = (q - dot_in_eight(&self.row, x)) / pivot;
        for (x, solved) in x.iter_mut().zip(&self.solved) {
            *x -= y * solved;
        }
        Ok(y)
    }
}

/// Returns a . b over the shorter length with eight parallel sums: a single sum would wait for each addition.
#[must_use]
pub fn dot_in_eight(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (a[..n].as_chunks::<8>(), b[..n].as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + dot(a_rest, b_rest)
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
