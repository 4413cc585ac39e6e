//! Springs between the nodes of finite differences, and of spectral elements.
//!
//! A spring pulls with its stiffness times the difference of the displacements u = c - c0 of its ends: in the limit of fine meshes the
//! force is (lambda u')', the energy the integral of lambda |u'|^2 / 2. Force and energy are those of straight springs of zero natural
//! length, so the tangent does not depend on the state, x and y do not mix, and there is no hoop tension. The energy uses this, and in
//! `membrane-implicit` the implicit splitting and the account of a scheme's own losses.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::chebyshev::{Reference, combine, gauss_legendre};
use crate::discrete::Elastic;
use crate::error::Result;
use crate::law::PressureLaw;
use crate::membrane::{Membrane, SAME};
use crate::nodes::Nodes;
use crate::profile::Stiffness;
use crate::tangent::{Layout, Tangent, local_index};

/// Springs between the nodes of finite differences.
#[derive(Debug)]
pub(crate) struct NodeSprings {
    law: PressureLaw,
    pub(crate) nodes: Nodes,
    ds: f64,
    /// Reference positions of the nodes of the state.
    rest: Vec<f64>,
    /// lambda at s_(n + 1/2), between neighbours of the whole curve.
    first: Vec<f64>,
    /// lambda_2 at s_n, between the neighbours of a node, or empty.
    second: Vec<f64>,
}

impl NodeSprings {
    /// Creates the springs between the nodes of the whole curve `rest`, with stiffnesses lambda and lambda_2.
    pub(crate) fn new(
        law: PressureLaw,
        (first, second): (&Stiffness, Option<&Stiffness>),
        rest: &[f64],
    ) -> Result<Self> {
        let last = rest.len() / 2 - 1;
        let first = (0..last).map(|n| first.at((n as f64 + 0.5) / last as f64));
        let second = second.map(|second| (0..=last).map(|n| second.at(n as f64 / last as f64)));
        Ok(Self {
            law,
            nodes: Nodes::all(last + 1),
            ds: 1.0 / last as f64,
            rest: rest.to_vec(),
            first: first.collect::<Result<_>>()?,
            second: second.into_iter().flatten().collect::<Result<_>>()?,
        })
    }

    /// Keeps the nodes up to the axis.
    pub(crate) fn half(mut self) -> Self {
        self.nodes = self.nodes.half();
        self.nodes.cut(&mut self.rest);
        self
    }

    /// Returns target and stiffness of the springs from moving node `n` to its second neighbours; beside an end the target is the mirror
    /// image of the neighbour, twice as far away as the end.
    fn second_springs(&self, n: usize) -> [(usize, f64); 2] {
        let (second, last) = (&self.second, self.nodes.whole - 1);
        [
            if n + 1 < last {
                (n + 2, second[n + 1])
            } else {
                (last, second[last] * 2.0)
            },
            if n > 1 {
                (n - 2, second[n - 1])
            } else {
                (0, second[0] * 2.0)
            },
        ]
    }

    /// Returns c(n+1) - c(n-1) and its factor in the pressure law.
    fn normal(&self, state: &[f64], n: usize) -> Result<([f64; 2], f64)> {
        let next = self.nodes.node(state, n + 1);
        let d = [next[0] - state[2 * n - 2], next[1] - state[2 * n - 1]];
        Ok((d, self.law.factor(d, 2.0 * self.ds, n)?))
    }
}

impl Elastic for NodeSprings {
    fn scale(&self) -> f64 {
        let largest = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        largest(&self.first) + 4.0 * largest(&self.second)
    }

    /// From spring to spring the tangent turns by 2 atan(p ds / (2 lambda)), and the bound is reached when the sum of these angles is 2 pi (2 pi over
    /// the integral of 1 / lambda as ds -> 0). Second neighbours count as 4 lambda_2. Cost O(N).
    fn blow_up(&self) -> f64 {
        let second = |n: usize| {
            let pair = self.second.get(n).zip(self.second.get(n + 1));
            pair.map_or(0.0, |(a, b)| 2.0 * (a + b))
        };
        let springs = self.first.iter().enumerate();
        let half = springs.map(|(n, first)| 0.5 * self.ds / (first + second(n)));
        let half: Vec<f64> = half.collect();
        // Newton from below on a function that is concave: every step stays on the same side
        let mut pressure = PI / half.iter().sum::<f64>();
        for _ in 0..50 {
            let turned: f64 = half.iter().map(|h| (pressure * h).atan()).sum();
            let slopes = half.iter().map(|h| h / (1.0 + (pressure * h).powi(2)));
            let step = (PI - turned) / slopes.sum::<f64>();
            pressure += step;
            if step.abs() <= 1e-15 * pressure {
                break;
            }
        }
        pressure
    }

