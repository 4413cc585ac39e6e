//! Rubber of spectral elements: forces and tangents as derivatives of its energy by its nodes.
//!
//! The energy is that of `rubber_nodes.rs`, by the Gauss rule of each element (Galerkin's method). No point of it is on the axis, where
//! l2 = y / r0 would be 0 / 0; the curve's own polynomials make l1 = l2 there.

use std::f64::consts::PI;

use crate::chebyshev::{Reference, local_index};
use crate::error::{MembraneError, finite};
use crate::material::Rubber;
use crate::rest::CurvePoint;
use crate::strain_energy::Strained;

/// Rubber of all elements of a curve.
#[derive(Debug, Clone)]
pub(crate) struct RubberElements {
    rubber: Rubber,
    /// Values and slopes at quadrature points, row by row, the nodes in the order of a tangent's block.
    values: Vec<f64>,
    slopes: Vec<f64>,
    elements: Vec<Vec<Point>>,
}

/// A quadrature point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    /// 2 pi r0 h dS.
    weight: f64,
    /// Of the rule, over the element's own coordinate.
    rule: f64,
    /// Over the derivative of S by the element's own coordinate.
    per_length: f64,
    /// 1 / r0.
    per_radius: f64,
}

/// The curve at a quadrature point: derivative by the element's own coordinate, y, W.
struct Here {
    d: [f64; 2],
    y: f64,
    speed: f64,
    w: Strained,
}

impl Point {
    /// Derivatives of the volume, pi times the integral of y^2 x', by x' and by y.
    #[inline]
    fn volume(&self, d: [f64; 2], y: f64) -> [f64; 2] {
        [PI * self.rule * y * y, 2.0 * PI * self.rule * y * d[0]]
    }

