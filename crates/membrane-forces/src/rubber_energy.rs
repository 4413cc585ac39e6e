//! Rubber: forces and tangents as derivatives of its energy by the nodes.
//!
//! ```text
//! E[c] = integral of 2 pi r0 h W(l1, l2) dS - p V[c],     l1 = |dc/dS|,  l2 = y / r0
//! ```
//!
//! over the meridian from the fixed end to the axis: S is its length in the reference configuration, r0 its distance from the axis there, h
//! its thickness. Forces are -dE/dc, tangents minus the second derivatives and so symmetric. Each element has the points of one [`Rule`].
//! Elements of two nodes have a kernel of their own (`rubber_nodes.rs`), which is twice as fast.

use std::f64::consts::PI;

use crate::chebyshev::{Reference, local_index};
use crate::error::{MembraneError, finite};
use crate::material::Rubber;
use crate::strain_energy::EnergyDerivatives;

/// Quadrature points of an element with n nodes.
#[derive(Debug, Clone)]
pub(crate) struct Rule {
    /// Coordinates in [0, 1] and weights.
    points: Vec<(f64, f64)>,
    /// n values and n slopes of the nodes' functions at each point.
    rows: [Vec<f64>; 2],
    /// The same with the nodes in the order of a tangent's block.
    ordered: [Vec<f64>; 2],
    n: usize,
}

impl Rule {
    /// The Gauss rule of spectral elements (Galerkin's method), without points on the axis.
    pub(crate) fn gauss(reference: &Reference) -> Self {
        let n = reference.nodes.len();
        let ordered = |table: &[f64]| {
            let mut out = vec![0.0; table.len()];
            for (out, row) in out.chunks_exact_mut(n).zip(table.chunks_exact(n)) {
                for (i, value) in row.iter().enumerate() {
                    out[local_index(i, n - 1)] = *value;
                }
            }
            out
        };
        let rows = [&reference.to_gauss, &reference.derivative_to_gauss];
        Self {
            points: reference.gauss.clone(),
            ordered: rows.map(|table| ordered(table)),
            rows: rows.map(Vec::clone),
            n,
        }
    }

    /// Values and slopes at point `q` of one of the two tables.
    #[inline]
    fn row<'a>(&self, [values, slopes]: &'a [Vec<f64>; 2], q: usize) -> Row<'a> {
        let range = q * self.n..(q + 1) * self.n;
        (&values[range.clone()], &slopes[range])
    }
}

/// Values and slopes of the functions of an element's nodes.
type Row<'a> = (&'a [f64], &'a [f64]);

/// Rubber of half a curve.
#[derive(Debug, Clone)]
pub(crate) struct RubberEnergy {
    rubber: Rubber,
    rule: Rule,
    elements: Vec<Vec<Point>>,
    thickest: f64,
}

/// A quadrature point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    /// 2 pi r0 h dS.
    weight: f64,
    /// Weight of the volume over the element's own coordinate.
    rule: f64,
    /// Derivative of S by the element's own coordinate, and r0. Quotients by them are exactly 1 in the reference configuration; products
    /// with their reciprocals have rounding errors that exceed energies of small strains.
    rest: [f64; 2],
    /// Their inverses.
    per_length: f64,
    per_radius: f64,
}

/// The curve at a quadrature point: derivative by the element's own coordinate, y, W.
struct Here {
    d: [f64; 2],
    y: f64,
    speed: f64,
    w: EnergyDerivatives,
}

impl Point {
    /// Derivatives of the volume, pi times the integral of y^2 x', by x' and by y.
    #[inline]
    fn volume(&self, d: [f64; 2], y: f64) -> [f64; 2] {
        [PI * self.rule * y * y, 2.0 * PI * self.rule * y * d[0]]
    }

