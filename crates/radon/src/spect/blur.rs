//! Depth-dependent blur: from the nodes of a block of rows to the detector, and back.
//!
//! Planes are divided among a few [nodes](super::nodes::Nodes), each of which has a separable kernel. Bins are blurred node by node. Rows
//! are blurred once for all nodes: with a_jk the weight of the neighbours at a distance of k rows in node j,
//!
//! ```text
//! sum over j of  K_j * x_j  =  sum over k of  (shift by k + shift by -k)  sum over j of  a_jk x_j
//! ```
//!
//! so that the sums over nodes, which are most of the work, need no neighbours.

use std::ops::Range;

use super::nodes::Nodes;
use crate::pool::grown;
use crate::simd::{Lanes, ROWS};
use crate::{InstructionSet, RadonError, Sample};

/// Bins that are summed over all nodes before the next ones, so that they stay in the first-level cache.
const TOGETHER: usize = 4;

/// The nodes of all views, and the place of the detector among bins and rows.
#[derive(Debug)]
pub(super) struct Blur<T> {
    pub(super) nodes: Nodes,
    /// For each node the weights of neighbouring bins, from the farthest before to the farthest behind.
    along: Vec<Vec<T>>,
    /// For each node the weights of rows at distances of 0, 1, ...
    across: Vec<Vec<T>>,
    /// For each distance of rows the weights of all nodes from the first one that reaches so far; zeros beyond a kernel.
    by_distance: Vec<Vec<T>>,
    /// Bins of the detector.
    n_bins: usize,
}

/// The blocks of rows that contribute to a detector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows {
    /// Rows of the detector.
    pub(super) n_rows: usize,
    /// Position of the detector's first row among the rows of all blocks.
    pub(super) first: isize,
    pub(super) n_blocks: usize,
}

/// Work arrays of a block or a view.
#[derive(Debug, Default)]
pub(super) struct Work<T> {
    /// Nodes with blurred bins, `[node][bin]`.
    blurred: Vec<Lanes<T>>,
    /// A bin in all rows.
    line: Vec<T>,
    column: Vec<T>,
}

impl<T: Sample> Blur<T> {
    /// Prepares the blur by variances (cm^2) in this range; `pitch` of bins and rows, `tolerance` of a peak.
    pub(super) fn new(
        variances: [f64; 2],
        pitch: [f64; 2],
        tolerance: f64,
        n_bins: usize,
    ) -> Result<Self, RadonError> {
        let nodes = Nodes::new(variances, pitch, tolerance)?;
        let all = |kernel: &[f64]| kernel.iter().map(|&w| T::of(w)).collect::<Vec<_>>();
        let both = |[bins, _]: &[Vec<f64>; 2]| {
            bins[1..]
                .iter()
                .rev()
                .chain(bins)
                .map(|&w| T::of(w))
                .collect()
        };
        let across: Vec<Vec<T>> = nodes.kernels.iter().map(|[_, rows]| all(rows)).collect();
        let distances = across.iter().map(Vec::len).max().unwrap_or(0);
        let weights = |k: usize| {
            let weights = across.iter().map(|rows| rows.get(k).copied());
            let reaching = weights.skip_while(Option::is_none);
            reaching.map(Option::unwrap_or_default).collect()
        };
        Ok(Self {
            along: nodes.kernels.iter().map(both).collect(),
            by_distance: (0..distances).map(weights).collect(),
            across,
            n_bins,
            nodes,
        })
    }

    /// Bins and rows on either side of the detector that contribute to it.
    pub(super) fn margin(&self) -> [usize; 2] {
        let reach = |axis: usize| self.nodes.kernels.iter().map(move |k| k[axis].len() - 1);
        [0, 1].map(|axis| reach(axis).max().unwrap_or(0))
    }

    /// Bins of a node.
    pub(super) fn wide(&self) -> usize {
        self.n_bins + 2 * self.margin()[0]
    }

    /// Bins of the sums, some of them unused.
    fn padded(&self) -> usize {
        self.n_bins.next_multiple_of(TOGETHER)
    }

    /// Length of the sums of a block, `[distance][bin]`.
    pub(super) fn sums_len(&self) -> usize {
        self.padded() * self.by_distance.len()
    }

    /// Bins, those of the sums, and distances.
    fn sums_shape(&self) -> [usize; 3] {
        [self.n_bins, self.padded(), self.by_distance.len()]
    }

    /// Blurs the bins of a block's nodes `[node][wide bin]`, those in use, and sums them, `[distance][bin]`.
    pub(super) fn sum_nodes(
        &self,
        set: InstructionSet,
        used: &Range<usize>,
        nodes: &[Lanes<T>],
        sums: &mut [Lanes<T>],
        work: &mut Work<T>,
    ) {
        let ([margin, _], wide, padded) = (self.margin(), self.wide(), self.padded());
        // An odd distance between nodes avoids cache conflicts.
        let stride = padded + 1;
        let blurred = grown(&mut work.blurred, stride * used.len());
        let images = nodes.chunks_exact(wide).zip(&self.along[used.clone()]);
        for ((image, kernel), out) in images.zip(blurred.chunks_exact_mut(stride)) {
            let from = Lanes::flat(&image[margin - kernel.len() / 2..]);
            T::weighted_sums(
                set,
                from,
                ROWS,
                kernel,
                Lanes::flat_mut(&mut out[..self.n_bins]),
            );
        }
        for start in (0..padded).step_by(TOGETHER) {
            for (weights, sums) in self.by_distance.iter().zip(sums.chunks_exact_mut(padded)) {
                let first = self.across.len() - weights.len();
                let nodes = first.max(used.start)..first.max(used.end);
                let weights = &weights[nodes.start - first..nodes.end - first];
                let from = blurred.get((nodes.start - used.start) * stride + start..);
                let from = Lanes::flat(from.unwrap_or_default());
                let sums = Lanes::flat_mut(&mut sums[start..start + TOGETHER]);
                T::weighted_sums(set, from, stride * ROWS, weights, sums);
            }
        }
    }

