//! Rubber: forces and tangents as derivatives of its energy by the nodes.
//!
//! ```text
//! E[c] = integral of 2 pi r0 h W(l1, l2) dS - p V[c],     l1 = |dc/dS|,  l2 = y / r0
//! ```
//!
//! over the meridian from the fixed end to the axis: S is its length in the reference configuration, r0 its distance from the axis there, h
//! its thickness. Forces are -dE/dc, tangents minus the second derivatives and so symmetric. Spectral elements use a Gauss rule (Galerkin's
//! method), without points on the axis. Elements of two nodes have a kernel of their own (`rubber_nodes.rs`), which is twice as fast.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::chebyshev::Reference;
use crate::discrete::Elastic;
use crate::error::{MembraneError, Result, finite};
use crate::material::Rubber;
use crate::strain_energy::EnergyDerivatives;
use crate::tangent::{Layout, Tangent, local_index};

/// Values and slopes of the functions of an element's nodes, at one quadrature point.
type Row<'a> = (&'a [f64], &'a [f64]);

/// Rubber of half a curve on spectral elements.
#[derive(Debug)]
pub(crate) struct RubberEnergy {
    rubber: Rubber,
    reference: Arc<Reference>,
    /// Values and slopes of the nodes' functions at the Gauss points, with the nodes in the order of a tangent's block.
    ordered: [Vec<f64>; 2],
    elements: Vec<Vec<Point>>,
    thickest: f64,
}

