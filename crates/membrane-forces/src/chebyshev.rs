//! Polynomials through Chebyshev points of [0, 1], and Gauss-Legendre quadrature there.

use std::f64::consts::PI;

/// Tables shared by all elements of one degree.
#[derive(Debug, Clone)]
pub(crate) struct Reference {
    /// p + 1 Chebyshev points of the second kind, ascending from 0 to 1.
    pub(crate) nodes: Vec<f64>,
    /// Row i: d/dt at node i of the polynomial through values at the nodes.
    pub(crate) derivative: Vec<f64>,
    /// Gauss points and weights, enough to integrate products of three polynomials exactly.
    pub(crate) gauss: Vec<(f64, f64)>,
    /// Row q: values at Gauss point q.
    pub(crate) to_gauss: Vec<f64>,
    /// Row q: d/dt at Gauss point q.
    pub(crate) derivative_to_gauss: Vec<f64>,
}

impl Reference {
    pub(crate) fn new(degree: usize) -> Self {
        let p = degree as f64;
        // sin makes the points symmetric about 1/2 to the last bit
        let nodes: Vec<f64> = (0..=degree)
            .map(|k| 0.5 * (1.0 + (0.5 * PI * (2.0 * k as f64 - p) / p).sin()))
            .collect();
        let n = nodes.len();
        let mut derivative = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                if i != j {
                    // difference of nodes as a product of sines: no cancellation near the ends
                    let (a, b) = (PI * i as f64 / p, PI * j as f64 / p);
                    let difference = (0.5 * (a + b)).sin() * (0.5 * (a - b)).sin();
                    derivative[i * n + j] = weight(j, degree) / weight(i, degree) / difference;
                }
            }
            // rows sum to zero: the derivative of a constant vanishes exactly
            derivative[i * n + i] = -derivative[i * n..(i + 1) * n].iter().sum::<f64>();
        }
        // Even, so that no point of an element across the axis is on it.
        let gauss = gauss_legendre((3 * degree / 2 + 2).next_multiple_of(2));
        let mut reference = Self {
            nodes,
            derivative,
            to_gauss: Vec::new(),
            derivative_to_gauss: Vec::new(),
            gauss,
        };
        let mut row = vec![0.0; n];
        for q in 0..reference.gauss.len() {
            reference.value_row(reference.gauss[q].0, &mut row);
            reference.to_gauss.extend(&row);
            reference
                .derivative_to_gauss
                .extend(reference.times_derivative(&row));
        }
        reference
    }

    /// Returns the range of the nodes of element `e` in a state.
    pub(crate) fn window(&self, e: usize) -> std::ops::Range<usize> {
        let stride = 2 * (self.nodes.len() - 1);
        e * stride..(e + 1) * stride + 2
    }

    /// `row` . values = value at `t` of the polynomial through `values` at the nodes (barycentric).
    pub(crate) fn value_row(&self, t: f64, row: &mut [f64]) {
        let degree = self.nodes.len() - 1;
        if let Some(hit) = self.nodes.iter().position(|&node| node == t) {
            row.fill(0.0);
            row[hit] = 1.0;
            return;
        }
        let mut sum = 0.0;
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = weight(j, degree) / (t - self.nodes[j]);
            sum += *entry;
        }
        row.iter_mut().for_each(|entry| *entry /= sum);
    }

    /// `row` times the derivative matrix: evaluates the derivative where `row` evaluates values.
    pub(crate) fn times_derivative(&self, row: &[f64]) -> Vec<f64> {
        let n = self.nodes.len();
        (0..n)
            .map(|j| (0..n).map(|i| row[i] * self.derivative[i * n + j]).sum())
            .collect()
    }

    /// Coefficients of T_k(2 t - 1), k = 0 ..= p, of the polynomial through `values`.
    pub(crate) fn coefficients(&self, values: &[f64]) -> Vec<f64> {
        let degree = values.len() - 1;
        let p = degree as f64;
        let end = |k: usize| if k == 0 || k == degree { 0.5 } else { 1.0 };
        // node j lies at x_j = cos(pi (p - j) / p)
        let cosine =
            |k: usize, j: usize| (PI * ((k * (degree - j)) % (2 * degree)) as f64 / p).cos();
        let coefficient = |k: usize| {
            let terms = (0..=degree).map(|j| end(j) * values[j] * cosine(k, j));
            2.0 * end(k) * terms.sum::<f64>() / p
        };
        (0..=degree).map(coefficient).collect()
    }
}

/// Returns the sum of `row` times `points`.
#[inline]
pub(crate) fn combine(row: &[f64], points: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (factor, point) in row.iter().zip(points) {
        sum[0] += factor * point[0];
        sum[1] += factor * point[1];
    }
    sum
}

/// Barycentric weight of node j, up to a common factor.
fn weight(j: usize, degree: usize) -> f64 {
    let half = if j == 0 || j == degree { 0.5 } else { 1.0 };
    if j.is_multiple_of(2) { half } else { -half }
}

/// Halves the interval between `low` and `high` until they are neighbouring numbers; `is_high` is false below one position and true above.
pub(crate) fn bisect(mut low: f64, mut high: f64, mut is_high: impl FnMut(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if is_high(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
}

/// Points and weights on [0, 1] that integrate polynomials up to degree 2 n - 1 exactly.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    (0..n)
        .map(|k| {
            // Newton on the Legendre polynomial from Tricomi's estimate of its root
            let mut x = -(PI * (k as f64 + 0.75) / (count + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..10 {
                let (mut last, mut value) = (1.0, x);
                for j in 2..=n {
                    let j = j as f64;
                    (last, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * last) / j);
                }
                slope = count * (x * value - last) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}