    /// What a row of the tangent takes of this point: of an x times its own slope, of a y times its slope and times its value. In
    /// `columns`, one after the other, by x and y of each node in the block's order, whose values and slopes are `ordered`.
    fn columns_into(
        &self,
        here: &Here,
        (pressure, least): (f64, f64),
        (values, slopes): (&[f64], &[f64]),
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

/// Derivative by the element's own coordinate, and y, at a point that has these rows.
#[inline]
fn place((values, slopes): (&[f64], &[f64]), nodes: &[[f64; 2]]) -> ([f64; 2], f64) {
    // four sums side by side, so that none waits for the last
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

/// `out` += what acts on the derivative and on y at a point that has these rows.
#[inline]
fn add(
    out: &mut [[f64; 2]],
    (values, slopes): (&[f64], &[f64]),
    by_slope: [f64; 2],
    by_value: f64,
) {
    for ((value, slope), out) in values.iter().zip(slopes).zip(out) {
        out[0] += by_slope[0] * slope;
        out[1] += by_slope[1] * slope + by_value * value;
    }
}

impl RubberElements {
    /// Of a curve without elements.
    pub(crate) fn new(rubber: &Rubber, reference: &Reference) -> Self {
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
        Self {
            rubber: rubber.clone(),
            values: ordered(&reference.to_gauss),
            slopes: ordered(&reference.derivative_to_gauss),
            elements: Vec::new(),
        }
    }

    /// Adds the element between `from` and `to`, whose place and derivative at rest are `rest`.
    pub(crate) fn push(
        &mut self,
        reference: &Reference,
        (from, to): (f64, f64),
        rest: impl Fn(f64) -> CurvePoint,
    ) -> Result<(), MembraneError> {
        let mut points = Vec::with_capacity(reference.gauss.len());
        for &(t, rule) in &reference.gauss {
            let s = from + (to - from) * t;
            let CurvePoint {
                position, first, ..
            } = rest(s);
            let speed = finite("rest curve", first[0].hypot(first[1]))?;
            if speed == 0.0 {
                let index = points.len();
                return Err(MembraneError::CoincidentPoints { index });
            }
            let (radius, speed) = (self.rubber.radius(position[1], s)?, speed * (to - from));
            points.push(Point {
                weight: 2.0 * PI * radius * self.rubber.thickness.at(s)? * speed * rule,
                rule,
                per_length: 1.0 / speed,
                per_radius: 1.0 / radius,
            });
        }
        self.elements.push(points);
        Ok(())
    }

    /// Largest shear modulus times thickness.
    pub(crate) fn scale(&self) -> f64 {
        let each = self.elements.iter().flatten();
        let thickness = each.map(|p| p.weight * p.per_length / p.rule * p.per_radius / (2.0 * PI));
        self.rubber.energy.shear_modulus() * thickness.fold(0.0, f64::max)
    }

    #[inline]
    fn here(
        &self,
        rows: (&[f64], &[f64]),
        point: &Point,
        nodes: &[[f64; 2]],
    ) -> Result<Here, MembraneError> {
        let (d, y) = place(rows, nodes);
        let speed = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let w = (self.rubber.energy).at(speed * point.per_length, y * point.per_radius)?;
        Ok(Here { d, y, speed, w })
    }

    /// Whether every stretch of element `e` is one that the rubber takes.
    pub(crate) fn check(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
    ) -> Result<(), MembraneError> {
        for (point, rows) in self.elements[e].iter().zip(reference.gauss_rows()) {
            self.here(rows, point, nodes)?;
        }
        Ok(())
    }

    /// Least dW/dl1 over l1 and the shear modulus.
    pub(crate) fn least_tension(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
    ) -> Result<f64, MembraneError> {
        let mut least = f64::INFINITY;
        for (point, rows) in self.elements[e].iter().zip(reference.gauss_rows()) {
            let Here { speed, w, .. } = self.here(rows, point, nodes)?;
            least = least.min(w.by[0] / (speed * point.per_length));
        }
        Ok(least / self.rubber.energy.shear_modulus())
    }

    /// Energy of the part of the body that is element `e`.
    pub(crate) fn energy(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
    ) -> Result<f64, MembraneError> {
        let mut sum = 0.0;
        for (point, rows) in self.elements[e].iter().zip(reference.gauss_rows()) {
            sum += point.weight * self.here(rows, point, nodes)?.w.energy;
        }
        Ok(sum)
    }

    /// `out` -= the derivative of the energy, += `pressure` times that of the volume. Returns the volume.
    pub(crate) fn add_forces_into(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
        pressure: f64,
        out: &mut [[f64; 2]],
    ) -> Result<f64, MembraneError> {
        let mut volume = 0.0;
        for (point, rows) in self.elements[e].iter().zip(reference.gauss_rows()) {
            let Here { d, y, speed, w } = self.here(rows, point, nodes)?;
            let tension = point.weight * w.by[0] * point.per_length / speed;
            let hoop = point.weight * w.by[1] * point.per_radius;
            let [disc, ring] = point.volume(d, y);
            volume += disc * d[0];
            let by_slope = [pressure * disc - tension * d[0], -tension * d[1]];
            add(out, rows, by_slope, pressure * ring - hoop);
        }
        Ok(volume)
    }

    /// `out` += `pressure` times the derivative of the volume.
    pub(crate) fn add_pressure_into(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
        pressure: f64,
        out: &mut [[f64; 2]],
    ) {
        for (point, rows) in self.elements[e].iter().zip(reference.gauss_rows()) {
            let (d, y) = place(rows, nodes);
            let [disc, ring] = point.volume(d, y).map(|by| pressure * by);
            add(out, rows, [disc, 0.0], ring);
        }
    }

    /// `out` = the derivative of forces and of `pressure` times the gradient of the volume by the element's nodes, as
    /// [`Tangent`](crate::Tangent) has it, with a tension of at least `least`. Cost O(degree^3).
    pub(crate) fn tangent_into(
        &self,
        e: usize,
        reference: &Reference,
        nodes: &[[f64; 2]],
        (pressure, least): (f64, f64),
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        out.fill(0.0);
        let (n, size) = (nodes.len(), 2 * nodes.len());
        let least = least * self.rubber.energy.shear_modulus();
        let zeros = vec![0.0; n];
        // Two points at a time, whose columns are added to the rows at once; an odd last one has a partner without weight.
        let mut columns = vec![0.0; 6 * size];
        let ordered = self.values.chunks_exact(n).zip(self.slopes.chunks_exact(n));
        let mut tables = reference.gauss_rows().zip(ordered);
        for pair in self.elements[e].chunks(2) {
            let mut own = [(&zeros[..], &zeros[..]); 2];
            let places = own.iter_mut().zip(columns.chunks_exact_mut(3 * size));
            for ((point, (own, columns)), (rows, ordered)) in
                pair.iter().zip(places).zip(tables.by_ref())
            {
                *own = ordered;
                let here = self.here(rows, point, nodes)?;
                point.columns_into(&here, (pressure, least), ordered, columns);
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

    /// `out` += what `velocities` of density 1 have as momentum in element `e`.
    pub(crate) fn add_momentum_into(
        &self,
        e: usize,
        reference: &Reference,
        velocities: &[[f64; 2]],
        out: &mut [[f64; 2]],
    ) {
        for (point, (values, _)) in self.elements[e].iter().zip(reference.gauss_rows()) {
            let mut v = [0.0; 2];
            for (value, node) in values.iter().zip(velocities) {
                v[0] += point.weight * value * node[0];
                v[1] += point.weight * value * node[1];
            }
            for (value, out) in values.iter().zip(&mut *out) {
                out[0] += value * v[0];
                out[1] += value * v[1];
            }
        }
    }

    /// `block` += `scale` times the mass matrix of element `e`, laid out as a tangent's block.
    pub(crate) fn add_mass_into(&self, e: usize, scale: f64, block: &mut [f64]) {
        let size = block.len().isqrt();
        let rows = self.values.chunks_exact(size / 2);
        for (point, values) in self.elements[e].iter().zip(rows) {
            for (i, a) in values.iter().enumerate() {
                for (j, b) in values.iter().enumerate() {
                    let mass = scale * point.weight * a * b;
                    block[2 * i * size + 2 * j] += mass;
                    block[(2 * i + 1) * size + 2 * j + 1] += mass;
                }
            }
        }
    }

    /// Whether the elements are their own mirror image, to rounding.
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
