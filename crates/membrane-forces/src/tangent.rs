//! The derivative of forces by the state, and its storage.

use crate::band::BandMatrix;
use crate::error::{MembraneError, Result, at_least};

/// The derivative of the forces by the state: dense blocks along the diagonal, coupled by a band.
///
/// Each block belongs to an element. Its rows and columns, x before y, are those of the element's inner nodes, then of its first, then of
/// its last node, which is the first of the next element. The band contains the end nodes of elements. Entries of blocks and band add.
/// Without blocks the band contains all nodes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Tangent {
    /// Square matrices, row by row.
    pub blocks: Vec<Vec<f64>>,
    /// The band.
    pub band: BandMatrix,
}

/// Numbers of a tangent: blocks, rows of a block, rows of the band, diagonals on either side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    blocks: usize,
    size: usize,
    rows: usize,
    diagonals: usize,
}

impl Layout {
    /// A band for all `rows` numbers of a state.
    pub(crate) fn band(rows: usize, diagonals: usize) -> Self {
        let (blocks, size) = (0, 0);
        Self {
            blocks,
            size,
            rows,
            diagonals,
        }
    }

    /// A block for each of `blocks` elements of `nodes` nodes.
    pub(crate) fn elements(blocks: usize, nodes: usize) -> Self {
        let (size, rows) = (2 * nodes, 2 * (blocks + 1));
        Self {
            blocks,
            size,
            rows,
            diagonals: 3,
        }
    }
}

/// Position of node `i` of an element of degree `p` in its block: inner nodes first, then the two ends.
pub(crate) fn local_index(i: usize, p: usize) -> usize {
    match i {
        0 => p - 1,
        i if i == p => p,
        i => i - 1,
    }
}

impl Tangent {
    pub(crate) fn zeros(of: Layout) -> Self {
        Self {
            blocks: vec![vec![0.0; of.size * of.size]; of.blocks],
            band: BandMatrix::of_shape(of.rows, of.diagonals, of.diagonals),
        }
    }

    /// Rejects the tangent of another membrane.
    pub(crate) fn check(&self, of: Layout) -> Result<()> {
        MembraneError::length("blocks", self.blocks.len(), of.blocks)?;
        MembraneError::length("rows of the band", self.band.len(), of.rows)?;
        let diagonals = self.band.lower().min(self.band.upper());
        at_least("diagonals on either side", diagonals, of.diagonals)?;
        let mut blocks = self.blocks.iter();
        blocks.try_for_each(|block| {
            MembraneError::length("numbers of a block", block.len(), of.size * of.size)
        })
    }

    /// Rows of a block, 4 without blocks: two nodes.
    fn size(&self) -> usize {
        self.blocks.first().map_or(4, |block| block.len().isqrt())
    }

    /// Clears the rows and columns of `fixed` numbers of a state within the blocks.
    pub(crate) fn clear_in_blocks(&mut self, fixed: &[usize]) {
        let (size, count) = (self.size(), self.blocks.len());
        for held in fixed {
            // they are at the ends of elements, which are the last rows of a block
            let end = held / (size - 2);
            if let Some(block) = self.blocks.get_mut(end.min(count.saturating_sub(1))) {
                let row = if end < count { size - 4 } else { size - 2 } + held % 2;
                block[row * size..(row + 1) * size].fill(0.0);
                block[row..].iter_mut().step_by(size).for_each(|v| *v = 0.0);
            }
        }
    }

    /// Replaces the rows and columns of `fixed` numbers of a state by those of the unit matrix. If only the rows were replaced,
    /// entries of the columns could become pivots, and the fixed numbers would move by rounding.
    pub(crate) fn hold(&mut self, fixed: &[usize]) {
        self.clear_in_blocks(fixed);
        let stride = self.size() - 2;
        for held in fixed {
            let row = 2 * (held / stride) + held % 2;
            self.band.clear_both(row);
            self.band.add_inside(row, row, 1.0);
        }
    }

    /// Computes `out` = A `x` with this matrix A. Cost O(number of entries).
    ///
    /// # Panics
    /// A length that is not that of a state.
    pub fn mul_into(&self, x: &[f64], out: &mut [f64]) {
        if self.blocks.is_empty() {
            return self.band.mul_into(x, out);
        }
        let (size, stride) = (self.size(), self.size() - 2);
        let ends: Vec<usize> = (0..self.band.len())
            .map(|i| i / 2 * stride + i % 2)
            .collect();
        let at_ends: Vec<f64> = ends.iter().map(|&end| x[end]).collect();
        let mut product = vec![0.0; ends.len()];
        self.band.mul_into(&at_ends, &mut product);
        out.fill(0.0);
        for (&end, value) in ends.iter().zip(product) {
            out[end] = value;
        }
        for (e, block) in self.blocks.iter().enumerate() {
            let first = e * stride;
            let inner = first + 2..first + stride;
            let places: Vec<usize> = inner
                .chain(first..first + 2)
                .chain(first + stride..first + size)
                .collect();
            for (row, &to) in block.chunks_exact(size).zip(&places) {
                let products = row.iter().zip(&places).map(|(a, &from)| a * x[from]);
                out[to] += products.sum::<f64>();
            }
        }
    }
}
