//! The nodes of a state: all nodes of a curve, or those up to the axis.

use std::ops::Range;

/// Nodes 0 .. `kept` of a curve of `whole` nodes, both ends fixed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nodes {
    pub(crate) whole: usize,
    pub(crate) kept: usize,
}

impl Nodes {
    /// Selects the nodes up to the axis; an odd number of nodes has one on it.
    pub(crate) fn half(self) -> Self {
        let kept = self.whole.div_ceil(2);
        Self { kept, ..self }
    }

    pub(crate) fn is_half(self) -> bool {
        self.kept < self.whole
    }

    /// Returns the nodes with forces: all except the fixed ends.
    pub(crate) fn moving(self) -> Range<usize> {
        1..self.kept.min(self.whole - 1)
    }

    /// Returns the position in the state of node `n` of the whole curve, and the sign of its y there.
    #[inline]
    pub(crate) fn place(self, n: usize) -> (usize, f64) {
        if n < self.kept {
            (n, 1.0)
        } else {
            (self.whole - 1 - n, -1.0)
        }
    }

    /// Whether coordinate `k` of moving node `n` is fixed: only the y of a node on the axis.
    #[inline]
    pub(crate) fn is_fixed(self, n: usize, k: usize) -> bool {
        k == 1 && 2 * n + 1 == self.whole && self.is_half()
    }
}
