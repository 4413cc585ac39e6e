//! A square band matrix stored by rows, the storage of tangents.

use crate::error::{MembraneError, Result, at_most};

/// Square matrix with `lower` diagonals below and `upper` above the main one.
///
/// Row i is stored as columns i - lower ..= i + upper; entries outside the matrix stay zero.
///
/// ```
/// use membrane_forces::BandMatrix;
/// let mut a = BandMatrix::zeros(3, 1, 0)?;
/// a.add(2, 1, 5.0)?;
/// assert_eq!((a.get(2, 1), a.get(0, 2), a.get(3, 3)), (Some(5.0), Some(0.0), None));
/// assert_eq!(a.rows().collect::<Vec<_>>(), [[0.0, 0.0], [0.0, 0.0], [5.0, 0.0]]);
/// # Ok::<(), membrane_forces::MembraneError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BandMatrix {
    n: usize,
    lower: usize,
    upper: usize,
    data: Vec<f64>,
}

/// More than the tangent of the largest number of finite-difference nodes needs; 1.6 GB.
const MOST_NUMBERS: usize = 200_000_000;

impl BandMatrix {
    /// An n by n matrix of zeros.
    ///
    /// # Errors
    /// [`MembraneError::TooMany`] for more than 2e8 numbers, n (lower + upper + 1).
    pub fn zeros(n: usize, lower: usize, upper: usize) -> Result<Self> {
        let width = lower.saturating_add(upper).saturating_add(1);
        let given = n.max(1).saturating_mul(width);
        at_most("numbers in a band matrix", given, MOST_NUMBERS)?;
        Ok(Self::of_shape(n, lower, upper))
    }

    /// As [`BandMatrix::zeros`], for a shape that was checked.
    pub(crate) fn of_shape(n: usize, lower: usize, upper: usize) -> Self {
        Self {
            n,
            lower,
            upper,
            data: vec![0.0; n * (lower + upper + 1)],
        }
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether the matrix has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Diagonals below the main one.
    #[must_use]
    pub fn lower(&self) -> usize {
        self.lower
    }

    /// Diagonals above the main one.
    #[must_use]
    pub fn upper(&self) -> usize {
        self.upper
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// Sets the entries of row and column `k` to zero.
    pub(crate) fn clear_both(&mut self, k: usize) {
        let width = self.lower + self.upper + 1;
        self.data[k * width..(k + 1) * width].fill(0.0);
        for i in k.saturating_sub(self.upper)..self.n.min(k + self.lower + 1) {
            self.data[i * width + k + self.lower - i] = 0.0;
        }
    }

    /// Multiplies every entry by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.data.iter_mut().for_each(|value| *value *= factor);
    }

    /// The rows as stored, from the first to the last: columns i - lower ..= i + upper of row i.
    #[must_use = "iterators are lazy"]
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.data.chunks_exact(self.lower + self.upper + 1)
    }

    /// Entry (i, j): zero outside the band, `None` outside the matrix.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> Option<f64> {
        if i >= self.n || j >= self.n {
            return None;
        }
        Some(self.place(i, j).map_or(0.0, |at| self.data[at]))
    }

    /// Adds `value` to entry (i, j).
    ///
    /// # Errors
    /// [`MembraneError::OutsideBand`] for an entry outside the band or the matrix, which then is unchanged.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) -> Result<()> {
        match self.place(i, j) {
            Some(at) => {
                self.data[at] += value;
                Ok(())
            }
            None => Err(MembraneError::OutsideBand {
                row: i,
                column: j,
                n: self.n,
                lower: self.lower,
                upper: self.upper,
            }),
        }
    }

    /// Returns the index of entry (i, j) in memory.
    #[inline]
    fn place(&self, i: usize, j: usize) -> Option<usize> {
        let inside = i < self.n && j < self.n && j + self.lower >= i && j <= i + self.upper;
        inside.then(|| i * (self.lower + self.upper + 1) + j + self.lower - i)
    }

    /// As [`BandMatrix::add`], for an entry within the band.
    #[inline]
    pub(crate) fn add_inside(&mut self, i: usize, j: usize, value: f64) {
        self.data[i * (self.lower + self.upper + 1) + j + self.lower - i] += value;
    }

    /// `out` = A `x`. Cost O(n (lower + upper)).
    ///
    /// # Panics
    /// A vector whose length is not n.
    pub fn mul_into(&self, x: &[f64], out: &mut [f64]) {
        assert_eq!(
            (x.len(), out.len()),
            (self.n, self.n),
            "band matrix times vector"
        );
        // The bands of tangents, with and without second neighbours, have loops of fixed length.
        match (self.lower, self.upper) {
            (3, 3) => self.mul_inner::<3, 7>(x, out),
            (4, 4) => self.mul_inner::<4, 9>(x, out),
            _ => self.mul_rows(0..self.n, x, out),
        }
    }

    /// As [`Self::mul_rows`] over all rows, for `lower` = L and W diagonals in all.
    fn mul_inner<const L: usize, const W: usize>(&self, x: &[f64], out: &mut [f64]) {
        let last = (self.n + L).saturating_sub(W - 1).max(L).min(self.n);
        self.mul_rows(0..L.min(self.n), x, out);
        let (rows, _) = self.data.as_chunks::<W>();
        for (i, x) in (L..last).zip(x.windows(W)) {
            let mut sum = 0.0;
            for j in 0..W {
                sum += rows[i][j] * x[j];
            }
            out[i] = sum;
        }
        self.mul_rows(last..self.n, x, out);
    }

    fn mul_rows(&self, rows: std::ops::Range<usize>, x: &[f64], out: &mut [f64]) {
        let width = self.lower + self.upper + 1;
        for i in rows {
            let first = i.saturating_sub(self.lower);
            let last = (i + self.upper).min(self.n - 1);
            let row = &self.data[i * width..(i + 1) * width][first + self.lower - i..];
            out[i] = row.iter().zip(&x[first..=last]).map(|(a, x)| a * x).sum();
        }
    }
}
