//! Length, area, surface and volume of a spectral curve, by quadrature as accurate as the curve.

use std::f64::consts::PI;

use crate::chebyshev::gauss_legendre;
use crate::discrete::DiscreteMembrane;
use crate::measures::{Measure, Measures};
use crate::spectral::SpectralElements;

/// Values and derivatives at one quadrature point, as rows over the element's nodes.
struct Sample<'a> {
    weight: f64,
    value: &'a [f64],
    derivative: &'a [f64],
}

impl Sample<'_> {
    /// Position and derivative by the element's own coordinate.
    #[inline]
    fn at(&self, local: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
        let (mut c, mut d) = ([0.0; 2], [0.0; 2]);
        for ((value, derivative), node) in self.value.iter().zip(self.derivative).zip(local) {
            for k in 0..2 {
                c[k] += value * node[k];
                d[k] += derivative * node[k];
            }
        }
        (c, d)
    }
}

impl SpectralElements {
    /// Computes the four measures of the whole curve, defined as by [`Measure`], for the polynomials.
    pub(crate) fn integrate_all(&self, nodes: &[f64]) -> Measures {
        const ALL: [Measure; 4] = [
            Measure::Length,
            Measure::Area,
            Measure::Surface,
            Measure::Volume,
        ];
        let mut sums = [0.0; 4];
        for e in 0..self.n_elements() {
            let local = nodes[self.window(e)].as_chunks::<2>().0;
            self.each_sample(local, true, |sample| {
                let (c, d) = sample.at(local);
                for (sum, measure) in sums.iter_mut().zip(ALL) {
                    *sum += sample.weight * integrand(measure, c, d).0;
                }
            });
        }
        let [length, area, surface, volume] = sums;
        Measures {
            length,
            area: area + self.close_area(nodes, None),
            surface,
            volume,
        }
    }

    /// One measure of the whole curve; its gradient is added to `gradient`.
    pub(crate) fn integrate(
        &self,
        measure: Measure,
        nodes: &[f64],
        mut gradient: Option<&mut [f64]>,
    ) -> f64 {
        let mut total = 0.0;
        for e in 0..self.n_elements() {
            let local = nodes[self.window(e)].as_chunks::<2>().0;
            let mut out = gradient
                .as_deref_mut()
                .map(|g| g[self.window(e)].as_chunks_mut::<2>().0);
            let kinked = matches!(measure, Measure::Surface | Measure::Volume);
            self.each_sample(local, kinked, |sample| {
                let (c, d) = sample.at(local);
                let (value, by_c, by_d) = integrand(measure, c, d);
                total += sample.weight * value;
                if let Some(out) = &mut out {
                    for (j, out) in out.iter_mut().enumerate() {
                        for k in 0..2 {
                            out[k] += sample.weight
                                * (by_c[k] * sample.value[j] + by_d[k] * sample.derivative[j]);
                        }
                    }
                }
            });
        }
        if measure == Measure::Area {
            total += self.close_area(nodes, gradient);
        }
        total
    }

    /// Returns the range of the nodes of element `e` in a state.
    pub(crate) fn window(&self, e: usize) -> std::ops::Range<usize> {
        let p = self.degree();
        2 * e * p..2 * (e + 1) * p + 2
    }

