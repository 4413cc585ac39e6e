//! Correlated draws with a Gaussian copula; the marginal distributions do not change.

use crate::quantile::{normal_quantile, normal_share};
use serde::{Deserialize, Serialize};

/// Smallest squared diagonal entry of the factor; below it the correlation matrix is singular to rounding.
const LEAST_PIVOT: f64 = 1e-12;

/// The correlation of two fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Correlation {
    /// Two varied fields.
    pub(crate) fields: [String; 2],
    /// Correlation coefficient of the normal scores, between -1 and 1: Pearson's coefficient for two normal distributions without
    /// bounds.
    pub(crate) coefficient: f64,
}

/// Lower triangular (Cholesky) factor L of the correlation matrix, `L L' = R`, over the correlated coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Copula {
    coordinates: Vec<usize>,
    factor: Vec<Vec<f64>>,
}

impl Copula {
    /// Returns the copula of pairs of coordinates with coefficients; `None` if the matrix is not positive definite.
    pub(crate) fn new(pairs: &[([usize; 2], f64)]) -> Option<Self> {
        let mut coordinates: Vec<usize> = pairs.iter().flat_map(|(pair, _)| *pair).collect();
        coordinates.sort_unstable();
        coordinates.dedup();
        let n = coordinates.len();
        let entry = |i: usize, j: usize| {
            let of = |&&([a, b], _): &&([usize; 2], f64)| {
                [a, b] == [coordinates[i], coordinates[j]]
                    || [b, a] == [coordinates[i], coordinates[j]]
            };
            pairs
                .iter()
                .find(of)
                .map_or(0.0, |(_, coefficient)| *coefficient)
        };
        let mut factor = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                if i > j {
                    factor[i][j] = (entry(i, j) - sum) / factor[j][j];
                    continue;
                }
                if 1.0 - sum < LEAST_PIVOT {
                    return None;
                }
                factor[i][i] = (1.0 - sum).sqrt();
            }
        }
        Some(Self {
            coordinates,
            factor,
        })
    }

    /// Correlates a point of the unit cube: the normal scores z become L z.
    pub(crate) fn apply(&self, point: &mut [f64]) {
        let score = |u: f64| normal_quantile(u.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON));
        let scores: Vec<f64> = (self.coordinates.iter())
            .map(|&d| score(point[d]))
            .collect();
        for (&d, row) in self.coordinates.iter().zip(&self.factor) {
            point[d] = normal_share(row.iter().zip(&scores).map(|(l, z)| l * z).sum());
        }
    }
}
