//! LU factorisation of a band matrix with partial pivoting, in place and reusable.

use membrane_forces::{BandMatrix, MembraneError};

use crate::error::{NewtonError, Result, reciprocal};

/// Storage for P A = L U of a band matrix; memory and time O(n lower (lower + upper)).
///
/// It factors any number of matrices of its shape without allocation.
///
/// ```
/// use membrane_newton::{BandMatrix, BandedLu};
/// let mut a = BandMatrix::zeros(3, 1, 1)?;
/// for i in 0..3 {
///     a.add(i, i, 2.0)?;
/// }
/// a.add(0, 1, 1.0)?;
/// let mut lu = BandedLu::for_matrix(&a);
/// let mut x = [5.0, 4.0, 6.0];
/// lu.factor(&a)?;
/// lu.solve_into(&mut x)?;
/// assert_eq!(x, [1.5, 2.0, 3.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BandedLu {
    n: usize,
    lower: usize,
    /// Row i contains columns i ..= i + width - 1 of U (pivoting widens U to lower + upper).
    width: usize,
    u: Vec<f64>,
    /// Column k of L below its diagonal: `lower` multipliers.
    l: Vec<f64>,
    pivots: Vec<u32>,
    /// Whether the storage contains a factorisation.
    factored: bool,
    /// Whether any pivot lies off the diagonal.
    swapped: bool,
    /// Whether the determinant is negative.
    negative: bool,
    /// Reciprocals of the diagonal of U.
    inverse: Vec<f64>,
}

impl BandedLu {
    /// Allocates storage for matrices of the shape of `matrix`: n (2 lower + upper + 3) numbers.
    #[must_use]
    pub fn for_matrix(matrix: &BandMatrix) -> Self {
        let (n, lower) = (matrix.len(), matrix.lower());
        let width = lower + matrix.upper() + 1;
        Self {
            n,
            lower,
            width,
            u: vec![0.0; n * width],
            l: vec![0.0; n * lower],
            pivots: vec![0; n],
            factored: false,
            swapped: false,
            negative: false,
            inverse: vec![0.0; n],
        }
    }

    /// Factors `matrix`; after an error there is no factorisation.
    ///
    /// # Errors
    /// [`NewtonError::Singular`] for a pivot that is zero or not finite, or whose reciprocal overflows; by rounding the pivots of a singular matrix
    /// may be nonzero, and it is then factored. [`MembraneError::WrongLength`](membrane_forces::MembraneError::WrongLength) if the shapes of `matrix` and storage differ.
    pub fn factor(&mut self, matrix: &BandMatrix) -> Result<()> {
        self.factored = false;
        let (n, lower, width) = (self.n, self.lower, self.width);
        MembraneError::length("rows", matrix.len(), n)?;
        MembraneError::length("diagonals below the main one", matrix.lower(), lower)?;
        let above = width - lower - 1;
        MembraneError::length("diagonals above the main one", matrix.upper(), above)?;
        // Each row starts at its first column: rows above `lower` are shifted left so that row i
        // always begins at column max(i, lower) - lower, the first column still to be eliminated.
        let rows = self.u.chunks_exact_mut(width).zip(matrix.rows());
        for (i, (row, from)) in rows.enumerate() {
            let skip = lower.saturating_sub(i);
            row[..width - skip].copy_from_slice(&from[skip..]);
            row[width - skip..].fill(0.0);
        }
        self.swapped = false;
        self.negative = false;
        for k in 0..n {
            let last = (k + lower).min(n - 1);
            let mut pivot = k;
            for i in k + 1..=last {
                if self.u[i * width].abs() > self.u[pivot * width].abs() {
                    pivot = i;
                }
            }
            let value = self.u[pivot * width];
            let inverse = reciprocal(k, value)?;
            self.pivots[k] = pivot as u32;
            self.negative ^= (value < 0.0) ^ (pivot != k);
            let (above, below) = self.u.split_at_mut((k + 1) * width);
            let upper = &mut above[k * width..];
            if pivot != k {
                self.swapped = true;
                upper.swap_with_slice(&mut below[(pivot - k - 1) * width..(pivot - k) * width]);
            }
            self.inverse[k] = inverse;
            for (i, row) in below.chunks_exact_mut(width).take(last - k).enumerate() {
                let factor = row[0] * inverse;
                self.l[k * lower + i] = factor;
                // Subtract and shift left: the row now begins at column k + 1.
                for j in 1..width {
                    row[j - 1] = row[j] - factor * upper[j];
                }
                row[width - 1] = 0.0;
            }
        }
        self.factored = true;
        Ok(())
    }

    /// Returns the sign of the determinant of the matrix, 1 or -1; 0 without a factorisation.
    #[must_use]
    pub fn determinant_sign(&self) -> f64 {
        match (self.factored, self.negative) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => -1.0,
        }
    }

    /// Overwrites `b` with A^-1 `b` for the matrix A of the last factorisation. Cost O(n (2 lower + upper)).
    ///
    /// # Errors
    /// [`NewtonError::NotFactored`]; [`MembraneError::WrongLength`](membrane_forces::MembraneError::WrongLength) for other than n numbers.
    pub fn solve_into(&self, b: &mut [f64]) -> Result<()> {
        MembraneError::length("right-hand side", b.len(), self.n)?;
        if !self.factored {
            return Err(NewtonError::NotFactored);
        }
        // The bands of tangents, with and without second neighbours, have loops of fixed length.
        match (self.lower, self.width) {
            (3, 7) => self.solve::<3, 7>(b),
            (4, 9) => self.solve::<4, 9>(b),
            _ => self.solve_any(b, 0, self.n),
        }
        Ok(())
    }

    /// As [`Self::solve_any`], for `lower` = L and `width` = W.
    fn solve<const L: usize, const W: usize>(&self, b: &mut [f64]) {
        let inner = self.n.saturating_sub(W);
        let (l, _) = self.l.as_chunks::<L>();
        let (u, _) = self.u.as_chunks::<W>();
        for (k, l) in l[..inner].iter().enumerate() {
            if self.swapped {
                b.swap(k, self.pivots[k] as usize);
            }
            let value = b[k];
            if let Some(below) = b[k + 1..].first_chunk_mut::<L>() {
                for i in 0..L {
                    below[i] -= l[i] * value;
                }
            }
        }
        self.solve_any(b, inner, self.n);
        for (k, u) in u[..inner].iter().enumerate().rev() {
            if let Some(x) = b[k..].first_chunk_mut::<W>() {
                // distant entries first: the nearest one is computed last
                let mut value = x[0];
                for j in (1..W).rev() {
                    value -= u[j] * x[j];
                }
                x[0] = value * self.inverse[k];
            }
        }
    }

    /// Eliminates below and substitutes back within rows `from .. to`, the last ones of b.
    fn solve_any(&self, b: &mut [f64], from: usize, to: usize) {
        let (lower, width) = (self.lower, self.width);
        for k in from..to {
            b.swap(k, self.pivots[k] as usize);
            let (head, tail) = b.split_at_mut(k + 1);
            let value = head[k];
            for (b, l) in tail.iter_mut().zip(&self.l[k * lower..(k + 1) * lower]) {
                *b -= l * value;
            }
        }
        for k in (from..to).rev() {
            let row = &self.u[k * width..(k + 1) * width];
            let end = (k + width).min(to);
            let sum: f64 = row[1..]
                .iter()
                .zip(&b[k + 1..end])
                .map(|(u, x)| u * x)
                .sum();
            b[k] = (b[k] - sum) * self.inverse[k];
        }
    }
}
