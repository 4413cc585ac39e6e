//! A curve that is its own mirror image, kept up to the axis: which nodes there are, what lies
//! beyond the last of them, and the measures of the whole.

use crate::differences::FiniteDifferences;
use crate::error::{MembraneError, length};
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;

impl FiniteDifferences {
    /// [`FiniteDifferences::new`], of which only the nodes with s <= 1/2 are kept if rest shape,
    /// stiffness and ends are mirror images about the x axis (to rounding, node by node); the
    /// whole curve otherwise.
    ///
    /// ```
    /// use membrane_forces::{FiniteDifferences, Membrane, RestShape};
    /// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
    /// let half = FiniteDifferences::half(&membrane, 201)?;
    /// assert!(half.is_half() && half.start().len() == 2 * 101 && half.n_nodes() == 201);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// As [`FiniteDifferences::new`].
    pub fn half(membrane: &Membrane, n_nodes: usize) -> Result<Self, MembraneError> {
        let mut this = Self::new(membrane, n_nodes)?;
        if !this.is_symmetric() {
            return Ok(this);
        }
        let count = n_nodes.div_ceil(2);
        for nodes in [&mut this.rest, &mut this.start] {
            nodes.truncate(2 * count);
            nodes.shrink_to_fit();
            if n_nodes % 2 == 1 {
                nodes[2 * count - 1] = 0.0;
            }
        }
        Ok(this)
    }

    /// Whether the whole curve equals its own mirror image to rounding.
    fn is_symmetric(&self) -> bool {
        let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-13 * scale;
        let size = self.start.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let stiff = self.stiffness_scale();
        let mirrored = |nodes: &[f64]| {
            let points = nodes.as_chunks::<2>().0;
            let pairs = points.iter().zip(points.iter().rev());
            pairs
                .take(points.len().div_ceil(2))
                .all(|(a, b)| close(a[0], b[0], size) && close(a[1], -b[1], size))
        };
        let even = |v: &[f64]| {
            let mut pairs = v.iter().zip(v.iter().rev());
            pairs.all(|(a, b)| close(*a, *b, stiff))
        };
        mirrored(&self.rest) && mirrored(&self.start) && even(&self.first) && even(&self.second)
    }

    /// Whether the state ends at the axis, the rest of the curve being its mirror image.
    pub fn is_half(&self) -> bool {
        self.count() < self.n_nodes()
    }

    /// Nodes in the state.
    pub(crate) fn count(&self) -> usize {
        self.rest.len() / 2
    }

    /// Nodes of the state that have forces: all but the held ends.
    pub(crate) fn moving(&self) -> std::ops::Range<usize> {
        1..self.count().min(self.n_nodes() - 1)
    }

    /// Whether the x and the y of the first and of the last node of the state are held.
    pub fn held(&self) -> [[bool; 2]; 2] {
        let whole = !self.is_half();
        [[true, true], [whole, whole || self.n_nodes() % 2 == 1]]
    }

    /// The place in the state of node `n` of the whole curve, and the sign of its y there.
    #[inline]
    pub(crate) fn place(&self, n: usize) -> (usize, f64) {
        if n < self.count() {
            (n, 1.0)
        } else {
            (self.n_nodes() - 1 - n, -1.0)
        }
    }

    /// Node `n` of the whole curve in state `nodes`; `n` < N.
    #[inline]
    pub(crate) fn node(&self, nodes: &[f64], n: usize) -> [f64; 2] {
        let (at, sign) = self.place(n);
        [nodes[2 * at], sign * nodes[2 * at + 1]]
    }

    /// Node `n` of the whole curve in state `nodes`; none if n >= N or the state has another length than
    /// [`FiniteDifferences::start`].
    pub fn point(&self, nodes: &[f64], n: usize) -> Option<[f64; 2]> {
        let there = nodes.len() == self.rest.len() && n < self.n_nodes();
        there.then(|| self.node(nodes, n))
    }

    /// All nodes of the whole curve, from s = 0 to s = 1.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if `nodes` has not the length of [`FiniteDifferences::start`].
    pub fn points(&self, nodes: &[f64]) -> Result<Vec<[f64; 2]>, MembraneError> {
        length("nodes", nodes.len(), self.rest.len())?;
        Ok((0..self.n_nodes()).map(|n| self.node(nodes, n)).collect())
    }

    /// The measure of the polyline through all nodes of the whole curve. Cost O(N).
    ///
    /// # Errors
    /// As [`FiniteDifferences::points`].
    pub fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64, MembraneError> {
        length("nodes", nodes.len(), self.rest.len())?;
        Ok(self.value(measure, nodes))
    }

    /// [`FiniteDifferences::measure`] of a state that has the right length.
    pub(crate) fn value(&self, measure: Measure, nodes: &[f64]) -> f64 {
        let points = nodes.as_chunks::<2>().0;
        if self.is_half() {
            measure.of_half(points)
        } else {
            measure.of(points)
        }
    }

    /// `out` = gradient of [`FiniteDifferences::measure`] with respect to the state. Cost O(N).
    ///
    /// # Panics
    /// A length that is not that of [`FiniteDifferences::start`].
    pub fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        self.check(nodes, out);
        let (points, out) = (nodes.as_chunks::<2>().0, out.as_chunks_mut::<2>().0);
        if self.is_half() {
            measure.half_gradient_into(points, out);
        } else {
            measure.gradient_into(points, out);
        }
    }

    /// All four measures of the whole curve. Cost O(N).
    ///
    /// # Errors
    /// As [`FiniteDifferences::points`].
    pub fn measures(&self, nodes: &[f64]) -> Result<Measures, MembraneError> {
        length("nodes", nodes.len(), self.rest.len())?;
        let of = |measure| self.value(measure, nodes);
        Ok(Measures {
            length: of(Measure::Length),
            area: of(Measure::Area),
            surface: of(Measure::Surface),
            volume: of(Measure::Volume),
        })
    }

    /// Whether coordinate `k` of moving node `n` is held: only the y of a node on the axis.
    #[inline]
    pub(crate) fn is_held(&self, n: usize, k: usize) -> bool {
        k == 1 && 2 * n + 1 == self.n_nodes() && self.is_half()
    }

    pub(crate) fn clear_held(&self, out: &mut [[f64; 2]]) {
        let [_, end] = self.held();
        out[0] = [0.0; 2];
        if let Some(last) = out.last_mut() {
            for (last, held) in last.iter_mut().zip(end) {
                if held {
                    *last = 0.0;
                }
            }
        }
    }
}
