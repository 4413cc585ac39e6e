//! Rubber between the nodes of finite differences: elements of two nodes, with the energy of `rubber_energy.rs`.

use std::f64::consts::PI;

use crate::discrete::Elastic;
use crate::error::{MembraneError, Result};
use crate::material::Rubber;
use crate::measures::Measure;
use crate::nodes::Nodes;
use crate::strain_energy::EnergyDerivatives;
use crate::tangent::{Layout, Tangent};

/// Rubber between the nodes of half a curve: two-node elements with W at both nodes.
///
/// An element of reference length l has pi l [ r h W(d / l, y / r) at its first node + the same at its last ]: the trapezoidal rule in S,
/// second order. The distance d of its nodes is common to both. A node on the axis, r = 0, has no energy.
#[derive(Debug)]
pub(crate) struct NodeRubber {
    rubber: Rubber,
    thickest: f64,
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
    ///
    /// # Errors
    /// [`MembraneError::NotMirrored`] for the thickness; a thickness or a distance from the axis that is not positive.
    pub(crate) fn new(rubber: &Rubber, nodes: Nodes, rest: &[[f64; 2]]) -> Result<Self> {
        let ds = 1.0 / (nodes.whole - 1) as f64;
        let thickness = |n: usize| rubber.thickness.at(n as f64 * ds);
        let mut thickest = 0.0f64;
        let mut weights = Vec::with_capacity(rest.len());
        for (n, point) in rest.iter().enumerate() {
            let (h, image) = (thickness(n)?, thickness(nodes.whole - 1 - n)?);
            if (h - image).abs() > 1e-12 * h {
                return Err(MembraneError::NotMirrored);
            }
            thickest = thickest.max(h);
            let on_axis = nodes.has_apex() && n + 1 == rest.len();
            let radius = match on_axis {
                true => 0.0,
                false => rubber.radius(point[1], n as f64 * ds)?,
            };
            weights.push(PI * radius * h);
        }
        let length = |p: &[[f64; 2]]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
        Ok(Self {
            rubber: rubber.clone(),
            thickest,
            lengths: rest.windows(2).map(length).collect(),
            radii: rest.iter().map(|p| p[1]).collect(),
            weights,
        })
    }

    /// Returns W at stretch `l1` along the curve at node `n`, whose distance from the axis is `y`; zero on the axis.
    #[inline]
    fn strained(&self, n: usize, l1: f64, y: f64) -> Result<EnergyDerivatives> {
        match self.weights[n] {
            0.0 => Ok(EnergyDerivatives::NONE),
            _ => self.rubber.energy.at(l1, y / self.radii[n]),
        }
    }

