//! Static condensation: the tangent of spectral elements, factored element by element.

use membrane_forces::{BandMatrix, SpectralElements};

use crate::banded::BandedLu;
use crate::error::NewtonError;

/// Factorisation of the assembled tangent of [`SpectralElements`].
///
/// The interior nodes of an element see only their own element: they are eliminated first by a
/// dense LU that stops before the element's two end nodes and leaves their 4 by 4 Schur
/// complement in its last corner. What remains couples neighbouring end nodes only and is a band
/// matrix. Cost O(elements p^3) to factor, O(elements p^2) to solve, no allocation after set-up.
#[derive(Debug, Clone)]
pub(crate) struct CondensedLu {
    /// Unknowns of an element: interior first, then its two ends.
    size: usize,
    interior: usize,
    local: Vec<Vec<f64>>,
    pivots: Vec<Vec<u32>>,
    ends: BandMatrix,
    lu: BandedLu,
    /// Whether the numbers are those of a tangent that could be factored.
    factored: bool,
    held: [[bool; 2]; 2],
    end_values: Vec<f64>,
    scratch: Vec<f64>,
}

impl CondensedLu {
    pub(crate) fn new(elements: &SpectralElements) -> Self {
        let (count, p) = (elements.n_elements(), elements.degree());
        let (size, interior) = (2 * (p + 1), 2 * (p - 1));
        #[expect(
            clippy::expect_used,
            reason = "`SpectralElements` allows a third of the elements for which this would be too large"
        )]
        let ends = BandMatrix::zeros(2 * (count + 1), 3, 3).expect("few elements");
        Self {
            size,
            interior,
            local: vec![vec![0.0; size * size]; count],
            pivots: vec![vec![0; interior]; count],
            lu: BandedLu::for_matrix(&ends),
            factored: false,
            ends,
            held: elements.held(),
            end_values: vec![0.0; 2 * (count + 1)],
            scratch: vec![0.0; size],
        }
    }

    /// Computes and factors the tangent at `nodes`. Returns the sign of its determinant (its rows and columns are
    /// reordered alike, which does not change it).
    pub(crate) fn factor(
        &mut self,
        elements: &SpectralElements,
        nodes: &[f64],
        intensity: f64,
    ) -> Result<f64, NewtonError> {
        self.factored = false;
        self.ends.clear();
        let mut sign = 1.0;
        let (size, interior) = (self.size, self.interior);
        for e in 0..elements.n_elements() {
            let local = &mut self.local[e];
            elements.element_tangent_into(e, nodes, intensity, local)?;
            sign *= eliminate(local, size, interior, &mut self.pivots[e])?;
            for i in 0..4 {
                let row = 2 * e + i;
                if self.is_held(row) {
                    continue;
                }
                for j in 0..4 {
                    let value = self.local[e][(interior + i) * size + interior + j];
                    self.ends.add(row, 2 * e + j, value)?;
                }
            }
        }
        for row in 0..self.ends.len() {
            if self.is_held(row) {
                self.ends.add(row, row, 1.0)?;
            }
        }
        sign *= self.lu.factor(&self.ends)?.determinant_sign();
        self.factored = true;
        Ok(sign)
    }

    fn is_held(&self, row: usize) -> bool {
        let last = self.ends.len() - 2;
        (row < 2 && self.held[0][row]) || (row >= last && self.held[1][row - last])
    }

    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        let lu = self.lu.factored().filter(|_| self.factored);
        let lu = lu.ok_or(NewtonError::NotFactored)?;
        let (size, interior) = (self.size, self.interior);
        let stride = size - 2;
        let count = self.local.len();
        for e in 0..=count {
            self.end_values[2 * e..2 * e + 2].copy_from_slice(&rhs[e * stride..e * stride + 2]);
        }
        for e in 0..count {
            let local = &self.local[e];
            let inside = &mut rhs[e * stride + 2..e * stride + 2 + interior];
            for k in 0..interior {
                inside.swap(k, self.pivots[e][k] as usize);
                // row k of L is complete: its multipliers stand left of the diagonal
                let row = &local[k * size..k * size + k];
                let sum: f64 = row.iter().zip(inside.iter()).map(|(l, b)| l * b).sum();
                inside[k] -= sum;
            }
            for i in 0..4 {
                let row = 2 * e + i;
                if !self.is_held(row) {
                    let l = &local[(interior + i) * size..][..interior];
                    let sum: f64 = l.iter().zip(inside.iter()).map(|(l, b)| l * b).sum();
                    self.end_values[row] -= sum;
                }
            }
        }
        lu.solve_into(&mut self.end_values);
        for e in 0..count {
            let local = &self.local[e];
            let full = &mut self.scratch;
            full[interior..].copy_from_slice(&self.end_values[2 * e..2 * e + 4]);
            let inside = &mut rhs[e * stride + 2..e * stride + 2 + interior];
            for k in (0..interior).rev() {
                let row = &local[k * size..(k + 1) * size];
                let sum: f64 = row[k + 1..]
                    .iter()
                    .zip(&full[k + 1..])
                    .map(|(u, x)| u * x)
                    .sum();
                full[k] = (inside[k] - sum) / row[k];
            }
            inside.copy_from_slice(&full[..interior]);
        }
        for e in 0..=count {
            rhs[e * stride..e * stride + 2].copy_from_slice(&self.end_values[2 * e..2 * e + 2]);
        }
        Ok(())
    }
}