    /// The adjoint of [`sum_nodes`](Self::sum_nodes).
    pub(super) fn fill_nodes(
        &self,
        set: InstructionSet,
        used: &Range<usize>,
        sums: &[Lanes<T>],
        nodes: &mut [Lanes<T>],
        work: &mut Work<T>,
    ) {
        let ([margin, _], wide, padded) = (self.margin(), self.wide(), self.padded());
        let blurred = grown(&mut work.blurred, padded + 4 * margin);
        blurred.fill(Lanes::default());
        let kernels = self.along[used.clone()]
            .iter()
            .zip(&self.across[used.clone()]);
        for (image, (along, across)) in nodes.chunks_exact_mut(wide).zip(kernels) {
            let bins = Lanes::flat_mut(&mut blurred[2 * margin..][..self.n_bins]);
            T::weighted_sums(set, Lanes::flat(sums), padded * ROWS, across, bins);
            let from = Lanes::flat(&blurred[margin - along.len() / 2..]);
            T::weighted_sums(set, from, ROWS, along, Lanes::flat_mut(image));
        }
    }
}

/// Blurs the rows of the sums of all blocks, `[distance][bin]` at a distance of `stride` from block to block, into a view `[row][bin]`.
pub(super) struct ToDetector<'a, T> {
    pub(super) blur: &'a Blur<T>,
    pub(super) rows: Rows,
    pub(super) sums: &'a [Lanes<T>],
    pub(super) stride: usize,
    pub(super) view: &'a mut [T],
    pub(super) work: &'a mut Work<T>,
}

impl<T: Sample> simd_set::Work for ToDetector<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let [n_bins, padded, distances] = self.blur.sums_shape();
        let (n_rows, n_blocks) = (self.rows.n_rows, self.rows.n_blocks);
        let Work { line, column, .. } = self.work;
        let [blocks, detector] = self.rows.place(distances, line);
        for bin in 0..n_bins {
            column.clear();
            column.resize(n_rows, T::ZERO);
            for k in 0..distances {
                let own = self.sums[k * padded + bin..].iter().step_by(self.stride);
                let parts = line[blocks..]
                    .as_chunks_mut::<ROWS>()
                    .0
                    .iter_mut()
                    .take(n_blocks);
                for (to, from) in parts.zip(own) {
                    *to = from.0;
                }
                add_at_distance(column, line, detector, k);
            }
            for (view, &x) in self.view.iter_mut().skip(bin).step_by(n_bins).zip(&*column) {
                *view = x;
            }
        }
    }
}

/// The adjoint of [`ToDetector`]; sums are `[block][distance][bin]`.
pub(super) struct FromDetector<'a, T> {
    pub(super) blur: &'a Blur<T>,
    pub(super) rows: Rows,
    pub(super) view: &'a [T],
    pub(super) sums: &'a mut [Lanes<T>],
    pub(super) work: &'a mut Work<T>,
}

impl<T: Sample> simd_set::Work for FromDetector<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let [n_bins, padded, distances] = self.blur.sums_shape();
        let Work { line, column, .. } = self.work;
        let [blocks, detector] = self.rows.place(distances, line);
        for bin in 0..n_bins {
            let of_bin = self.view.iter().skip(bin).step_by(n_bins);
            for (to, &x) in line[detector..].iter_mut().zip(of_bin) {
                *to = x;
            }
            for k in 0..distances {
                column.clear();
                column.resize(self.rows.n_blocks * ROWS, T::ZERO);
                add_at_distance(column, line, blocks, k);
                let own = self.sums[k * padded + bin..]
                    .iter_mut()
                    .step_by(padded * distances);
                for (to, from) in own.zip(column.as_chunks::<ROWS>().0) {
                    to.0 = *from;
                }
            }
        }
    }
}

impl Rows {
    /// Sizes a bin in the rows of all blocks and of the detector, zeros, with as many on either side as the largest distance. Returns the
    /// positions of the first row of the blocks, and of the detector.
    fn place<T: Sample>(self, distances: usize, line: &mut Vec<T>) -> [usize; 2] {
        let blocks = distances + (-self.first).max(0) as usize;
        let detector = distances + self.first.max(0) as usize;
        let end = (blocks + self.n_blocks * ROWS).max(detector + self.n_rows);
        line.clear();
        line.resize(end + distances, T::ZERO);
        [blocks, detector]
    }
}

/// Adds the samples at a distance of `k` on both sides to `sums`, the first of which is at `start`.
#[inline(always)]
fn add_at_distance<T: Sample>(sums: &mut [T], line: &[T], start: usize, k: usize) {
    let n = sums.len();
    let (before, behind) = (&line[start - k..][..n], &line[start + k..][..n]);
    match k {
        0 => sums.copy_from_slice(before),
        _ => {
            for ((sum, &a), &b) in sums.iter_mut().zip(before).zip(behind) {
                *sum += a + b;
            }
        }
    }
}
