//! The Kaiser-Bessel function that spreads a sample of the spectrum over neighbouring cells of a grid.
//!
//! ```text
//! phi(x)   = I0(beta sqrt(1 - (2 x / W)^2)) / I0(beta)         |x| <= W/2 cells, else 0
//! phi^(xi) = W sinh(r) / (r I0(beta))                          r^2 = beta^2 - (pi W xi)^2, xi in waves per cell
//! ```
//!
//! with the beta of Beatty, Nishimura and Pauly 2005, doi:10.1109/TMI.2005.848376, eq. 5. On a grid twice as fine as required by the image the error
//! of W cells is 7 10^-W; `the_tolerance_is_kept` measures it.

use std::f64::consts::PI;

use crate::Sample;
use crate::simd::{LANES, Taps};

/// Oversampling of the spectrum's grid.
pub(super) const FINER: f64 = 2.0;

/// Width and shape of the function.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Number of cells along either axis.
    pub(super) width: usize,
    beta: f64,
}

impl Shape {
    /// Chooses the shape for an error of `tolerance` relative to the image; at least 1e-6, which eight cells reach.
    pub(super) fn for_tolerance(tolerance: f64) -> Self {
        // Four cells have an error of 7e-4 in the plane; each further cell divides it by ten.
        let width = (0.9 - tolerance.log10()).ceil() as usize;
        // The kernels implement these widths only.
        let width = [4, 5, 6]
            .into_iter()
            .find(|&w| width <= w)
            .unwrap_or(LANES / 2);
        let w = width as f64;
        let beta = PI * ((w / FINER * (FINER - 0.5)).powi(2) - 0.8).sqrt();
        Self { width, beta }
    }

    fn value(self, x: f64) -> f64 {
        let inside = 1.0 - (2.0 * x / self.width as f64).powi(2);
        bessel(self.beta * inside.max(0.0).sqrt()) / bessel(self.beta)
    }

    /// Returns phi^ at a frequency in waves per cell, at most 1/2.
    pub(super) fn transform(self, waves: f64) -> f64 {
        // The zero of r is beyond 0.7 waves per cell.
        let w = self.width as f64;
        let r = (self.beta.powi(2) - (PI * w * waves).powi(2)).sqrt();
        w * (r.sinh() / r) / bessel(self.beta)
    }

    /// Returns the weights of the cells about a position as polynomials in the position within a cell.
    pub(super) fn taps<T: Sample>(self) -> Taps<T> {
        let n = self.width + 4;
        let node = |i: usize| (PI * (i as f64 + 0.5) / n as f64).cos();
        let mut across = vec![[T::ZERO; LANES]; n];
        let mut along = across.clone();
        for tap in 0..self.width {
            // Distance of the cell from a position z in [-1, 1] within the first one.
            let first = tap as f64 + 1.0 - self.width as f64 / 2.0;
            let values: Vec<f64> = (0..n)
                .map(|i| self.value(first - (1.0 + node(i)) / 2.0))
                .collect();
            for (power, coefficient) in interpolated(&values).into_iter().enumerate() {
                let value = T::of(coefficient);
                across[n - 1 - power][tap] = value;
                along[n - 1 - power][2 * tap] = value;
                along[n - 1 - power][2 * tap + 1] = value;
            }
        }
        Taps {
            width: self.width,
            across,
            along,
        }
    }
}

/// Returns the coefficients, highest power first, of the polynomial through values at the Chebyshev nodes.
fn interpolated(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let mut sum = vec![0.0; n];
    // T_0, T_1, ... by their recurrence, as coefficients of powers.
    let (mut last, mut this) = (vec![0.0; n], vec![0.0; n]);
    this[0] = 1.0;
    for order in 0..n {
        let angle = |i: usize| PI * order as f64 * (i as f64 + 0.5) / n as f64;
        let scale = if order == 0 { 1.0 } else { 2.0 } / n as f64;
        let weight: f64 = (values.iter().enumerate())
            .map(|(i, v)| v * angle(i).cos())
            .sum();
        let factor = if order == 0 { 1.0 } else { 2.0 };
        let mut next: Vec<f64> = last.iter().map(|c| -c).collect();
        for power in 0..n {
            sum[power] += scale * weight * this[power];
            if power > 0 {
                next[power] += factor * this[power - 1];
            }
        }
        last = std::mem::replace(&mut this, next);
    }
    sum
}

/// The modified Bessel function I0 by its power series, whose terms are all positive.
fn bessel(x: f64) -> f64 {
    let square = x * x / 4.0;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= square / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomials_agree_with_the_function_and_its_transform_with_its_integral() {
        for tolerance in [1e-3, 1e-4, 1e-5, 1e-6] {
            let shape = Shape::for_tolerance(tolerance);
            let taps = shape.taps::<f64>();
            for i in 0..=40 {
                let z = f64::from(i) / 20.0 - 1.0;
                for tap in 0..shape.width {
                    let sum = taps.across.iter().fold(0.0, |sum, c| sum * z + c[tap]);
                    let x = tap as f64 + 1.0 - shape.width as f64 / 2.0 - (1.0 + z) / 2.0;
                    assert!(
                        (sum - shape.value(x)).abs() < 0.1 * tolerance,
                        "{tolerance}"
                    );
                }
            }
            for waves in [0.0, 0.1, 0.25, 0.5] {
                // The trapezoidal rule; the function ends in steps of 1 / I0(beta).
                let (n, w) = (20_000, shape.width as f64);
                let h = w / f64::from(n);
                let integral: f64 = (0..n)
                    .map(|i| (f64::from(i) + 0.5) * h - w / 2.0)
                    .map(|x| h * shape.value(x) * (2.0 * PI * waves * x).cos())
                    .sum();
                assert!((integral - shape.transform(waves)).abs() < 1e-7);
            }
        }
    }
}