    fn is_mirrored(&self) -> bool {
        let most = 1e-13 * self.scale();
        let even = |v: &[f64]| are_mirrored(v, v, most);
        even(&self.first) && even(&self.second)
    }

    fn pull_into(&self, nodes: &[f64], out: &mut [f64]) -> Result<()> {
        let scale = 1.0 / (self.ds * self.ds);
        let Self { first, second, .. } = self;
        let (c, c0) = (nodes.as_chunks::<2>().0, self.rest.as_chunks::<2>().0);
        let out = out.as_chunks_mut::<2>().0;
        let u = |m: usize| {
            let (at, sign) = self.nodes.place(m);
            [c[at][0] - c0[at][0], sign * (c[at][1] - c0[at][1])]
        };
        // The pull of each spring is computed once and added to the nodes at both of its ends.
        let (mut here, mut before) = (u(0), [0.0; 2]);
        let next = c[1..].iter().zip(&c0[1..]);
        for ((out, stiffness), (c, c0)) in out.iter_mut().zip(first).zip(next) {
            let there = [c[0] - c0[0], c[1] - c0[1]];
            let k = scale * stiffness;
            let pull = [k * (there[0] - here[0]), k * (there[1] - here[1])];
            *out = [pull[0] - before[0], pull[1] - before[1]];
            (here, before) = (there, pull);
        }
        let count = out.len();
        if self.nodes.is_half() {
            let there = u(count);
            let k = scale * first[count - 1];
            for i in 0..2 {
                out[count - 1][i] = k * (there[i] - here[i]) - before[i];
            }
        }
        if !second.is_empty() {
            for n in self.nodes.moving() {
                let here = u(n);
                for (other, stiffness) in self.second_springs(n) {
                    let (there, k) = (u(other), scale * stiffness);
                    for i in 0..2 {
                        out[n][i] += k * (there[i] - here[i]);
                    }
                }
            }
        }
        Ok(())
    }

    fn push_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()> {
        let points = nodes.as_chunks::<2>().0;
        let last = points.len() - 1;
        let forces = out.as_chunks_mut::<2>().0;
        let neighbours = points.iter().zip(&points[2..]);
        let steps = neighbours.map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
        let (ds, inside) = (2.0 * self.ds, &mut forces[1..last]);
        if !self.law.forces_into(intensity, steps, ds, inside) {
            (1..last).try_for_each(|n| self.normal(nodes, n).map(drop))?;
        }
        if self.nodes.is_half() {
            let (d, factor) = self.normal(nodes, last)?;
            forces[last] = [-intensity * factor * d[1], intensity * factor * d[0]];
        }
        Ok(())
    }

    fn layout(&self) -> Layout {
        Layout::band(self.rest.len(), if self.second.is_empty() { 3 } else { 4 })
    }

    /// Block tridiagonal with diagonal blocks; pentadiagonal with second neighbours.
    fn tangent_into(
        &self,
        nodes: &[f64],
        (intensity, _): (f64, f64),
        out: &mut Tangent,
    ) -> Result<()> {
        let band = &mut out.band;
        band.clear();
        let scale = 1.0 / (self.ds * self.ds);
        for n in self.nodes.moving() {
            let (x, y) = (2 * n, 2 * n + 1);
            let (right, left) = (scale * self.first[n], scale * self.first[n - 1]);
            let (d, factor) = self.normal(nodes, n)?;
            let [[xx, xy], [yx, yy]] = self.law.derivative(intensity, d, factor);
            let (next, sign) = self.nodes.place(n + 1);
            band.add_inside(x, x, -right - left);
            band.add_inside(x, 2 * next, right + xx);
            band.add_inside(x, 2 * next + 1, sign * xy);
            band.add_inside(x, x - 2, left - xx);
            band.add_inside(x, y - 2, -xy);
            band.add_inside(y, y, -right - left);
            band.add_inside(y, 2 * next, yx);
            band.add_inside(y, 2 * next + 1, sign * (right + yy));
            band.add_inside(y, x - 2, -yx);
            band.add_inside(y, y - 2, left - yy);
            if self.second.is_empty() {
                continue;
            }
            for (m, stiffness) in self.second_springs(n) {
                let (at, sign) = self.nodes.place(m);
                band.add_inside(x, x, -scale * stiffness);
                band.add_inside(x, 2 * at, scale * stiffness);
                band.add_inside(y, y, -scale * stiffness);
                band.add_inside(y, 2 * at + 1, sign * scale * stiffness);
            }
        }
        Ok(())
    }

