//! Rubber between the nodes of finite differences: forces and tangents as derivatives of its energy by its nodes.
//!
//! ```text
//! E[c] = integral of 2 pi r0 h W(l1, l2) dS - p V[c],     l1 = |dc/dS|,  l2 = y / r0
//! ```
//!
//! over the meridian from the fixed end to the axis: S is its reference length, r0 its reference distance from the axis, h its thickness.
//! Forces are -dE/dc, tangents minus the second derivatives and so symmetric. A node on the axis, r0 = 0, has no energy.

use std::f64::consts::PI;

use crate::band::BandMatrix;
use crate::error::MembraneError;
use crate::half::Nodes;
use crate::material::Rubber;
use crate::strain_energy::EnergyDerivatives;

/// Rubber between the nodes of half a curve: two-node elements with W at both nodes.
///
/// An element of reference length l has pi l [ r h W(d / l, y / r) at its first node + the same at its last ]: the trapezoidal rule in S,
/// second order. The distance d of its nodes is common to both.
#[derive(Debug, Clone)]
pub(crate) struct NodeRubber {
    pub(crate) rubber: Rubber,
    nodes: Nodes,
    /// Reference lengths between neighbours.
    lengths: Vec<f64>,
    /// Reference distances from the axis.
    radii: Vec<f64>,
    /// pi r h.
    weights: Vec<f64>,
}

/// The state of an element: W at its ends, its length and direction.
struct Segment {
    /// pi l r h of its ends.
    weights: [f64; 2],
    ends: [EnergyDerivatives; 2],
    length: f64,
    distance: f64,
    unit: [f64; 2],
}

impl NodeRubber {
    /// Creates the rubber of the half curve `rest`.
    pub(crate) fn new(
        rubber: &Rubber,
        nodes: Nodes,
        rest: &[[f64; 2]],
        positions: impl Iterator<Item = f64>,
    ) -> Result<Self, MembraneError> {
        let on_axis = 2 * nodes.kept == nodes.whole + 1;
        let mut weights = Vec::with_capacity(rest.len());
        for (n, (point, s)) in rest.iter().zip(positions).enumerate() {
            let radius = match on_axis && n + 1 == rest.len() {
                true => 0.0,
                false => rubber.radius(point[1], s)?,
            };
            weights.push(PI * radius * rubber.thickness.at(s)?);
        }
        let length = |p: &[[f64; 2]]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
        Ok(Self {
            rubber: rubber.clone(),
            nodes,
            lengths: rest.windows(2).map(length).collect(),
            radii: rest.iter().map(|p| p[1]).collect(),
            weights,
        })
    }

    /// Returns W at stretch `l1` along the curve at node `n`, whose distance from the axis is `y`; zero on the axis.
    #[inline]
    fn strained(&self, n: usize, l1: f64, y: f64) -> Result<EnergyDerivatives, MembraneError> {
        match self.weights[n] {
            0.0 => Ok(EnergyDerivatives::NONE),
            _ => self.rubber.energy.at(l1, y / self.radii[n]),
        }
    }

    #[inline]
    fn segment(&self, points: &[[f64; 2]], n: usize) -> Result<Segment, MembraneError> {
        let (a, b) = (points[n], points[n + 1]);
        let d = [b[0] - a[0], b[1] - a[1]];
        let distance = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let length = self.lengths[n];
        let l1 = distance / length;
        Ok(Segment {
            weights: [length * self.weights[n], length * self.weights[n + 1]],
            ends: [self.strained(n, l1, a[1])?, self.strained(n + 1, l1, b[1])?],
            length,
            distance,
            unit: [d[0] / distance, d[1] / distance],
        })
    }

    /// Returns the half element between the last node and the axis, if any: l1 = l2 there.
    fn last(&self, points: &[[f64; 2]]) -> Result<Option<(f64, EnergyDerivatives)>, MembraneError> {
        let n = points.len() - 1;
        if self.weights[n] == 0.0 {
            return Ok(None);
        }
        let l = points[n][1] / self.radii[n];
        let weight = self.radii[n] * self.weights[n];
        Ok(Some((weight, self.rubber.energy.at(l, l)?)))
    }

    /// Whether every stretch is within the limits of the rubber.
    pub(crate) fn check(&self, points: &[[f64; 2]]) -> Result<(), MembraneError> {
        for n in 0..points.len() - 1 {
            self.segment(points, n)?;
        }
        self.last(points).map(drop)
    }

    /// Least dW/dl1 over l1 and the shear modulus, averaged over an element.
    pub(crate) fn least_tension(&self, points: &[[f64; 2]]) -> Result<f64, MembraneError> {
        let mut least = f64::INFINITY;
        for n in 0..points.len() - 1 {
            let s = self.segment(points, n)?;
            let area = s.weights[0] + s.weights[1];
            least = least.min(s.sum(|w| w.by[0]) * s.length / (s.distance * area));
        }
        Ok(least / self.rubber.energy.shear_modulus())
    }

    /// Energy of the body.
    pub(crate) fn energy(&self, points: &[[f64; 2]]) -> Result<f64, MembraneError> {
        let mut sum = 0.0;
        for n in 0..points.len() - 1 {
            let Segment { weights, ends, .. } = self.segment(points, n)?;
            sum += weights[0] * ends[0].energy + weights[1] * ends[1].energy;
        }
        let last = self.last(points)?;
        Ok(sum + last.map_or(0.0, |(weight, w)| weight * w.energy))
    }

