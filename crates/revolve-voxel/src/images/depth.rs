//! Interpolation of a response in depth.
//!
//! The response to a point at depth t is a Gaussian of the standard deviation sigma(t) along u and v. Between the ends of a range of depths it is
//! interpolated by the polynomial through its values at n Chebyshev nodes `t_j`:
//!
//! ```text
//! g(u, v; sigma(t)) = sum over j of L_j(t) g(u, v; sigma(t_j)) + remainder
//! ```
//!
//! so that a ray is represented by the n integrals of `L_j` times its activity. They converge exponentially in n, because sigma is analytic; the
//! largest integral of the absolute remainder over u and v is computed, and bounds the error of an image relative to its largest line integral.

use crate::RevolveError;
use crate::error::{finite, positive};
use crate::images::rule::gauss;
use crate::rays::assembly::Emission;
use crate::rays::slabs::mean_transmission;

/// Most nodes.
const MOST: usize = 40;
/// Number of radii at which the remainder is computed, up to the largest one in units of the largest standard deviation.
const RADII: usize = 160;
const FAR: f64 = 8.0;
/// Ratio of the stated error to the largest remainder at these radii and between neighbouring nodes: remainders elsewhere are less than 1 %
/// larger.
const MARGIN: f64 = 1.02;
/// Largest attenuation of a part of a stretch that one rule integrates.
const THICK: f64 = 2.0;

/// The standard deviations of a detector's response over a range of depths.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthResponse {
    /// Middle and half of the range.
    range: [f64; 2],
    /// Standard deviations at the nodes.
    pub(super) sigmas: Vec<f64>,
    /// `[j][k]`: from the integrals of Chebyshev polynomials to those of `L_j`.
    to_nodes: Vec<f64>,
    error: f64,
}

impl DepthResponse {
    /// A response of one standard deviation (cm, may be zero) for all depths.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::Negative`].
    pub fn constant(sigma: f64) -> Result<Self, RevolveError> {
        if finite("standard deviation", sigma)? < 0.0 {
            let what = "standard deviation";
            return Err(RevolveError::Negative { what, given: sigma });
        }
        Ok(Self {
            range: [0.0, 1.0],
            sigmas: vec![sigma],
            to_nodes: vec![1.0],
            error: 0.0,
        })
    }

    /// A response with the standard deviation `sigma(t)` (cm, positive) at parameters t of rays from `low` to `high`, to a `tolerance`:
    /// [`DepthResponse::error`] is at most this, unless 40 nodes do not suffice.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`] for a standard deviation, the tolerance and `high - low`.
    pub fn new(
        sigma: impl Fn(f64) -> f64,
        [low, high]: [f64; 2],
        tolerance: f64,
    ) -> Result<Self, RevolveError> {
        positive("tolerance", tolerance)?;
        positive("range of depths", high - low)?;
        let range = [0.5 * (low + high), 0.5 * (high - low)];
        let at = |x: f64| positive("standard deviation", sigma(range[0] + range[1] * x));
        let mut n = 1;
        loop {
            let nodes: Vec<f64> = (0..n).map(|j| node(n, j)).collect();
            let sigmas = nodes
                .iter()
                .map(|x| at(*x))
                .collect::<Result<Vec<_>, _>>()?;
            let mut made = Self {
                range,
                sigmas,
                to_nodes: to_nodes(&nodes),
                error: 0.0,
            };
            made.error = made.remainder(&at)?;
            if made.error <= tolerance || n == MOST {
                return Ok(made);
            }
            n += 1;
        }
    }

