//! Few Gaussians instead of many, with their error.
//!
//! The reference convolves the content of each depth with the [lattice Gaussian](crate::lattice) K of its own variance V. Instead, a few
//! *nodes* of variances W_0 < W_1 < ... are convolved, and content of variance V = W + t D between two nodes W and W + D is divided between
//! them in the fractions 1 - t and t. Its variance is exact. All weights are >= 0.
//!
//! The tolerance tau is the largest deviation of a point's image, relative to its peak. It is divided between two causes:
//!
//! 1. *Node spacing.* A divided point has too high a peak, for wide Gaussians by the fraction t (1 - t) D^2 / (W (W + D)) in the plane.
//!    Its maximum s is reached at D = W (2 s + 2 sqrt(s + s^2)). Where an axis has a variance near one bin or less, the peaks of K
//!    themselves give the largest D.
//! 2. *Truncation.* Weights below [`CUT`] times tau of the central one are dropped.

use crate::RadonError;
use crate::error::within;
use crate::lattice::{lattice_gaussian, peak};

/// Largest number of nodes, each a blur of a view.
const MOST: f64 = 1e5;
/// Largest number of weights of all kernels along an axis: 800 MB.
const MOST_WEIGHTS: f64 = 1e8;
/// The part of the tolerance that truncation may take.
const TRUNCATED: f64 = 0.1;
/// Weights below this part of the tolerance are dropped: two axes change a peak by at most 0.08 of the tolerance.
const CUT: f64 = 0.015;

/// Kernels of a node: weights of neighbours 0, 1, ... along bins and rows.
type Kernels = [Vec<f64>; 2];

/// Nodes for a range of variances.
#[derive(Debug, Clone)]
pub(super) struct Nodes {
    /// Variances (cm^2), ascending; the first is the smallest one required, the last the largest.
    variances: Vec<f64>,
    /// Kernel of each node.
    pub(super) kernels: Vec<Kernels>,
}

impl Nodes {
    /// Chooses nodes for variances from `near` to `far` (cm^2, finite and >= 0), bins and rows of `pitch` (cm) and a `tolerance` of the peak.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for more than 1e5 nodes or 1e8 weights, [`RadonError::TooLarge`].
    pub(super) fn new(
        [near, far]: [f64; 2],
        pitch: [f64; 2],
        tolerance: f64,
    ) -> Result<Self, RadonError> {
        let finest = pitch[0].min(pitch[1]);
        let excess = (1.0 - TRUNCATED) * tolerance / (1.0 + TRUNCATED * tolerance);
        // Nearly equal spacing below a sixth of a bin squared; beyond, each is wider by at least the same factor.
        let own = finest / 6.0 * finest;
        let most = ((far + own) / (near + own)).ln() / wide_step(1.0, excess).ln_1p();
        let most = if far > near { most } else { 0.0 };
        within("Gaussians of a blur", most, 0.0, MOST)?;
        let reach = (-2.0 * (CUT * tolerance).ln()).sqrt() * far.sqrt() / finest;
        within("weights of a blur", (1.0 + most) * reach, 0.0, MOST_WEIGHTS)?;
        let (mut variances, mut kernels) = (Vec::new(), Vec::new());
        let mut next = near;
        loop {
            let kernel = |pitch: f64| lattice_gaussian(next / pitch / pitch, CUT * tolerance);
            kernels.push([kernel(pitch[0])?, kernel(pitch[1])?]);
            variances.push(next);
            if next >= far {
                return Ok(Self { variances, kernels });
            }
            next += step(next, far - next, pitch, excess)?;
        }
    }

    /// Returns the node below a variance, and the fraction of the next one.
    pub(super) fn fraction(&self, variance: f64) -> (usize, f64) {
        let nodes = &self.variances;
        let j = nodes.partition_point(|&w| w <= variance).max(1) - 1;
        match nodes.get(j + 1) {
            Some(next) => (j, ((variance - nodes[j]) / (next - nodes[j])).max(0.0)),
            None => (j, 0.0),
        }
    }
}

/// Returns the largest distance from a node of variance `w` to the next, at most `most`, at which the peak of a point in between is too
/// high by the fraction `excess`.
fn step(w: f64, most: f64, pitch: [f64; 2], excess: f64) -> Result<f64, RadonError> {
    let peak = |v: f64| {
        Ok::<f64, RadonError>(peak(v / pitch[0] / pitch[0])? * peak(v / pitch[1] / pitch[1])?)
    };
    let near = peak(w)?;
    let found = |d: f64| {
        let far = peak(w + d)?;
        let mut worst = 0.0f64;
        // The maximum is near the middle, and flat.
        for t in [0.35, 0.45, 0.5, 0.55, 0.65] {
            worst = worst.max(((1.0 - t) * near + t * far) / peak(w + t * d)? - 1.0);
        }
        Ok::<f64, RadonError>(worst)
    };
    let mut d = most;
    let [mut low, mut high] = [0.0, most];
    for _ in 0..60 {
        let e = found(d)?;
        if e <= excess {
            low = d;
            if d >= most || e >= 0.97 * excess {
                break;
            }
        } else {
            high = d;
        }
        // Distance for this excess of a wide Gaussian.
        let alike = 0.5 * d * ((1.0 + e.recip()).sqrt() - 1.0);
        d = wide_step(alike, 0.985 * excess);
        if !(d > low && d < high) {
            d = 0.5 * (low + high);
        }
    }
    // A point far narrower than a bin has no smallest distance; this limit ends the caller's loop.
    Ok(low.max(1e-15 * most))
}

/// Returns the distance from a wide Gaussian of variance `w` to the next for this relative excess of a peak.
fn wide_step(w: f64, excess: f64) -> f64 {
    2.0 * w * (excess + (excess + excess * excess).sqrt())
}