    /// Calls `add` for each quadrature point of the element with nodes `local`; its mirror image
    /// counts in the weight. |y| has a kink where the curve crosses the axis: a function with this kink (`kinked`) is integrated separately
    /// on either side.
    fn each_sample(&self, local: &[[f64; 2]], kinked: bool, mut add: impl FnMut(Sample<'_>)) {
        let reference = &self.reference;
        let n = local.len();
        let copies = if self.is_half() { 2.0 } else { 1.0 };
        let crossings = if kinked {
            self.axis_crossings(local)
        } else {
            Vec::new()
        };
        if crossings.is_empty() {
            for (q, &(_, weight)) in reference.gauss.iter().enumerate() {
                add(Sample {
                    weight: copies * weight,
                    value: &reference.to_gauss[q * n..(q + 1) * n],
                    derivative: &reference.derivative_to_gauss[q * n..(q + 1) * n],
                });
            }
            return;
        }
        let mut value = vec![0.0; n];
        let starts = std::iter::once(0.0).chain(crossings.iter().copied());
        let ends = crossings.iter().copied().chain(std::iter::once(1.0));
        for (from, to) in starts.zip(ends) {
            for (t, weight) in gauss_legendre(reference.gauss.len()) {
                reference.value_row(from + (to - from) * t, &mut value);
                let derivative = reference.times_derivative(&value);
                add(Sample {
                    weight: copies * weight * (to - from),
                    value: &value,
                    derivative: &derivative,
                });
            }
        }
    }

    /// The chord that closes the area; under the mirror, its half from the axis to the first node.
    fn close_area(&self, nodes: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let (last, copies) = (nodes.len() - 2, if self.is_half() { 2.0 } else { 1.0 });
        let [x0, y0] = [nodes[0], nodes[1]];
        let [x1, y1] = if self.is_half() {
            [x0, 0.0]
        } else {
            [nodes[last], nodes[last + 1]]
        };
        if let Some(out) = gradient {
            // the ends are fixed; their gradient is included for completeness
            if self.is_half() {
                out[0] -= y0;
                out[1] -= x0;
            } else {
                out[0] += 0.5 * y1;
                out[1] -= 0.5 * x1;
                out[last] -= 0.5 * y0;
                out[last + 1] += 0.5 * x0;
            }
        }
        copies * 0.5 * (x0 * y1 - x1 * y0)
    }

    /// Returns the zeros of y inside an element, as fractions of it, ascending.
    fn axis_crossings(&self, local: &[[f64; 2]]) -> Vec<f64> {
        let mut found = Vec::new();
        let mut last: Option<usize> = None;
        for k in (0..local.len()).filter(|&k| local[k][1] != 0.0) {
            if let Some(before) = last
                && (local[before][1] < 0.0) != (local[k][1] < 0.0)
            {
                found.push(self.axis_crossing(local, before, k));
            }
            last = Some(k);
        }
        found
    }

    /// Returns the position on the axis between nodes `before` and `after`, which are on different sides.
    fn axis_crossing(&self, local: &[[f64; 2]], before: usize, after: usize) -> f64 {
        let mut row = vec![0.0; local.len()];
        let mut y = |t: f64| {
            self.reference.value_row(t, &mut row);
            row.iter().zip(local).map(|(a, c)| a * c[1]).sum::<f64>()
        };
        let (mut low, mut high) = (self.reference.nodes[before], self.reference.nodes[after]);
        let sign = local[before][1].signum();
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle;
            }
            if y(middle) * sign > 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
    }
}

/// The integrand over the element's own coordinate, with its derivatives by c and c'.
#[inline]
fn integrand(measure: Measure, c: [f64; 2], d: [f64; 2]) -> (f64, [f64; 2], [f64; 2]) {
    let speed = || d[0].hypot(d[1]);
    match measure {
        Measure::Length => {
            let speed = speed();
            (speed, [0.0; 2], [d[0] / speed, d[1] / speed])
        }
        // twice the area is the integral of y x' - x y'
        Measure::Area => (
            0.5 * (c[1] * d[0] - c[0] * d[1]),
            [-0.5 * d[1], 0.5 * d[0]],
            [0.5 * c[1], -0.5 * c[0]],
        ),
        Measure::Surface => {
            let (speed, y) = (speed(), PI * 0.5 * c[1].abs());
            let unit = [d[0] / speed, d[1] / speed];
            (
                2.0 * y * speed,
                [0.0, PI * c[1].signum() * speed],
                [2.0 * y * unit[0], 2.0 * y * unit[1]],
            )
        }
        Measure::Volume => {
            let y = 0.5 * PI * c[1] * c[1].abs();
            (y * d[0], [0.0, PI * c[1].abs() * d[0]], [y, 0.0])
        }
    }
}
