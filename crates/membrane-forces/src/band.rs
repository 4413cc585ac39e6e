//! A square band matrix stored by rows: what tangents are written into.

/// Square matrix with `lower` diagonals below and `upper` above the main one.
///
/// Row i is stored as columns i - lower ..= i + upper; entries outside the matrix stay zero.
#[derive(Debug, Clone, PartialEq)]
pub struct BandMatrix {
    n: usize,
    lower: usize,
    upper: usize,
    data: Vec<f64>,
}

impl BandMatrix {
    /// An n by n matrix of zeros.
    ///
    /// # Panics
    /// Memory does not hold n (lower + upper + 1) numbers.
    pub fn zeros(n: usize, lower: usize, upper: usize) -> Self {
        let width = lower.saturating_add(upper).saturating_add(1);
        Self {
            n,
            lower,
            upper,
            data: vec![0.0; n.saturating_mul(width)],
        }
    }

    /// Number of rows and columns.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether the matrix has no rows.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Diagonals below the main one.
    pub fn lower(&self) -> usize {
        self.lower
    }

    /// Diagonals above the main one.
    pub fn upper(&self) -> usize {
        self.upper
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// Row `i` as stored: columns i - lower ..= i + upper.
    ///
    /// # Panics
    /// `i` outside the matrix.
    pub fn row(&self, i: usize) -> &[f64] {
        let width = self.lower + self.upper + 1;
        &self.data[i * width..(i + 1) * width]
    }

    /// Entry (i, j); zero outside the band.
    ///
    /// # Panics
    /// `i` outside the matrix.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        if j + self.lower < i || j > i + self.upper {
            0.0
        } else {
            self.row(i)[j + self.lower - i]
        }
    }

    /// Adds `value` to entry (i, j).
    ///
    /// # Panics
    /// (i, j) outside the band.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        assert!(
            i < self.n && j + self.lower >= i && j <= i + self.upper,
            "entry outside the band"
        );
        self.data[i * (self.lower + self.upper + 1) + j + self.lower - i] += value;
    }

    /// `out` = A `x`. Cost O(n (lower + upper)).
    ///
    /// # Panics
    /// A length that is not n.
    pub fn mul_into(&self, x: &[f64], out: &mut [f64]) {
        assert_eq!(
            (x.len(), out.len()),
            (self.n, self.n),
            "band matrix times vector"
        );
        // The tangents' bands, with and without second neighbours, get loops of fixed length.
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
        for i in rows {
            let first = i.saturating_sub(self.lower);
            let last = (i + self.upper).min(self.n - 1);
            let row = &self.row(i)[first + self.lower - i..];
            out[i] = row.iter().zip(&x[first..=last]).map(|(a, x)| a * x).sum();
        }
    }
}
