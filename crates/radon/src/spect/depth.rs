//! Depth-dependent blur of many planes at the cost of a few blurs.
//!
//! Planes are divided among a few [nodes](crate::response::Nodes). Node j is blurred by the difference of variances W_j - W_i and added to
//! node i, its parent, from the farthest to the nearest. King, Pan & Luo (1997, IEEE Trans. Nucl. Sci. 44) call this Gaussian diffusion and
//! show how masks of too narrow Gaussians spoil it.

use super::lanes::{LANES, Lanes};
use crate::response::{Nodes, Through};
use crate::{RadonError, Sample};

/// The division of the planes of a view among nodes.
#[derive(Debug)]
pub(super) struct Depths<T> {
    /// For each plane the node in front of it, and the fraction of the node behind.
    pub(super) planes: Vec<(usize, T)>,
    pub(super) nodes: Vec<Node<T>>,
}

/// A depth whose image is blurred and added to another.
#[derive(Debug)]
pub(super) struct Node<T> {
    /// The target: 0 for the camera's image, else 1 + the index of a node.
    pub(super) parent: usize,
    /// Weights of neighbours at distances of 0, 1, ... bins and rows.
    pub(super) kernels: [Vec<T>; 2],
}

impl<T: Sample> Depths<T> {
    /// Nodes for planes of these variances (cm^2); `pitch` of bins and rows, `tolerance` of a peak.
    pub(super) fn new(
        variances: &[f64],
        pitch: [f64; 2],
        tolerance: f64,
    ) -> Result<Self, RadonError> {
        let far = variances.iter().fold(0.0, |m: f64, &v| m.max(v));
        let near = variances.iter().fold(far, |m: f64, &v| m.min(v));
        let nodes = Nodes::new([near, far], pitch, tolerance, Through::Parents)?;
        let fraction = |&variance: &f64| {
            let (node, behind) = nodes.fraction(variance);
            (node, T::of(behind))
        };
        let node = |(parent, kernels): (&Option<usize>, &[Vec<f64>; 2])| Node {
            parent: parent.map_or(0, |i| i + 1),
            kernels: (kernels.each_ref()).map(|kernel| kernel.iter().map(|&w| T::of(w)).collect()),
        };
        Ok(Self {
            planes: variances.iter().map(fraction).collect(),
            nodes: nodes.parents.iter().zip(&nodes.kernels).map(node).collect(),
        })
    }
}

/// The detector with margins: bins, and blocks of rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) n_bins: usize,
    pub(super) n_blocks: usize,
}

/// Adds a blurred image to another; beyond the frame there are zeros. Symmetric kernels: self-adjoint.
pub(super) struct AddBlurred<'a, T> {
    pub(super) frame: Frame,
    pub(super) kernels: &'a [Vec<T>; 2],
    /// All images, `[block][image][bin]`.
    pub(super) images: &'a mut [Lanes<T>],
    pub(super) n_images: usize,
    /// Source and target image.
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) work: &'a mut Work<T>,
}

/// Work arrays, with zeros on either side of the blurred samples.
#[derive(Debug, Default)]
pub(super) struct Work<T> {
    /// The bins of a block, and those bins blurred.
    bins: Vec<T>,
    blurred: Vec<T>,
    /// All rows of all bins, and those rows blurred.
    rows: Vec<T>,
    along: Vec<T>,
}

impl<T: Sample> simd_set::Work for AddBlurred<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Frame { n_bins, n_blocks } = self.frame;
        let [wide, high] = self.kernels.each_ref().map(|kernel| kernel.len() - 1);
        let Work {
            bins,
            blurred,
            rows,
            along,
        } = self.work;
        let start = |block: usize, image: usize| (block * self.n_images + image) * n_bins;
        let stride = n_blocks * LANES + high;
        fit(rows, n_bins * stride + high);
        fit(bins, (n_bins + 2 * wide) * LANES);
        fit(blurred, n_bins * LANES);
        fit(along, n_bins * stride - high);
        // Zeros on either side of the bins, and of each row.
        bins[..wide * LANES].fill(T::ZERO);
        bins[(wide + n_bins) * LANES..].fill(T::ZERO);
        rows.chunks_mut(stride)
            .for_each(|row| row[..high].fill(T::ZERO));
        for block in 0..n_blocks {
            let from = &self.images[start(block, self.from)..][..n_bins];
            for (to, from) in bins[wide * LANES..].chunks_exact_mut(LANES).zip(from) {
                to.copy_from_slice(&from.0);
            }
            convolve(blurred, bins, &self.kernels[0], LANES);
            let places = rows[high..].chunks_exact_mut(stride);
            for (row, from) in places.zip(blurred.chunks_exact(LANES)) {
                row[block * LANES..][..LANES].copy_from_slice(from);
            }
        }
        convolve(along, rows, &self.kernels[1], 1);
        for block in 0..n_blocks {
            let to = &mut self.images[start(block, self.to)..][..n_bins];
            for (to, row) in to.iter_mut().zip(along.chunks(stride)) {
                let mut more = Lanes::default();
                more.0.copy_from_slice(&row[block * LANES..][..LANES]);
                to.add(T::ONE, &more);
            }
        }
    }
}

/// Makes a work array of this length with arbitrary content.
#[inline(always)]
fn fit<T: Sample>(work: &mut Vec<T>, len: usize) {
    work.truncate(len);
    work.resize(len, T::ZERO);
}

/// Computes sums of samples and their neighbours at multiples of `step` with the weights of neighbours 0, 1, ...; the samples have enough
/// neighbours on either side of the sums.
#[inline(always)]
fn convolve<T: Sample>(sums: &mut [T], samples: &[T], weights: &[T], step: usize) {
    let middle = (weights.len() - 1) * step;
    for (sum, &x) in sums.iter_mut().zip(&samples[middle..]) {
        *sum = weights[0] * x;
    }
    let mut k = 1;
    while let Some(&weights) = weights[k..].first_chunk::<4>() {
        add_pairs(
            sums,
            samples,
            weights,
            [0, 1, 2, 3].map(|i| (k + i) * step),
            middle,
        );
        k += 4;
    }
    while let Some(&weights) = weights[k..].first_chunk::<1>() {
        add_pairs(sums, samples, weights, [k * step], middle);
        k += 1;
    }
}

/// Adds neighbours at this distance on both sides.
#[inline(always)]
fn add_pairs<T: Sample, const N: usize>(
    sums: &mut [T],
    samples: &[T],
    weights: [T; N],
    away: [usize; N],
    middle: usize,
) {
    let n = sums.len();
    let before = away.map(|away| &samples[middle - away..][..n]);
    let behind = away.map(|away| &samples[middle + away..][..n]);
    for i in 0..n {
        let mut sum = sums[i];
        for k in 0..N {
            sum += weights[k] * (before[k][i] + behind[k][i]);
        }
        sums[i] = sum;
    }
}