    #[inline]
    fn segment(&self, points: &[[f64; 2]], n: usize) -> Result<Segment> {
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

    /// Returns weight and W of the half element between the last node and the axis, if any: l1 = l2 there.
    fn last(&self, points: &[[f64; 2]]) -> Result<Option<(f64, EnergyDerivatives)>> {
        let n = points.len() - 1;
        if self.weights[n] == 0.0 {
            return Ok(None);
        }
        let l = points[n][1] / self.radii[n];
        let weight = self.radii[n] * self.weights[n];
        Ok(Some((weight, self.rubber.energy.at(l, l)?)))
    }
}

impl Elastic for NodeRubber {
    fn scale(&self) -> f64 {
        self.rubber.energy.shear_modulus() * self.thickest
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    fn pull_into(&self, nodes: &[f64], out: &mut [f64]) -> Result<()> {
        let (points, forces) = (nodes.as_chunks::<2>().0, out.as_chunks_mut::<2>().0);
        forces.fill([0.0; 2]);
        for n in 0..points.len() - 1 {
            let s = self.segment(points, n)?;
            let tension = s.sum(|w| w.by[0]) / s.length;
            for k in 0..2 {
                forces[n][k] += tension * s.unit[k];
                forces[n + 1][k] -= tension * s.unit[k];
            }
            for (end, m) in [n, n + 1].into_iter().enumerate() {
                if s.weights[end] != 0.0 {
                    forces[m][1] -= s.weights[end] * s.ends[end].by[1] / self.radii[m];
                }
            }
        }
        if let Some((weight, w)) = self.last(points)? {
            let end = points.len() - 1;
            forces[end][1] -= weight * (w.by[0] + w.by[1]) / self.radii[end];
        }
        Ok(())
    }

    fn push_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()> {
        Measure::Volume.gradient(nodes.as_chunks().0, true, out.as_chunks_mut().0);
        out.iter_mut().for_each(|value| *value *= intensity);
        Ok(())
    }

    fn layout(&self) -> Layout {
        Layout::band(2 * self.radii.len(), 3)
    }

    fn tangent_into(
        &self,
        nodes: &[f64],
        (pressure, least): (f64, f64),
        out: &mut Tangent,
    ) -> Result<()> {
        // of dx, dy, y_a, y_b; these by x_a, y_a, x_b, y_b
        const BY: [[f64; 4]; 4] = [
            [-1.0, 0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let points = nodes.as_chunks::<2>().0;
        let least = least * self.rubber.energy.shear_modulus();
        out.band.clear();
        for n in 0..points.len() - 1 {
            let s = self.segment(points, n)?;
            let least = least * (s.weights[0] + s.weights[1]) / (s.length * s.length);
            let hoop = [n, n + 1].map(|m| match self.weights[m] {
                0.0 => 0.0,
                _ => 1.0 / self.radii[m],
            });
            let second = s.second(hoop, least);
            let volume = volume_second(points[n], points[n + 1]);
            for i in 0..4 {
                for j in 0..4 {
                    let mut sum = 0.0;
                    for (k, by) in BY.iter().enumerate() {
                        for (l, other) in BY.iter().enumerate() {
                            sum += by[i] * other[j] * (pressure * volume[k][l] - second[k][l]);
                        }
                    }
                    out.band.add_inside(2 * n + i, 2 * n + j, sum);
                }
            }
        }
        if let Some((weight, w)) = self.last(points)? {
            let n = points.len() - 1;
            let [aa, ab, bb] = w.second;
            let value = -weight * (aa + 2.0 * ab + bb) / (self.radii[n] * self.radii[n]);
            out.band.add_inside(2 * n + 1, 2 * n + 1, value);
        }
        Ok(())
    }

    fn energy(&self, nodes: &[f64], _start: &[f64]) -> Result<f64> {
        let points = nodes.as_chunks().0;
        let mut sum = 0.0;
        for n in 0..points.len() - 1 {
            let Segment { weights, ends, .. } = self.segment(points, n)?;
            sum += weights[0] * ends[0].energy + weights[1] * ends[1].energy;
        }
        let last = self.last(points)?;
        Ok(sum + last.map_or(0.0, |(weight, w)| weight * w.energy))
    }

    /// Averages the tension over an element.
    fn least_tension(&self, nodes: &[f64]) -> Result<f64> {
        let mut least = f64::INFINITY;
        for n in 0..self.lengths.len() {
            let s = self.segment(nodes.as_chunks().0, n)?;
            let area = s.weights[0] + s.weights[1];
            least = least.min(s.sum(|w| w.by[0]) * s.length / (s.distance * area));
        }
        Ok(least / self.rubber.energy.shear_modulus())
    }

    /// The mass of a node is half of that of its elements.
    fn add_mass_into(&self, scale: f64, fixed: &[usize], out: &mut Tangent) -> Result<()> {
        let mut masses = vec![0.0; self.radii.len()];
        for (n, length) in self.lengths.iter().enumerate() {
            let half = 0.5 * length * (self.weights[n] + self.weights[n + 1]);
            masses[n] += half;
            masses[n + 1] += half;
        }
        let last = self.radii.len() - 1;
        masses[last] += self.radii[last] * self.weights[last];
        let moving = (0..2 * masses.len()).filter(|i| !fixed.contains(i));
        moving.for_each(|i| out.band.add_inside(i, i, scale * masses[i / 2]));
        Ok(())
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