    fn energy(&self, nodes: &[f64], start: &[f64]) -> Result<f64> {
        let mut forces = [vec![0.0; nodes.len()], vec![0.0; nodes.len()]];
        self.pull_into(nodes, &mut forces[0])?;
        self.pull_into(start, &mut forces[1])?;
        // The force is linear in the position: the average of both ends integrates it. Fixed nodes do not contribute.
        let work = |i: usize| 0.5 * (forces[0][i] + forces[1][i]) * (nodes[i] - start[i]);
        // A node on the axis has no image.
        let images = 2 * (self.nodes.whole - self.nodes.kept);
        let whole = (0..nodes.len()).map(work).sum::<f64>() + (0..images).map(work).sum::<f64>();
        Ok(-self.ds * whole)
    }
}

/// Springs of spectral elements.
#[derive(Debug)]
pub(crate) struct ElementSprings {
    law: PressureLaw,
    reference: Arc<Reference>,
    elements: Vec<SpringElement>,
    largest: f64,
    /// Number of times that the elements cover the curve.
    copies: f64,
    /// Integral of 1 / lambda over the whole curve, under the law that needs it.
    compliance: f64,
}

#[derive(Debug)]
struct SpringElement {
    length: f64,
    /// Reference positions at the nodes, with one-sided limits at the ends.
    rest: Vec<[f64; 2]>,
    /// Row i of d/ds lambda d/ds; first row lambda d/ds, last row -lambda d/ds at the end points.
    matrix: Vec<f64>,
    /// Stiffness times weight at each Gauss point.
    gauss: Vec<f64>,
}

impl SpringElement {
    /// Displacements of its nodes.
    fn displacements<'a>(&'a self, nodes: &'a [[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + 'a {
        let pairs = nodes.iter().zip(&self.rest);
        pairs.map(|(c, c0)| [c[0] - c0[0], c[1] - c0[1]])
    }
}

impl ElementSprings {
    /// Creates a curve, or `half` of it, without elements.
    pub(crate) fn new(law: PressureLaw, reference: Arc<Reference>, half: bool) -> Self {
        Self {
            law,
            reference,
            elements: Vec::new(),
            largest: 0.0,
            copies: if half { 2.0 } else { 1.0 },
            compliance: 0.0,
        }
    }

    /// Adds the element of `membrane` between `from` and `to` with these reference positions at its nodes.
    pub(crate) fn push(
        &mut self,
        membrane: &Membrane,
        (from, to): (f64, f64),
        rest: Vec<[f64; 2]>,
    ) -> Result<()> {
        let at = |s| membrane.effective_stiffness(s);
        let length = to - from;
        // just inside, so that a jump at the element's end is evaluated on its side
        let nodes = self.reference.nodes.iter().map(|t| from + length * t);
        let stiffness = nodes.map(|s| at(s.max(from + SAME).min(to - SAME)));
        let stiffness: Vec<f64> = stiffness.collect::<Result<_>>()?;
        if self.law.blows_up() {
            self.compliance += self.copies * compliance(at, from, to)?;
        }
        self.largest = stiffness.iter().copied().fold(self.largest, f64::max);
        let (n, d) = (stiffness.len(), &self.reference.derivative);
        let mut matrix = vec![0.0; n * n];
        for j in 0..n {
            for i in 1..n - 1 {
                let products = (0..n).map(|k| d[i * n + k] * stiffness[k] * d[k * n + j]);
                matrix[i * n + j] = products.sum::<f64>() / (length * length);
            }
            matrix[j] = stiffness[0] * d[j] / length;
            matrix[(n - 1) * n + j] = -stiffness[n - 1] * d[(n - 1) * n + j] / length;
        }
        let gauss = self.reference.gauss.iter();
        let gauss = gauss.map(|(t, weight)| Ok(weight * at(from + length * t)?));
        self.elements.push(SpringElement {
            length,
            rest,
            matrix,
            gauss: gauss.collect::<Result<_>>()?,
        });
        Ok(())
    }

    /// Returns c' at node `i` of element `e`, and its factor in the pressure law.
    fn direction(&self, state: &[f64], e: usize, i: usize) -> Result<([f64; 2], f64)> {
        let n = self.reference.nodes.len();
        let local = state[self.reference.window(e)].as_chunks::<2>().0;
        let d = combine(&self.reference.derivative[i * n..], local.iter().copied());
        let per_s = 1.0 / self.elements[e].length;
        let d = d.map(|d| d * per_s);
        // d is c' itself: the change per unit s
        Ok((d, self.law.factor(d, 1.0, e * (n - 1) + i)?))
    }
}

impl Elastic for ElementSprings {
    fn scale(&self) -> f64 {
        self.largest
    }

    fn blow_up(&self) -> f64 {
        2.0 * PI / self.compliance
    }