/// A quadrature point.
#[derive(Debug, Clone, Copy)]
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
    pub(crate) fn new(rubber: &Rubber, reference: Arc<Reference>) -> Self {
        let n = reference.nodes.len();
        let ordered = |table: &Vec<f64>| {
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
            ordered: [&reference.to_gauss, &reference.derivative_to_gauss].map(ordered),
            reference,
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
    ) -> Result<()> {
        let mut points = Vec::with_capacity(self.reference.gauss.len());
        for &(t, rule) in &self.reference.gauss {
            let s = from + (to - from) * t;
            let [position, d] = rest(s);
            let speed = finite("reference curve", (d[0] * d[0] + d[1] * d[1]).sqrt())?;
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

    /// Values and slopes at Gauss point `q`, with the nodes in their own order.
    #[inline]
    fn row(&self, q: usize) -> Row<'_> {
        let Reference {
            to_gauss,
            derivative_to_gauss,
            ..
        } = &*self.reference;
        rows(to_gauss, derivative_to_gauss, q, self.reference.nodes.len())
    }

    /// As [`Self::row`], with the nodes in the order of a block.
    #[inline]
    fn ordered_row(&self, q: usize) -> Row<'_> {
        let [values, slopes] = &self.ordered;
        rows(values, slopes, q, self.reference.nodes.len())
    }

    #[inline]
    fn here(&self, row: Row<'_>, point: &Point, nodes: &[[f64; 2]]) -> Result<Here> {
        let (d, y) = place(row, nodes);
        let speed = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let w = (self.rubber.energy).at(speed / point.rest[0], y / point.rest[1])?;
        Ok(Here { d, y, speed, w })
    }

    fn each(&self, nodes: &[f64], mut visit: impl FnMut(&Point, &Here)) -> Result<()> {
        for (e, points) in self.elements.iter().enumerate() {
            let nodes = nodes[self.reference.window(e)].as_chunks::<2>().0;
            for (q, point) in points.iter().enumerate() {
                visit(point, &self.here(self.row(q), point, nodes)?);
            }
        }
        Ok(())
    }

    /// `out` = minus the derivative of the energy, plus `pressure` times that of the volume. Returns the volume.
    fn both_into(&self, nodes: &[f64], pressure: f64, out: &mut [f64]) -> Result<f64> {
        out.fill(0.0);
        let mut volume = 0.0;
        for (e, element) in self.elements.iter().enumerate() {
            let window = self.reference.window(e);
            let points = nodes[window.clone()].as_chunks::<2>().0;
            let forces = out[window].as_chunks_mut::<2>().0;
            for (q, point) in element.iter().enumerate() {
                let row = self.row(q);
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

    /// `out` = the block of element `e`, with `columns` as a buffer of 12 numbers per node. Cost O(degree^3). Not inlined, because the compiler
    /// knows that slices of parameters do not overlap.
    #[inline(never)]
    fn block_into(
        &self,
        e: usize,
        nodes: &[[f64; 2]],
        (pressure, least): (f64, f64),
        columns: &mut [f64],
        out: &mut [f64],
    ) -> Result<()> {
        out.fill(0.0);
        let size = 2 * nodes.len();
        // Two points at a time, whose columns are added to the rows together; an odd last one has a partner without weight.
        for (k, pair) in self.elements[e].chunks(2).enumerate() {
            columns.fill(0.0);
            let mut own = [self.ordered_row(2 * k); 2];
            for (i, point) in pair.iter().enumerate() {
                let q = 2 * k + i;
                own[i] = self.ordered_row(q);
                let here = self.here(self.row(q), point, nodes)?;
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
}

impl Elastic for RubberEnergy {
    fn scale(&self) -> f64 {
        self.rubber.energy.shear_modulus() * self.thickest
    }

    fn is_mirrored(&self) -> bool {
        let points = || self.elements.iter().flatten();
        let largest = |of: fn(&Point) -> f64| points().map(of).fold(0.0, f64::max);
        let (weight, slope) = (largest(|p| p.weight), largest(|p| p.per_length));
        let length: f64 = self.elements.iter().map(|points| points[0].rest[0]).sum();
        // that of the length of the element
        let rounding = |p: &Point| (1e-12f64).max(4.0 * f64::EPSILON * length * p.per_length);
        let mut pairs = points().zip(self.elements.iter().rev().flat_map(|e| e.iter().rev()));
        pairs.all(|(a, b)| {
            (a.weight - b.weight).abs() <= 1e-12 * weight
                && (a.per_length - b.per_length).abs() <= rounding(a) * slope
        })
    }

    fn pull_into(&self, nodes: &[f64], out: &mut [f64]) -> Result<()> {
        self.both_into(nodes, 0.0, out).map(drop)
    }

    fn push_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()> {
        out.fill(0.0);
        for (e, element) in self.elements.iter().enumerate() {
            let window = self.reference.window(e);
            let points = nodes[window.clone()].as_chunks::<2>().0;
            let forces = out[window].as_chunks_mut::<2>().0;
            for (q, point) in element.iter().enumerate() {
                let row = self.row(q);
                let (d, y) = place(row, points);
                let [disc, ring] = point.volume(d, y).map(|by| intensity * by);
                add(forces, row, [disc, 0.0], ring);
            }
        }
        Ok(())
    }

    fn forces_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        _elastic: &mut [f64],
        out: &mut [f64],
    ) -> Result<Option<f64>> {
        self.both_into(nodes, intensity, out).map(Some)
    }

    fn layout(&self) -> Layout {
        Layout::elements(self.elements.len(), self.reference.nodes.len())
    }

    fn tangent_into(
        &self,
        nodes: &[f64],
        (pressure, least): (f64, f64),
        out: &mut Tangent,
    ) -> Result<()> {
        let state = (pressure, least * self.rubber.energy.shear_modulus());
        let mut columns = vec![0.0; 12 * self.reference.nodes.len()];
        out.band.clear();
        for (e, block) in out.blocks.iter_mut().enumerate() {
            let nodes = nodes[self.reference.window(e)].as_chunks().0;
            self.block_into(e, nodes, state, &mut columns, block)?;
        }
        Ok(())
    }

    fn energy(&self, nodes: &[f64], _start: &[f64]) -> Result<f64> {
        let mut sum = 0.0;
        self.each(nodes, |point, here| sum += point.weight * here.w.energy)?;
        Ok(sum)
    }

    fn least_tension(&self, nodes: &[f64]) -> Result<f64> {
        let mut least = f64::INFINITY;
        self.each(nodes, |point, here| {
            least = least.min(here.w.by[0] / (here.speed * point.per_length));
        })?;
        Ok(least / self.rubber.energy.shear_modulus())
    }

    fn add_mass_into(&self, scale: f64, fixed: &[usize], out: &mut Tangent) -> Result<()> {
        let size = 2 * self.reference.nodes.len();
        for (points, block) in self.elements.iter().zip(&mut out.blocks) {
            for (q, point) in points.iter().enumerate() {
                let (values, _) = self.ordered_row(q);
                for (i, a) in values.iter().enumerate() {
                    for (j, b) in values.iter().enumerate() {
                        let mass = scale * point.weight * a * b;
                        block[2 * i * size + 2 * j] += mass;
                        block[(2 * i + 1) * size + 2 * j + 1] += mass;
                    }
                }
            }
        }
        out.clear_in_blocks(fixed);
        Ok(())
    }
}

/// Returns rows `q` of two tables with `n` columns.
#[inline]
fn rows<'a>(values: &'a [f64], slopes: &'a [f64], q: usize, n: usize) -> Row<'a> {
    let range = q * n..(q + 1) * n;
    (&values[range.clone()], &slopes[range])
}