    /// Returns a bound on the integral of the absolute remainder of the response to a point, which bounds the error of an image relative to
    /// its largest line integral.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Returns the number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.sigmas.len()
    }

    /// Returns the smallest and the largest standard deviation of the nodes.
    #[must_use]
    pub fn extremes(&self) -> [f64; 2] {
        let fold = |f: fn(f64, f64) -> f64, start: f64| self.sigmas.iter().copied().fold(start, f);
        [fold(f64::min, f64::INFINITY), fold(f64::max, 0.0)]
    }

    /// Returns a bound on the `2 pi` integral over r of `r |sum L_j(t) g(r; sigma_j) - g(r; sigma(t))|`.
    ///
    /// Between two changes of sign the integral is a difference of `sum L_j(t) exp(-r^2 / 2 sigma_j^2) - exp(-r^2 / 2 sigma(t)^2)`, so the
    /// whole one is the total variation of this function. Radii grow geometrically beyond the least standard deviation.
    fn remainder(
        &self,
        sigma: &impl Fn(f64) -> Result<f64, RevolveError>,
    ) -> Result<f64, RevolveError> {
        let n = self.n_nodes();
        // between the nodes and at the ends, where the product of the distances from the nodes is largest
        let depths = (0..=n).map(|k| -(std::f64::consts::PI * k as f64 / n as f64).cos());
        let depths = depths.map(|x| Ok((x, sigma(x)?)));
        let depths: Vec<(f64, f64)> = depths.collect::<Result<_, RevolveError>>()?;
        let (least, widest) = depths
            .iter()
            .map(|depth| depth.1)
            .fold((f64::INFINITY, 0.0), |(least, widest): (f64, f64), own| {
                (least.min(own), widest.max(own))
            });
        let reach = (FAR * widest / least).asinh() / RADII as f64;
        let radii: Vec<f64> = (1..=RADII)
            .map(|k| least * (reach * k as f64).sinh())
            .collect();
        let outside = |r: f64, sigma: f64| (-0.5 * (r / sigma).powi(2)).exp();
        let of_nodes: Vec<f64> = radii
            .iter()
            .flat_map(|r| self.sigmas.iter().map(|sigma| outside(*r, *sigma)))
            .collect();
        let mut worst = 0.0f64;
        for (x, own) in depths {
            let mut polynomials = vec![0.0; n];
            chebyshev(x, &mut polynomials);
            let mut basis = vec![0.0; n];
            self.add_nodes(&polynomials, &mut basis);
            let (mut variation, mut last) = (0.0, 0.0);
            for (r, of_nodes) in radii.iter().zip(of_nodes.chunks_exact(n)) {
                let mixed: f64 = basis.iter().zip(of_nodes).map(|(l, of)| l * of).sum();
                let next = mixed - outside(*r, own);
                variation += (next - last).abs();
                last = next;
            }
            worst = worst.max(variation + last.abs());
        }
        Ok(MARGIN * worst)
    }

    /// Adds the integrals (or values) of `L_j`, from those of the Chebyshev polynomials.
    #[inline(always)]
    pub(super) fn add_nodes(&self, integrals: &[f64], nodes: &mut [f64]) {
        let n = integrals.len();
        for (node, row) in nodes.iter_mut().zip(self.to_nodes.chunks_exact(n)) {
            *node += row.iter().zip(integrals).map(|(a, b)| a * b).sum::<f64>();
        }
    }

    /// Adds the integrals of `amount exp(-attenuation (q - t))` between the ends p and q times each Chebyshev polynomial.
    #[inline(always)]
    pub(super) fn add_integrals(
        &self,
        &Emission {
            ends: [p, q],
            amount,
            attenuation,
        }: &Emission,
        integrals: &mut [f64],
    ) {
        let n = integrals.len();
        if n == 1 {
            integrals[0] += amount * (q - p) * mean_transmission(attenuation * (q - p));
            return;
        }
        let parts = (attenuation * (q - p) / THICK).ceil().clamp(1.0, 64.0);
        let part = (q - p) / parts;
        // A polynomial of degree n - 1 has this degree over the whole range only.
        let degree = (n as f64 * (0.5 * part / self.range[1]).min(1.0).sqrt()).ceil() as usize;
        let rule = gauss(3 + degree.div_ceil(2));
        let half = 0.5 * part;
        let mut add = |t: f64, weight: f64| {
            let x = ((t - self.range[0]) / self.range[1]).clamp(-1.0, 1.0);
            let (mut before, mut own) = (1.0, x);
            integrals[0] += weight;
            for sum in &mut integrals[1..] {
                *sum += weight * own;
                (before, own) = (own, 2.0 * x * own - before);
            }
        };
        for k in 0..parts as usize {
            let middle = q - (k as f64 + 0.5) * part;
            let amount = amount * half * (-attenuation * (q - middle)).exp();
            // The rule is symmetric.
            let (left, right) = rule.split_at(rule.len() / 2);
            for (&[_, weight], &[x, _]) in left.iter().zip(right.iter().rev()) {
                let shift = half * x;
                let [grows, falls] = exponentials(attenuation * shift);
                add(middle + shift, amount * weight * grows);
                add(middle - shift, amount * weight * falls);
            }
            if right.len() > left.len() {
                add(middle, amount * right[0][1]);
            }
        }
    }
}