    fn is_mirrored(&self) -> bool {
        let mut pairs = self.elements.iter().zip(self.elements.iter().rev());
        pairs.all(|(element, image)| {
            let size = element.matrix.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            // that of the length of the element, twice
            let rounding = (1e-13f64).max(4.0 * f64::EPSILON / element.length);
            are_mirrored(&element.matrix, &image.matrix, rounding * size)
        })
    }

    fn pull_into(&self, nodes: &[f64], out: &mut [f64]) -> Result<()> {
        out.fill(0.0);
        for (e, element) in self.elements.iter().enumerate() {
            let window = self.reference.window(e);
            let nodes = nodes[window.clone()].as_chunks::<2>().0;
            let out = out[window].as_chunks_mut::<2>().0;
            let rows = element.matrix.chunks_exact(nodes.len());
            for (out, row) in out.iter_mut().zip(rows) {
                let sum = combine(row, element.displacements(nodes));
                out[0] += sum[0];
                out[1] += sum[1];
            }
        }
        Ok(())
    }

    fn push_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()> {
        out.fill(0.0);
        let p = self.reference.nodes.len() - 1;
        for e in 0..self.elements.len() {
            for i in 1..p {
                let (d, factor) = self.direction(nodes, e, i)?;
                out[2 * (e * p + i)] = -intensity * d[1] * factor;
                out[2 * (e * p + i) + 1] = intensity * d[0] * factor;
            }
        }
        Ok(())
    }

    fn layout(&self) -> Layout {
        Layout::elements(self.elements.len(), self.reference.nodes.len())
    }

    fn tangent_into(
        &self,
        nodes: &[f64],
        (intensity, _): (f64, f64),
        out: &mut Tangent,
    ) -> Result<()> {
        let n = self.reference.nodes.len();
        let (p, size) = (n - 1, 2 * n);
        out.band.clear();
        let blocks = self.elements.iter().zip(&mut out.blocks);
        for (e, (element, block)) in blocks.enumerate() {
            for i in 0..n {
                let derivative = &self.reference.derivative[i * n..(i + 1) * n];
                let elastic = &element.matrix[i * n..(i + 1) * n];
                // the pressure force by c', row by row
                let mut by = [[0.0; 2]; 2];
                if i > 0 && i < p {
                    let (d, factor) = self.direction(nodes, e, i)?;
                    by = self.law.derivative(intensity / element.length, d, factor);
                }
                let first = 2 * local_index(i, p) * size;
                let (x_row, y_row) = block[first..first + 2 * size].split_at_mut(size);
                for j in 0..n {
                    let column = 2 * local_index(j, p);
                    x_row[column] = elastic[j] + by[0][0] * derivative[j];
                    x_row[column + 1] = by[0][1] * derivative[j];
                    y_row[column] = by[1][0] * derivative[j];
                    y_row[column + 1] = elastic[j] + by[1][1] * derivative[j];
                }
            }
        }
        Ok(())
    }

    fn energy(&self, nodes: &[f64], start: &[f64]) -> Result<f64> {
        let energy = |e: usize, state: &[f64]| {
            let element = &self.elements[e];
            let local = state[self.reference.window(e)].as_chunks::<2>().0;
            let rows = (self.reference.derivative_to_gauss).chunks_exact(local.len());
            let terms = rows.zip(&element.gauss).map(|(row, weight)| {
                let [x, y] = combine(row, element.displacements(local));
                0.5 * weight * (x * x + y * y)
            });
            terms.sum::<f64>() / element.length
        };
        let changes = (0..self.elements.len()).map(|e| energy(e, nodes) - energy(e, start));
        Ok(self.copies * changes.sum::<f64>())
    }
}

/// Whether `b` in reverse order differs from `a` by at most `most`.
fn are_mirrored(a: &[f64], b: &[f64], most: f64) -> bool {
    let mut pairs = a.iter().zip(b.iter().rev());
    pairs.all(|(a, b)| (a - b).abs() <= most)
}

/// Integral of 1 / lambda between `from` and `to`: a Gauss rule on more and more panels until it
/// no longer changes, whatever the degree of the elements.
fn compliance(stiffness: impl Fn(f64) -> Result<f64>, from: f64, to: f64) -> Result<f64> {
    let rule = gauss_legendre(20);
    let mut last = f64::INFINITY;
    for panels in (0..8).map(|k| 1 << k) {
        let width = (to - from) / f64::from(panels);
        let mut sum = 0.0;
        for panel in 0..panels {
            for (t, weight) in &rule {
                let s = from + width * (f64::from(panel) + t);
                sum += weight * width / stiffness(s)?;
            }
        }
        if (sum - last).abs() <= 1e-14 * sum {
            return Ok(sum);
        }
        last = sum;
    }
    Ok(last)
}