    /// Mass of each node at density 1: half of that of its elements.
    fn masses(&self) -> Vec<f64> {
        let mut masses = vec![0.0; self.radii.len()];
        for (n, length) in self.lengths.iter().enumerate() {
            let half = 0.5 * length * (self.weights[n] + self.weights[n + 1]);
            masses[n] += half;
            masses[n + 1] += half;
        }
        let last = self.radii.len() - 1;
        masses[last] += self.radii[last] * self.weights[last];
        masses
    }

    /// `band` += `scale` times the mass of each node, in the rows of moving nodes.
    pub(crate) fn add_mass_into(&self, scale: f64, band: &mut BandMatrix) {
        for (n, mass) in self.masses().into_iter().enumerate() {
            for i in [2 * n, 2 * n + 1] {
                self.add(i, i, scale * mass, band);
            }
        }
    }

    /// `out` = minus the derivative of the energy.
    pub(crate) fn pull_into(
        &self,
        points: &[[f64; 2]],
        out: &mut [[f64; 2]],
    ) -> Result<(), MembraneError> {
        out.fill([0.0; 2]);
        for n in 0..points.len() - 1 {
            let s = self.segment(points, n)?;
            let tension = s.sum(|w| w.by[0]) / s.length;
            for k in 0..2 {
                out[n][k] += tension * s.unit[k];
                out[n + 1][k] -= tension * s.unit[k];
            }
            for (end, m) in [n, n + 1].into_iter().enumerate() {
                if s.weights[end] != 0.0 {
                    out[m][1] -= s.weights[end] * s.ends[end].by[1] / self.radii[m];
                }
            }
        }
        if let (Some((weight, w)), Some(end)) = (self.last(points)?, out.last_mut()) {
            end[1] -= weight * (w.by[0] + w.by[1]) / self.radii[points.len() - 1];
        }
        Ok(())
    }

    /// `band` += the derivative of forces and of `pressure` times the gradient of the volume, with a tension of at least `least`.
    pub(crate) fn add_tangent_into(
        &self,
        points: &[[f64; 2]],
        pressure: f64,
        least: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        let least = least * self.rubber.energy.shear_modulus();
        for n in 0..points.len() - 1 {
            let s = self.segment(points, n)?;
            let least = least * (s.weights[0] + s.weights[1]) / (s.length * s.length);
            let hoop = [n, n + 1].map(|m| match self.weights[m] {
                0.0 => 0.0,
                _ => 1.0 / self.radii[m],
            });
            let second = s.second(hoop, least);
            let volume = volume_second(points[n], points[n + 1]);
            // of dx, dy, y_a, y_b; these by x_a, y_a, x_b, y_b
            const BY: [[f64; 4]; 4] = [
                [-1.0, 0.0, 1.0, 0.0],
                [0.0, -1.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0],
            ];
            for i in 0..4 {
                for j in 0..4 {
                    let mut sum = 0.0;
                    for (k, by) in BY.iter().enumerate() {
                        for (l, other) in BY.iter().enumerate() {
                            sum += by[i] * other[j] * (pressure * volume[k][l] - second[k][l]);
                        }
                    }
                    self.add(2 * n + i, 2 * n + j, sum, band);
                }
            }
        }
        if let Some((weight, w)) = self.last(points)? {
            let n = points.len() - 1;
            let [aa, ab, bb] = w.second;
            let square = self.radii[n] * self.radii[n];
            let value = -weight * (aa + 2.0 * ab + bb) / square;
            self.add(2 * n + 1, 2 * n + 1, value, band);
        }
        Ok(())
    }

    /// Adds to the rows of moving nodes.
    #[inline]
    fn add(&self, i: usize, j: usize, value: f64, band: &mut BandMatrix) {
        let (node, k) = (i / 2, i % 2);
        if node > 0 && !self.nodes.is_fixed(node, k) {
            band.add_inside(i, j, value);
        }
    }
}

impl Segment {
    #[inline]
    fn sum(&self, of: impl Fn(&EnergyDerivatives) -> f64) -> f64 {
        let end = |k: usize| match self.weights[k] {
            0.0 => 0.0,
            weight => weight * of(&self.ends[k]),
        };
        end(0) + end(1)
    }

    /// Second derivatives of its energy by dx, dy and the y of both ends; `hoop` is one over their radii.
    fn second(&self, hoop: [f64; 2], least: f64) -> [[f64; 4]; 4] {
        let along = self.sum(|w| w.second[0]) / (self.length * self.length);
        let across = (self.sum(|w| w.by[0]) / (self.length * self.distance)).max(least);
        let [x, y] = self.unit;
        let mut out = [[0.0; 4]; 4];
        out[0][0] = along * x * x + across * y * y;
        out[1][1] = along * y * y + across * x * x;
        out[0][1] = (along - across) * x * y;
        out[1][0] = out[0][1];
        for k in 0..2 {
            let weight = self.weights[k] * hoop[k];
            let mixed = weight * self.ends[k].second[1] / self.length;
            for (i, unit) in [x, y].into_iter().enumerate() {
                out[i][2 + k] = mixed * unit;
                out[2 + k][i] = mixed * unit;
            }
            out[2 + k][2 + k] = weight * self.ends[k].second[2] * hoop[k];
        }
        out
    }
}

/// Second derivatives of the frustum's volume pi/3 dx (a^2 + a b + b^2) by dx, dy and the y of both ends.
fn volume_second([ax, a]: [f64; 2], [bx, b]: [f64; 2]) -> [[f64; 4]; 4] {
    let c = PI / 3.0;
    let dx = c * (bx - ax);
    let (by_a, by_b) = (c * (2.0 * a + b), c * (a + 2.0 * b));
    [
        [0.0, 0.0, by_a, by_b],
        [0.0; 4],
        [by_a, 0.0, 2.0 * dx, dx],
        [by_b, 0.0, dx, 2.0 * dx],
    ]
}
