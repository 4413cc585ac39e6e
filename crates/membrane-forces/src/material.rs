//! What spectral elements are made of: where they end, their springs as matrices.

use crate::chebyshev::{Reference, gauss_legendre};
use crate::error::MembraneError;
use crate::membrane::Membrane;

#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Rest positions at the nodes, as this element continues them.
    pub(crate) rest: Vec<[f64; 2]>,
    /// Row i of d/ds lambda d/ds; first row lambda d/ds, last row -lambda d/ds at the end points.
    pub(crate) elastic: Vec<f64>,
}

/// The matrix of [`Element::elastic`] from the stiffness at the nodes of an element of this length.
pub(crate) fn elastic_matrix(reference: &Reference, stiffness: &[f64], length: f64) -> Vec<f64> {
    let n = stiffness.len();
    let d = &reference.derivative;
    let mut elastic = vec![0.0; n * n];
    for j in 0..n {
        for i in 1..n - 1 {
            let sum: f64 = (0..n)
                .map(|k| d[i * n + k] * stiffness[k] * d[k * n + j])
                .sum();
            elastic[i * n + j] = sum / (length * length);
        }
        elastic[j] = stiffness[0] * d[j] / length;
        elastic[(n - 1) * n + j] = -stiffness[n - 1] * d[(n - 1) * n + j] / length;
    }
    elastic
}

/// Integral of 1 / lambda between `from` and `to`: a Gauss rule on more and more panels until it
/// no longer changes, whatever the degree of the elements.
pub(crate) fn compliance(membrane: &Membrane, from: f64, to: f64) -> Result<f64, MembraneError> {
    let rule = gauss_legendre(20);
    let mut last = f64::INFINITY;
    for panels in (0..8).map(|k| 1 << k) {
        let width = (to - from) / f64::from(panels);
        let mut sum = 0.0;
        for panel in 0..panels {
            for (t, weight) in &rule {
                let s = from + width * (f64::from(panel) + t);
                sum += weight * width / membrane.effective_stiffness(s)?;
            }
        }
        if (sum - last).abs() <= 1e-14 * sum {
            return Ok(sum);
        }
        last = sum;
    }
    Ok(last)
}

/// Where rest shape or stiffness is not smooth, on [0, 1] or, cut at the apex, on [0, 1/2].
pub(crate) fn breakpoints(membrane: &Membrane, half: bool) -> Vec<f64> {
    let mut all = membrane.rest().breakpoints().to_vec();
    all.extend(membrane.stiffness().breakpoints());
    if let Some(second) = membrane.second_neighbours() {
        all.extend(second.breakpoints());
    }
    if half {
        all.retain(|&b| b < 0.5);
        all.push(0.5);
    }
    all.sort_by(f64::total_cmp);
    // breakpoints of different origin that mean the same place
    all.dedup_by(|b, a| *b - *a < 1e-12);
    // the end stays where it is, whatever came just before it
    if let Some(last) = all.last_mut() {
        *last = if half { 0.5 } else { 1.0 };
    }
    all
}