/// `1 / (2 k)!` and `1 / (2 k + 1)!`.
const TAYLOR: [[f64; 2]; 8] = [
    [1.0, 1.0],
    [1.0 / 2.0, 1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 120.0],
    [1.0 / 720.0, 1.0 / 5040.0],
    [1.0 / 40_320.0, 1.0 / 362_880.0],
    [1.0 / 3_628_800.0, 1.0 / 39_916_800.0],
    [1.0 / 479_001_600.0, 1.0 / 6_227_020_800.0],
    [1.0 / 87_178_291_200.0, 1.0 / 1_307_674_368_000.0],
];

/// Returns `exp(y)` and `exp(-y)`; up to y = 1 by the Taylor series of cosh and sinh, to 5e-14.
#[inline(always)]
fn exponentials(y: f64) -> [f64; 2] {
    if y > 0.5 * THICK {
        return [y.exp(), (-y).exp()];
    }
    let square = y * y;
    let [even, odd] = TAYLOR.iter().rev().fold([0.0; 2], |[even, odd], [a, b]| {
        [even * square + a, odd * square + b]
    });
    [even + y * odd, even - y * odd]
}

/// Chebyshev node `j` of n.
fn node(n: usize, j: usize) -> f64 {
    -(std::f64::consts::PI * (j as f64 + 0.5) / n as f64).cos()
}

/// Writes the values of the Chebyshev polynomials.
fn chebyshev(x: f64, polynomials: &mut [f64]) {
    let (mut own, mut next) = (1.0, x);
    for value in polynomials {
        *value = own;
        (own, next) = (next, 2.0 * x * next - own);
    }
}

/// `L_j = sum over k of (2 - [k = 0]) / n T_k(x_j) T_k`.
fn to_nodes(nodes: &[f64]) -> Vec<f64> {
    let n = nodes.len();
    let mut matrix = vec![0.0; n * n];
    for (row, x) in matrix.chunks_mut(n).zip(nodes) {
        chebyshev(*x, row);
        row.iter_mut().for_each(|value| *value *= 2.0 / n as f64);
        row[0] *= 0.5;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// GE LEHR holes in front of a crystal of 3.8 mm, at R = 20 cm.
    fn sigma(t: f64) -> f64 {
        let fwhm = (0.15 / 3.4257 * (3.4257 + 20.0 - t)).hypot(0.38);
        fwhm / (8.0 * 2f64.ln()).sqrt()
    }

    #[test]
    fn integrals_agree_with_a_dense_rule() {
        let response = DepthResponse::new(sigma, [-12.0, 18.0], 1e-6).unwrap();
        let n = response.n_nodes();
        for ([p, q], mu) in [
            ([-12.0, 18.0], 0.0),
            ([-12.0, 18.0], 0.15),
            ([3.0, 3.5], 0.3),
            ([-5.0, 6.0], 0.15),
            ([-2.0, -1.9], 40.0),
            ([-8.0, 4.0], 5.0),
        ] {
            let mut integrals = vec![0.0; n];
            let own = Emission {
                ends: [p, q],
                amount: 2.0,
                attenuation: mu,
            };
            response.add_integrals(&own, &mut integrals);
            let mut exact = vec![0.0; n];
            let steps = 40_000;
            for k in 0..steps {
                let t = p + (q - p) * (f64::from(k) + 0.5) / f64::from(steps);
                let mut polynomials = vec![0.0; n];
                chebyshev((t - 3.0) / 15.0, &mut polynomials);
                let weight = 2.0 * (-mu * (q - t)).exp() * (q - p) / f64::from(steps);
                exact
                    .iter_mut()
                    .zip(polynomials)
                    .for_each(|(sum, v)| *sum += weight * v);
            }
            for (own, exact) in integrals.iter().zip(&exact) {
                // The midpoint rule of the reference: mu^2 h^2 / 24.
                assert!(
                    (own - exact).abs() < 2e-6 * integrals[0],
                    "{p} {q} {mu}: {own} {exact}"
                );
            }
        }
    }

    #[test]
    fn exponentials_are_exact() {
        for k in 0..=400 {
            let y = 0.005 * f64::from(k);
            for (own, exact) in exponentials(y).into_iter().zip([y.exp(), (-y).exp()]) {
                // The first omitted term, 1 / 16!, and rounding.
                assert!((own - exact).abs() < 6e-14, "{y}: {own} {exact}");
            }
        }
    }
}
