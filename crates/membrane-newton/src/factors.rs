//! Factorisation of a tangent: static condensation of its blocks, then a band.

use membrane_forces::{DiscreteMembrane, Tangent};

use crate::banded::BandedLu;
use crate::border::dot;
use crate::error::{NewtonError, Result, reciprocal};

/// Storage for a [`Tangent`] and its factors.
///
/// The inner nodes of a block are coupled only within the block: a dense LU eliminates them first, stops before the block's two end nodes,
/// and leaves their 4 by 4 Schur complement in its last corner. The rest is a band. Cost O(blocks p^3 + nodes in the band) to factor,
/// O(blocks p^2 + nodes) to solve, no allocation after set-up.
#[derive(Debug, Clone)]
pub(crate) struct Factors {
    tangent: Tangent,
    /// Unknowns of a block: inner ones first, then those of its two ends.
    size: usize,
    inner: usize,
    pivots: Vec<Vec<u32>>,
    lu: BandedLu,
    /// Whether the storage contains a factorisation.
    factored: bool,
    end_values: Vec<f64>,
    block_values: Vec<f64>,
}

impl Factors {
    pub(crate) fn new(discrete: &dyn DiscreteMembrane) -> Self {
        let tangent = discrete.tangent();
        let size = tangent.blocks.first().map_or(4, |b| b.len().isqrt());
        let inner = size - 4;
        Self {
            size,
            inner,
            pivots: vec![vec![0; inner]; tangent.blocks.len()],
            lu: BandedLu::for_matrix(&tangent.band),
            factored: false,
            end_values: vec![0.0; tangent.band.len()],
            block_values: vec![0.0; size],
            tangent,
        }
    }

    /// Factors the tangent at `nodes` and `intensity`, with tensions of rubber limited to at least this value; returns the sign of its
    /// determinant, which the common reordering of rows and columns does not change.
    pub(crate) fn factor(
        &mut self,
        discrete: &dyn DiscreteMembrane,
        nodes: &[f64],
        (intensity, least): (f64, f64),
    ) -> Result<f64> {
        self.factored = false;
        discrete.taut_tangent_into(nodes, intensity, least, &mut self.tangent)?;
        self.eliminate()
    }

    /// Factors `tangent`; returns the sign of its determinant.
    pub(crate) fn factor_tangent(&mut self, tangent: &Tangent) -> Result<f64> {
        self.tangent.clone_from(tangent);
        self.eliminate()
    }

    fn eliminate(&mut self) -> Result<f64> {
        self.factored = false;
        let Tangent { blocks, band, .. } = &mut self.tangent;
        let mut sign = 1.0;
        for (e, block) in blocks.iter_mut().enumerate() {
            sign *= eliminate(block, self.size, self.inner, &mut self.pivots[e])?;
            let ends = block.chunks_exact(self.size).skip(self.inner);
            for (i, row) in ends.enumerate() {
                for (j, value) in row[self.inner..].iter().enumerate() {
                    band.add(2 * e + i, 2 * e + j, *value)?;
                }
            }
        }
        self.lu.factor(band)?;
        self.factored = true;
        Ok(sign * self.lu.determinant_sign())
    }

    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<()> {
        if !self.factored {
            return Err(NewtonError::NotFactored);
        }
        let (blocks, size, inner) = (&self.tangent.blocks, self.size, self.inner);
        if blocks.is_empty() {
            return self.lu.solve_into(rhs);
        }
        // From one end node to the next.
        let stride = inner + 2;
        let ends = self.end_values.as_chunks_mut::<2>().0;
        for (end, x) in ends.iter_mut().zip(rhs.chunks(stride)) {
            end.copy_from_slice(&x[..2]);
        }
        for (e, block) in blocks.iter().enumerate() {
            let inside = &mut rhs[e * stride + 2..][..inner];
            for k in 0..inner {
                inside.swap(k, self.pivots[e][k] as usize);
                // row k of L is complete: its multipliers are left of the diagonal
                inside[k] -= dot(&block[k * size..][..k], inside);
            }
            for i in 0..4 {
                let l = &block[(inner + i) * size..][..inner];
                self.end_values[2 * e + i] -= dot(l, inside);
            }
        }
        self.lu.solve_into(&mut self.end_values)?;
        for (e, block) in blocks.iter().enumerate() {
            let full = &mut self.block_values;
            full[inner..].copy_from_slice(&self.end_values[2 * e..][..4]);
            let inside = &mut rhs[e * stride + 2..][..inner];
            for k in (0..inner).rev() {
                let row = &block[k * size..][..size];
                full[k] = (inside[k] - dot(&row[k + 1..], &full[k + 1..])) / row[k];
            }
            inside.copy_from_slice(&full[..inner]);
        }
        let ends = self.end_values.as_chunks::<2>().0;
        for (end, x) in ends.iter().zip(rhs.chunks_mut(stride)) {
            x[..2].copy_from_slice(end);
        }
        Ok(())
    }
}

/// Eliminates the first `inner` columns of the `size` by `size` matrix, pivoting among its first `inner` rows; L, U and the Schur
/// complement overwrite it. Returns the sign of the product of the pivots, row swaps counted.
fn eliminate(a: &mut [f64], size: usize, inner: usize, pivots: &mut [u32]) -> Result<f64> {
    let mut sign = 1.0;
    for k in 0..inner {
        let mut pivot = k;
        for i in k + 1..inner {
            if a[i * size + k].abs() > a[pivot * size + k].abs() {
                pivot = i;
            }
        }
        let value = a[pivot * size + k];
        let inverse = reciprocal(k, value)?;
        pivots[k] = pivot as u32;
        if (value < 0.0) ^ (pivot != k) {
            sign = -sign;
        }
        let (above, below) = a.split_at_mut((k + 1) * size);
        let upper = &mut above[k * size..];
        if pivot != k {
            upper.swap_with_slice(&mut below[(pivot - k - 1) * size..(pivot - k) * size]);
        }
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

    #[test]
    fn the_pivot_of_a_column_is_its_largest_entry() {
        // small pivots above a large one, in the second column too
        let mut a = [
            1e-20, 1.0, 2.0, 3.0, 1e-9, 2.0, 1.0, 1.0, 4.0, 3.0, 1.0, 2.0, 1.0, 1.0, 1.0, 5.0,
        ];
        let mut pivots = [0; 3];
        let sign = eliminate(&mut a, 4, 3, &mut pivots).unwrap();
        assert_eq!((pivots, sign), ([2, 1, 2], -1.0));
        let product: f64 = (0..4).map(|k| a[5 * k]).product();
        // the determinant in exact arithmetic, with one exchange of rows
        assert!((product - 39.999_999_983).abs() < 1e-9, "{product}");
    }
}