    /// The factors of this point in a row of the tangent: of an x times its own slope, of a y times its slope and times its value.
    /// `columns` contains them by x and y of each node in the block's order, whose values and slopes are `ordered`.
    fn columns_into(
        &self,
        here: &Here,
        (pressure, least): (f64, f64),
        (values, slopes): Row<'_>,
        columns: &mut [f64],
    ) {
        let Here { d, y, speed, w } = here;
        let [aa, ab, bb] = w.second.map(|second| -self.weight * second);
        let square = self.per_length * self.per_length;
        let tension = w.by[0] * self.per_length / speed;
        let across = -self.weight * tension.max(least * square);
        let along = aa * square;
        let [ux, uy] = [d[0] / speed, d[1] / speed];
        let mixed = ab * self.per_length * self.per_radius;
        let xx = along * ux * ux + across * uy * uy;
        let xy = (along - across) * ux * uy;
        let yy = along * uy * uy + across * ux * ux;
        let volume = 2.0 * PI * pressure * self.rule;
        let x_value = mixed * ux + volume * y;
        let y_value = mixed * uy;
        let value = bb * self.per_radius * self.per_radius + volume * d[0];
        let (by_x, rest) = columns.split_at_mut(2 * values.len());
        let (by_slope, by_value) = rest.split_at_mut(2 * values.len());
        for (j, (v, s)) in values.iter().zip(slopes).enumerate() {
            by_x[2 * j] = xx * s;
            by_x[2 * j + 1] = xy * s + x_value * v;
            by_slope[2 * j] = xy * s;
            by_slope[2 * j + 1] = yy * s + y_value * v;
            by_value[2 * j] = x_value * s;
            by_value[2 * j + 1] = y_value * s + value * v;
        }
    }
}

/// Returns the derivative by the element's own coordinate, and y, at a point with these rows.
#[inline]
fn place((values, slopes): Row<'_>, nodes: &[[f64; 2]]) -> ([f64; 2], f64) {
    // four independent sums, to hide latency
    let (values, left) = values.as_chunks::<4>();
    let (slopes, slopes_left) = slopes.as_chunks::<4>();
    let (nodes, nodes_left) = nodes.as_chunks::<4>();
    let mut sums = [[0.0; 4]; 3];
    for ((value, slope), node) in values.iter().zip(slopes).zip(nodes) {
        for k in 0..4 {
            sums[0][k] += slope[k] * node[k][0];
            sums[1][k] += slope[k] * node[k][1];
            sums[2][k] += value[k] * node[k][1];
        }
    }
    let [mut dx, mut dy, mut y] = sums.map(|sum| (sum[0] + sum[1]) + (sum[2] + sum[3]));
    for ((value, slope), node) in left.iter().zip(slopes_left).zip(nodes_left) {
        dx += slope * node[0];
        dy += slope * node[1];
        y += value * node[1];
    }
    ([dx, dy], y)
}

/// Adds to `out` the forces on the derivative and on y at a point with these rows.
#[inline]
fn add(out: &mut [[f64; 2]], (values, slopes): Row<'_>, by_slope: [f64; 2], by_value: f64) {
    for ((value, slope), out) in values.iter().zip(slopes).zip(out) {
        out[0] += by_slope[0] * slope;
        out[1] += by_slope[1] * slope + by_value * value;
    }
}

impl RubberEnergy {
    /// Creates a curve without elements.
    pub(crate) fn new(rubber: &Rubber, rule: Rule) -> Self {
        Self {
            rubber: rubber.clone(),
            rule,
            elements: Vec::new(),
            thickest: 0.0,
        }
    }

    /// Adds the element between `from` and `to`, with position and derivative by the element's own coordinate in the reference
    /// configuration.
    ///
    /// # Errors
    /// A reference curve or thickness that is not finite or not positive; a curve without direction.
    pub(crate) fn push(
        &mut self,
        (from, to): (f64, f64),
        rest: impl Fn(f64) -> [[f64; 2]; 2],
    ) -> Result<(), MembraneError> {
        let mut points = Vec::with_capacity(self.rule.points.len());
        for &(t, rule) in &self.rule.points {
            let s = from + (to - from) * t;
            let [position, d] = rest(s);
            let speed = finite("rest curve", (d[0] * d[0] + d[1] * d[1]).sqrt())?;
            if speed == 0.0 {
                let index = points.len();
                return Err(MembraneError::CoincidentPoints { index });
            }
            let thickness = self.rubber.thickness.at(s)?;
            self.thickest = self.thickest.max(thickness);
            let radius = self.rubber.radius(position[1], s)?;
            points.push(Point {
                weight: 2.0 * PI * radius * thickness * speed * rule,
                rule,
                rest: [speed, radius],
                per_length: 1.0 / speed,
                per_radius: 1.0 / radius,
            });
        }
        self.elements.push(points);
        Ok(())
    }

