//! Correlated draws with a Gaussian copula; the marginal distributions do not change.

use crate::quantile::{normal_quantile, normal_share};
use heart_phantom::revolve_voxel::nalgebra::{Cholesky, DMatrix};
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
    factor: DMatrix<f64>,
}

impl Copula {
    /// Returns the copula of pairs of coordinates with coefficients; `None` if the matrix is not positive definite.
    pub(crate) fn new(pairs: &[([usize; 2], f64)]) -> Option<Self> {
        let mut coordinates: Vec<usize> = pairs.iter().flat_map(|(pair, _)| *pair).collect();
        coordinates.sort_unstable();
        coordinates.dedup();
        let mut matrix = DMatrix::identity(coordinates.len(), coordinates.len());
        for (pair, coefficient) in pairs {
            let [i, j] = pair.map(|d| coordinates.partition_point(|&other| other < d));
            (matrix[(i, j)], matrix[(j, i)]) = (*coefficient, *coefficient);
        }
        let factor = Cholesky::new(matrix)?.unpack();
        let is_regular = (factor.diagonal().iter()).all(|entry| entry * entry >= LEAST_PIVOT);
        is_regular.then_some(Self {
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
        for (&d, row) in self.coordinates.iter().zip(self.factor.row_iter()) {
            point[d] = normal_share(row.iter().zip(&scores).map(|(l, z)| l * z).sum());
        }
    }
}
