//! Few Gaussians instead of many.
//!
//! What is to be blurred by a variance V is shared out, linearly in the variance, between two of a few *nodes* of given variances
//! W_0 < W_1 < ... A mixture of two Gaussians of variances W and W + D in shares 1 - t and t has the variance W + t D asked for, exactly;
//! its peak (in the plane, 1 / (2 pi V)) is higher by the part t (1 - t) (D / V)^2, at most a quarter of (D / V)^2. Nodes stand as close
//! as the tolerance for that asks.

use crate::RadonError;
use crate::error::within;

/// Most nodes: blurs of a view.
const MOST: f64 = 1e5;

/// Nodes for some variances.
#[derive(Debug)]
pub(crate) struct Nodes {
    /// Variances of the nodes, in growing order; the first is the least one asked for.
    pub(crate) variances: Vec<f64>,
    /// For each variance asked for, the node below it and the share of the one above.
    pub(crate) shares: Vec<(usize, f64)>,
}

impl Nodes {
    /// For these variances (cm^2, finite and >= 0), bins and rows of this `pitch` (cm) and this `tolerance` of a peak, relative to it.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for more than [`MOST`] of them.
    pub(crate) fn new(asked: &[f64], pitch: [f64; 2], tolerance: f64) -> Result<Self, RadonError> {
        let far = asked.iter().fold(0.0, |m: f64, &v| m.max(v));
        let near = asked.iter().fold(far, |m: f64, &v| m.min(v));
        // Bins are wide themselves: V counts from 1/6 of a bin's square, the variance of a hat.
        let growth = 2.0 * tolerance.sqrt();
        let own = pitch[0].min(pitch[1]).powi(2) / 6.0;
        // Each is wider by the same factor; of bins without any width there would be no end of them.
        let n = ((far + own) / (near + own)).ln() / growth.ln_1p();
        within(
            "Gaussians of a blur",
            if far > near { n } else { 0.0 },
            0.0,
            MOST,
        )?;
        let (mut variances, mut last) = (vec![near], near);
        while last < far {
            // Not beyond the farthest, so that none reaches farther.
            last = (last + growth * (last + own)).min(far);
            variances.push(last);
        }
        let share = |&variance: &f64| {
            let j = variances.partition_point(|&w| w <= variance).max(1) - 1;
            match variances.get(j + 1) {
                Some(next) => (j, (variance - variances[j]) / (next - variances[j])),
                None => (j, 0.0),
            }
        };
        let shares = asked.iter().map(share).collect();
        Ok(Self { variances, shares })
    }
}
