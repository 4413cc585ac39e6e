//! Length, area, surface and volume of a spectral curve, by quadrature as accurate as the curve.

use crate::chebyshev::{bisect, gauss_legendre};
use crate::discrete::DiscreteMembrane;
use crate::measures::{Measure, copies};
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
    /// Computes `measures` of the whole curve, defined as by [`Measure`], for the polynomials.
    pub(crate) fn integrate<const N: usize>(
        &self,
        measures: [Measure; N],
        nodes: &[f64],
    ) -> [f64; N] {
        let kinked = measures.iter().any(|measure| measure.has_kink());
        let mut sums = [0.0; N];
        for e in 0..self.n_elements() {
            let local = nodes[self.reference.window(e)].as_chunks::<2>().0;
            self.each_sample(local, kinked, |sample| {
                let (c, d) = sample.at(local);
                for (sum, measure) in sums.iter_mut().zip(measures) {
                    *sum += sample.weight * measure.integrand(c, d).0;
                }
            });
        }
        for (sum, measure) in sums.iter_mut().zip(measures) {
            if let Some((chord, ..)) = measure.closing(nodes.as_chunks().0, self.is_half()) {
                *sum += copies(self.is_half()) * chord.value;
            }
        }
        sums
    }

    pub(crate) fn add_gradient(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        for e in 0..self.n_elements() {
            let window = self.reference.window(e);
            let local = nodes[window.clone()].as_chunks::<2>().0;
            let out = out[window].as_chunks_mut::<2>().0;
            self.each_sample(local, measure.has_kink(), |sample| {
                let (c, d) = sample.at(local);
                let (_, by_c, by_d) = measure.integrand(c, d);
                let Sample {
                    weight,
                    value,
                    derivative,
                } = sample;
                for ((out, value), derivative) in out.iter_mut().zip(value).zip(derivative) {
                    for k in 0..2 {
                        out[k] += weight * (by_c[k] * value + by_d[k] * derivative);
                    }
                }
            });
        }
        if let Some((chord, a, b)) = measure.closing(nodes.as_chunks().0, self.is_half()) {
            chord.add_gradient(copies(self.is_half()), [a, b], out.as_chunks_mut().0);
        }
    }

    /// Calls `add` for each quadrature point of the element with nodes `local`; its mirror image counts in the weight. |y| has a kink where
    /// the curve crosses the axis: a function with this kink (`kinked`) is integrated separately on either side.
    fn each_sample(&self, local: &[[f64; 2]], kinked: bool, mut add: impl FnMut(Sample<'_>)) {
        let reference = &self.reference;
        let n = local.len();
        let copies = copies(self.is_half());
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

    /// Returns the zeros of y inside an element, as fractions of it, ascending.
    fn axis_crossings(&self, local: &[[f64; 2]]) -> Vec<f64> {
        let (mut found, mut row) = (Vec::new(), vec![0.0; local.len()]);
        let mut last: Option<usize> = None;
        for k in (0..local.len()).filter(|&k| local[k][1] != 0.0) {
            if let Some(before) = last
                && (local[before][1] < 0.0) != (local[k][1] < 0.0)
            {
                let [low, high] = [before, k].map(|k| self.reference.nodes[k]);
                let below = local[before][1] < 0.0;
                found.push(bisect(low, high, |t| {
                    self.reference.value_row(t, &mut row);
                    let y = row.iter().zip(local).map(|(a, c)| a * c[1]);
                    (y.sum::<f64>() < 0.0) != below
                }));
            }
            last = Some(k);
        }
        found
    }
}