    /// Largest shear modulus times thickness.
    pub(crate) fn scale(&self) -> f64 {
        self.rubber.energy.shear_modulus() * self.thickest
    }

    /// Nodes of element `e` in a state or in forces.
    fn window(&self, e: usize) -> std::ops::Range<usize> {
        let p = self.rule.n - 1;
        e * p..(e + 1) * p + 1
    }

    #[inline]
    fn here(&self, row: Row<'_>, point: &Point, nodes: &[[f64; 2]]) -> Result<Here, MembraneError> {
        let (d, y) = place(row, nodes);
        let speed = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let w = (self.rubber.energy).at(speed / point.rest[0], y / point.rest[1])?;
        Ok(Here { d, y, speed, w })
    }

    /// Calls `visit` for all points.
    fn each(
        &self,
        nodes: &[f64],
        mut visit: impl FnMut(&Point, &Here),
    ) -> Result<(), MembraneError> {
        let nodes = nodes.as_chunks::<2>().0;
        for (e, points) in self.elements.iter().enumerate() {
            let nodes = &nodes[self.window(e)];
            for (q, point) in points.iter().enumerate() {
                visit(
                    point,
                    &self.here(self.rule.row(&self.rule.rows, q), point, nodes)?,
                );
            }
        }
        Ok(())
    }

    /// Least dW/dl1 over l1 and the shear modulus.
    ///
    /// # Errors
    /// [`MembraneError::PastStretch`], as all of the following.
    pub(crate) fn least_tension(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        let mut least = f64::INFINITY;
        self.each(nodes, |point, here| {
            least = least.min(here.w.by[0] / (here.speed * point.per_length));
        })?;
        Ok(least / self.rubber.energy.shear_modulus())
    }

    /// Energy of the body.
    pub(crate) fn energy(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        let mut sum = 0.0;
        self.each(nodes, |point, here| sum += point.weight * here.w.energy)?;
        Ok(sum)
    }

    /// `out` = minus the derivative of the energy, plus `pressure` times that of the volume. Returns the volume.
    pub(crate) fn forces_into(
        &self,
        nodes: &[f64],
        pressure: f64,
        out: &mut [f64],
    ) -> Result<f64, MembraneError> {
        out.fill(0.0);
        let (points, forces) = (nodes.as_chunks::<2>().0, out.as_chunks_mut::<2>().0);
        let mut volume = 0.0;
        for (e, element) in self.elements.iter().enumerate() {
            let (points, forces) = (&points[self.window(e)], &mut forces[self.window(e)]);
            for (q, point) in element.iter().enumerate() {
                let row = self.rule.row(&self.rule.rows, q);
                let Here { d, y, speed, w } = self.here(row, point, points)?;
                let tension = point.weight * w.by[0] * point.per_length / speed;
                let hoop = point.weight * w.by[1] * point.per_radius;
                let [disc, ring] = point.volume(d, y);
                volume += disc * d[0];
                let by_slope = [pressure * disc - tension * d[0], -tension * d[1]];
                add(forces, row, by_slope, pressure * ring - hoop);
            }
        }
        Ok(volume)
    }

