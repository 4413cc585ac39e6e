//! A dense matrix as an operator for the iterative solvers, and random numbers.

use super::noise;
use radon::{LinearOperator, RadonError, Stopping};

/// A dense matrix.
pub(crate) struct Dense(pub(crate) Vec<Vec<f64>>);

impl LinearOperator<f64> for Dense {
    fn image_len(&self) -> usize {
        self.0[0].len()
    }
    fn data_len(&self) -> usize {
        self.0.len()
    }
    fn forward_into(&self, x: &[f64], y: &mut [f64]) -> Result<(), RadonError> {
        for (y, row) in y.iter_mut().zip(&self.0) {
            *y = dot(row, x);
        }
        Ok(())
    }
    fn adjoint_into(&self, y: &[f64], x: &mut [f64]) -> Result<(), RadonError> {
        for (j, x) in x.iter_mut().enumerate() {
            *x = self.0.iter().zip(y).map(|(row, y)| row[j] * y).sum();
        }
        Ok(())
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Entries in [0, 1).
pub(crate) fn not_negative(rows: usize, columns: usize, seed: u64) -> Dense {
    let row = |i| {
        noise::<f64>(columns, seed + i as u64)
            .iter()
            .map(|x| 0.5 + 0.5 * x)
            .collect()
    };
    Dense((0..rows).map(row).collect())
}

/// A number of steps without a stopping rule.
pub(crate) fn many(max_iterations: usize) -> Stopping {
    Stopping::default().with_max_iterations(max_iterations)
}
