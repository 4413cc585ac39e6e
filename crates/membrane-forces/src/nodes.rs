//! The nodes of a state: all nodes of a curve, or those up to the axis.

use std::ops::Range;

/// Nodes 0 .. `kept` of a curve of `whole` nodes, both ends fixed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nodes {
    pub(crate) whole: usize,
    pub(crate) kept: usize,
}

impl Nodes {
    pub(crate) fn all(whole: usize) -> Self {
        Self { whole, kept: whole }
    }

    /// Selects the nodes up to the axis; an odd number of nodes has one on it.
    pub(crate) fn half(self) -> Self {
        let kept = self.whole.div_ceil(2);
        Self { kept, ..self }
    }

    pub(crate) fn is_half(self) -> bool {
        self.kept < self.whole
    }

    /// Whether the last node of a state is on the axis.
    pub(crate) fn has_apex(self) -> bool {
        self.is_half() && 2 * self.kept == self.whole + 1
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

    /// Returns node `n` of the whole curve in `state`.
    #[inline]
    pub(crate) fn node(self, state: &[f64], n: usize) -> [f64; 2] {
        let (at, sign) = self.place(n);
        [state[2 * at], sign * state[2 * at + 1]]
    }

    /// Cuts positions of the whole curve to those of a state.
    pub(crate) fn cut(self, positions: &mut Vec<f64>) {
        positions.truncate(2 * self.kept);
        positions.shrink_to_fit();
        if self.has_apex() {
            positions[2 * self.kept - 1] = 0.0;
        }
    }
}

/// Whether a curve is mirror-symmetric about the x axis, to rounding.
pub(crate) fn is_mirrored(nodes: &[f64]) -> bool {
    let most = 1e-13 * nodes.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let points = nodes.as_chunks::<2>().0;
    let mut pairs = points.iter().zip(points.iter().rev());
    pairs.all(|(a, b)| (a[0] - b[0]).abs() <= most && (a[1] + b[1]).abs() <= most)
}