    /// `out` = `pressure` times the derivative of the volume.
    pub(crate) fn pressure_into(&self, nodes: &[f64], pressure: f64, out: &mut [f64]) {
        out.fill(0.0);
        let (points, forces) = (nodes.as_chunks::<2>().0, out.as_chunks_mut::<2>().0);
        for (e, element) in self.elements.iter().enumerate() {
            let (points, forces) = (&points[self.window(e)], &mut forces[self.window(e)]);
            for (q, point) in element.iter().enumerate() {
                let row = self.rule.row(&self.rule.rows, q);
                let (d, y) = place(row, points);
                let [disc, ring] = point.volume(d, y).map(|by| pressure * by);
                add(forces, row, [disc, 0.0], ring);
            }
        }
    }

    /// `out` = the derivative of forces and of `pressure` times the gradient of the volume by the nodes of element `e`, laid out as in
    /// [`Tangent`](crate::Tangent), with a tension of at least `least`. `columns` is a buffer of 12 numbers per node. Cost O(degree^3).
    pub(crate) fn tangent_into(
        &self,
        e: usize,
        nodes: &[f64],
        (pressure, least): (f64, f64),
        columns: &mut [f64],
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        out.fill(0.0);
        let (nodes, rule) = (&nodes.as_chunks::<2>().0[self.window(e)], &self.rule);
        let size = 2 * rule.n;
        let least = least * self.rubber.energy.shear_modulus();
        // Two points at a time, whose columns are added to the rows together; an odd last one has a partner without weight.
        for (k, pair) in self.elements[e].chunks(2).enumerate() {
            columns.fill(0.0);
            let mut own = [rule.row(&rule.ordered, 2 * k); 2];
            for (i, point) in pair.iter().enumerate() {
                let q = 2 * k + i;
                own[i] = rule.row(&rule.ordered, q);
                let here = self.here(rule.row(&rule.rows, q), point, nodes)?;
                let columns = &mut columns[3 * size * i..][..3 * size];
                point.columns_into(&here, (pressure, least), own[i], columns);
            }
            let [x, slope, value, next_x, next_slope, next_value] =
                std::array::from_fn(|k| &columns[k * size..][..size]);
            // the second derivatives of an energy are symmetric: columns of this node and later ones
            for (i, rows) in out.chunks_exact_mut(2 * size).enumerate() {
                let [(v, s), (next_v, next_s)] = own.map(|(values, slopes)| (values[i], slopes[i]));
                let (x_row, y_row) = rows.split_at_mut(size);
                for j in 2 * i..size {
                    x_row[j] += s * x[j] + next_s * next_x[j];
                    y_row[j] += (s * slope[j] + next_s * next_slope[j])
                        + (v * value[j] + next_v * next_value[j]);
                }
            }
        }
        for row in 2..size {
            for column in 0..row - row % 2 {
                out[row * size + column] = out[column * size + row];
            }
        }
        Ok(())
    }

    /// `block` += `scale` times the mass matrix of element `e` at density 1, laid out as a tangent's block.
    pub(crate) fn add_mass_into(&self, e: usize, scale: f64, block: &mut [f64]) {
        let size = block.len().isqrt();
        for (q, point) in self.elements[e].iter().enumerate() {
            let (values, _) = self.rule.row(&self.rule.ordered, q);
            for (i, a) in values.iter().enumerate() {
                for (j, b) in values.iter().enumerate() {
                    let mass = scale * point.weight * a * b;
                    block[2 * i * size + 2 * j] += mass;
                    block[(2 * i + 1) * size + 2 * j + 1] += mass;
                }
            }
        }
    }

    /// Whether the elements are mirror-symmetric, to rounding.
    pub(crate) fn are_symmetric(&self) -> bool {
        let points = || self.elements.iter().flatten();
        let largest = |of: fn(&Point) -> f64| points().map(of).fold(0.0, f64::max);
        let (weight, slope) = (largest(|p| p.weight), largest(|p| p.per_length));
        let mut pairs = points().zip(self.elements.iter().rev().flat_map(|e| e.iter().rev()));
        pairs.all(|(a, b)| {
            (a.weight - b.weight).abs() <= 1e-12 * weight
                && (a.per_length - b.per_length).abs() <= 1e-12 * slope
        })
    }
}