/// Eliminates the first `interior` columns of the `size` by `size` matrix, pivoting among its
/// first `interior` rows; L, U and the Schur complement overwrite it. Returns the sign of the
/// product of the pivots, row swaps counted.
fn eliminate(
    a: &mut [f64],
    size: usize,
    interior: usize,
    pivots: &mut [u32],
) -> Result<f64, NewtonError> {
    let mut sign = 1.0;
    for k in 0..interior {
        let mut pivot = k;
        for i in k + 1..interior {
            if a[i * size + k].abs() > a[pivot * size + k].abs() {
                pivot = i;
            }
        }
        let value = a[pivot * size + k];
        if value == 0.0 || !value.is_finite() {
            return Err(NewtonError::Singular {
                row: k,
                pivot: value,
            });
        }
        pivots[k] = pivot as u32;
        sign *= if (value < 0.0) ^ (pivot != k) {
            -1.0
        } else {
            1.0
        };
        let (above, below) = a.split_at_mut((k + 1) * size);
        let upper = &mut above[k * size..];
        if pivot != k {
            upper.swap_with_slice(&mut below[(pivot - k - 1) * size..(pivot - k) * size]);
        }
        let inverse = 1.0 / upper[k];
        for row in below.chunks_exact_mut(size) {
            let factor = row[k] * inverse;
            row[k] = factor;
            for (x, u) in row[k + 1..].iter_mut().zip(&upper[k + 1..]) {
                *x -= factor * u;
            }
        }
    }
    Ok(sign)
}

#[cfg(test)]
mod tests {
    use super::*;
    use membrane_forces::{Membrane, PressureLaw, RestShape, Stiffness};
    use nalgebra::{DMatrix, DVector};

    /// The tangent as one dense matrix: element tangents added where their nodes are, unit rows
    /// where the curve is held.
    fn assembled(elements: &SpectralElements, nodes: &[f64], intensity: f64) -> DMatrix<f64> {
        let (p, n) = (elements.degree(), nodes.len());
        let size = 2 * (p + 1);
        let mut local = vec![0.0; size * size];
        let mut matrix = DMatrix::zeros(n, n);
        for e in 0..elements.n_elements() {
            elements
                .element_tangent_into(e, nodes, intensity, &mut local)
                .unwrap();
            // interior nodes come first, then the two ends
            let node = |i: usize| match i / 2 {
                k if k < p - 1 => e * p + k + 1,
                k if k == p - 1 => e * p,
                _ => e * p + p,
            };
            for i in 0..size {
                for j in 0..size {
                    let at = (2 * node(i) + i % 2, 2 * node(j) + j % 2);
                    matrix[at] += local[i * size + j];
                }
            }
        }
        let [first, end] = elements.held();
        for (row, held) in [
            (0, first[0]),
            (1, first[1]),
            (n - 2, end[0]),
            (n - 1, end[1]),
        ] {
            if held {
                matrix.row_mut(row).fill(0.0);
                matrix[(row, row)] = 1.0;
            }
        }
        matrix
    }

    #[test]
    fn solves_equal_a_dense_lu() {
        for law in [
            PressureLaw::PerMaterialLength,
            PressureLaw::PerCurrentLength,
        ] {
            // whole curve and half curve
            for skew in [0.5, 0.0] {
                let stiffness = Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap();
                let membrane = Membrane::new(RestShape::balloon(8.5, 1.75).unwrap())
                    .with_stiffness(stiffness)
                    .with_law(law);
                for (degree, per_piece) in [(2, 1), (3, 2), (7, 1), (14, 3)] {
                    let elements = SpectralElements::new(&membrane, degree, per_piece).unwrap();
                    assert_eq!(elements.is_half(), skew == 0.0);
                    let moved = |(i, x): (usize, &f64)| x + 0.2 * (i as f64 * 0.3).sin();
                    let nodes: Vec<f64> = elements.start().iter().enumerate().map(moved).collect();
                    let matrix = assembled(&elements, &nodes, 4.0);
                    let mut lu = CondensedLu::new(&elements);
                    assert_eq!(
                        lu.solve_in_place(&mut vec![1.0; nodes.len()]),
                        Err(NewtonError::NotFactored)
                    );
                    let found = lu.factor(&elements, &nodes, 4.0).unwrap();
                    let factors = matrix.clone().lu();
                    let signs = factors.u().diagonal().map(f64::signum).product();
                    let sign = signs * factors.p().determinant::<f64>();
                    assert_eq!(found, sign);
                    let b = DVector::from_fn(nodes.len(), |i, _| (i as f64 * 0.9).cos());
                    let mut x = b.as_slice().to_vec();
                    lu.solve_in_place(&mut x).unwrap();
                    let x = DVector::from_vec(x);
                    // backward stable: the residual is rounding of the matrix times x
                    let size = matrix.abs().row_sum_tr().max() * x.amax();
                    let residual = (&matrix * &x - &b).amax();
                    let case = format!("{law:?}, degree {degree}, {per_piece} a piece");
                    assert!(residual < 1e-13 * size, "{case}: {residual:e} of {size:e}");
                    // and the answer is the dense one, to that times the condition number
                    let dense = matrix.clone().lu().solve(&b).unwrap();
                    let condition = matrix
                        .clone()
                        .try_inverse()
                        .unwrap()
                        .abs()
                        .row_sum_tr()
                        .max()
                        * matrix.abs().row_sum_tr().max();
                    let off = (&dense - &x).amax() / dense.amax();
                    assert!(
                        off < 1e-15 * condition,
                        "{case}: {off:e}, condition {condition:e}"
                    );
                }
            }
        }
    }
}
