//! The material: springs or rubber. Contains everything of a discretised membrane that depends on the material, except the energy of rubber
//! (`strain_energy.rs`) and its derivatives by the nodes (`rubber_nodes.rs`, `rubber_energy.rs`).
//!
//! A spring pulls with its stiffness times the difference of the displacements u = c - c0 of its ends: in the limit of fine meshes the
//! force is (lambda u')', the energy the integral of lambda |u'|^2 / 2. Force and energy are those of straight springs of zero natural
//! length, so the tangent does not depend on the state, x and y do not mix, and there is no hoop tension. [`NodeSprings::energy`] uses
//! this, and in `membrane-implicit` the implicit splitting and the account of a scheme's own losses.

use std::f64::consts::PI;

use crate::band::BandMatrix;
use crate::chebyshev::{Reference, gauss_legendre};
use crate::error::{MembraneError, positive};
use crate::half::Nodes;
use crate::profile::{Stiffness, Thickness};
use crate::strain_energy::StrainEnergy;

/// The material of a membrane.
#[derive(Debug, Clone)]
pub enum Material {
    /// The paper's springs: a force against the displacement, without hoop tension.
    Springs {
        /// lambda(s) between neighbours.
        stiffness: Stiffness,
        /// lambda_2(s) between second neighbours, if any.
        second: Option<Stiffness>,
    },
    /// Rubber, with tensions along the meridian and around the axis.
    Rubber(Rubber),
}

/// A sheet of incompressible rubber.
#[derive(Debug, Clone)]
pub struct Rubber {
    pub(crate) energy: StrainEnergy,
    pub(crate) thickness: Thickness,
}

impl Rubber {
    /// Creates a sheet of strain energy `energy` and reference thickness `thickness` (cm).
    ///
    /// # Errors
    /// Those of [`StrainEnergy::check`].
    pub fn new(energy: StrainEnergy, thickness: Thickness) -> Result<Self, MembraneError> {
        energy.check()?;
        Ok(Self { energy, thickness })
    }

    /// Returns the strain energy.
    #[must_use]
    pub fn energy(&self) -> &StrainEnergy {
        &self.energy
    }

    /// Returns the reference thickness.
    #[must_use]
    pub fn thickness(&self) -> &Thickness {
        &self.thickness
    }

    /// The distance from the axis of a reference curve that is at `y` at `s`; only the apex is on the axis.
    pub(crate) fn radius(&self, y: f64, s: f64) -> Result<f64, MembraneError> {
        positive(
            "distance of rubber from the axis at rest",
            if s > 0.5 { -y } else { y },
        )
    }
}

/// Springs between the nodes of finite differences.
#[derive(Debug, Clone)]
pub(crate) struct NodeSprings {
    pub(crate) nodes: Nodes,
    pub(crate) ds: f64,
    /// Reference positions of the nodes of the state.
    pub(crate) rest: Vec<f64>,
    /// lambda at s_(n + 1/2), between neighbours of the whole curve.
    pub(crate) first: Vec<f64>,
    /// lambda_2 at s_n, between the neighbours of a node, or empty.
    pub(crate) second: Vec<f64>,
}

impl NodeSprings {
    /// Creates the springs between the nodes of `rest`.
    pub(crate) fn new(
        stiffness: &Stiffness,
        second: Option<&Stiffness>,
        rest: Vec<f64>,
    ) -> Result<Self, MembraneError> {
        let (whole, kept) = (rest.len() / 2, rest.len() / 2);
        let last = whole - 1;
        let first = (0..last).map(|n| stiffness.at((n as f64 + 0.5) / last as f64));
        let first = first.collect::<Result<_, _>>()?;
        let second = match second {
            Some(second) => (0..=last)
                .map(|n| second.at(n as f64 / last as f64))
                .collect::<Result<_, _>>()?,
            None => Vec::new(),
        };
        Ok(Self {
            nodes: Nodes { whole, kept },
            ds: 1.0 / last as f64,
            rest,
            first,
            second,
        })
    }

    /// Largest stiffness of any spring, second neighbours counted as 4 lambda_2.
    pub(crate) fn scale(&self) -> f64 {
        let largest = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        largest(&self.first) + 4.0 * largest(&self.second)
    }

    /// Whether the profile is mirror-symmetric to rounding.
    pub(crate) fn are_symmetric(&self) -> bool {
        let scale = self.scale();
        let even = |v: &[f64]| {
            let mut pairs = v.iter().zip(v.iter().rev());
            pairs.all(|(a, b)| (a - b).abs() <= 1e-13 * scale)
        };
        even(&self.first) && even(&self.second)
    }

    /// Pressure per current length at which the curve runs to infinity. From spring to spring the tangent turns by
    /// 2 atan(p ds / (2 lambda)), and the bound is reached when that adds up to 2 pi (2 pi over the integral of 1 / lambda as
    /// ds -> 0). Second neighbours count as 4 lambda_2. Cost O(N).
    pub(crate) fn blow_up(&self) -> f64 {
        let second = |n: usize| {
            self.second
                .get(n)
                .zip(self.second.get(n + 1))
                .map_or(0.0, |(a, b)| 2.0 * (a + b))
        };
        let springs = self.first.iter().enumerate();
        let half: Vec<f64> = springs
            .map(|(n, first)| 0.5 * self.ds / (first + second(n)))
            .collect();
        // Newton from below on a function that is concave: every step stays on the same side
        let mut pressure = PI / half.iter().sum::<f64>();
        for _ in 0..50 {
            let turned: f64 = half.iter().map(|h| (pressure * h).atan()).sum();
            let slope: f64 = half
                .iter()
                .map(|h| h / (1.0 + (pressure * h).powi(2)))
                .sum();
            let step = (PI - turned) / slope;
            pressure += step;
            if step.abs() <= 1e-15 * pressure {
                break;
            }
        }
        pressure
    }

    /// `out` = F_e except in fixed rows.
    pub(crate) fn pull_into(&self, nodes: &[f64], out: &mut [[f64; 2]]) {
        let scale = 1.0 / (self.ds * self.ds);
        let Self { first, second, .. } = self;
        let (c, c0) = (nodes.as_chunks::<2>().0, self.rest.as_chunks::<2>().0);
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
                let [(right, r), (left, l)] = self.second_springs(n);
                let (right, left, r, l) = (u(right), u(left), scale * r, scale * l);
                for k in 0..2 {
                    out[n][k] += r * (right[k] - here[k]) + l * (left[k] - here[k]);
                }
            }
        }
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

    /// `band` += `scale` dF_e/dc.
    pub(crate) fn add_tangent_into(&self, scale: f64, band: &mut BandMatrix) {
        let scale = scale / (self.ds * self.ds);
        for n in self.nodes.moving() {
            for k in 0..2 {
                if self.nodes.is_fixed(n, k) {
                    continue;
                }
                let mut spring = |(m, stiffness): (usize, f64)| {
                    let (at, sign) = self.nodes.place(m);
                    let sign = if k == 0 { 1.0 } else { sign };
                    band.add_inside(2 * n + k, 2 * at + k, sign * scale * stiffness);
                    band.add_inside(2 * n + k, 2 * n + k, -scale * stiffness);
                };
                spring((n + 1, self.first[n]));
                spring((n - 1, self.first[n - 1]));
                if !self.second.is_empty() {
                    self.second_springs(n).into_iter().for_each(spring);
                }
            }
        }
    }

    /// Energy of the whole curve at `nodes` above that at `start`.
    pub(crate) fn energy(&self, nodes: &[f64], start: &[f64]) -> f64 {
        let (mut here, mut there) = (
            vec![[0.0; 2]; nodes.len() / 2],
            vec![[0.0; 2]; nodes.len() / 2],
        );
        self.pull_into(nodes, &mut here);
        self.pull_into(start, &mut there);
        let (here, there) = (here.as_flattened(), there.as_flattened());
        // The force is linear in the position: the average of both ends integrates it. Fixed nodes do not contribute.
        let work = |i: usize| 0.5 * (here[i] + there[i]) * (nodes[i] - start[i]);
        // A node on the axis has no image.
        let images = 2 * (self.nodes.whole - self.nodes.kept);
        let whole = (0..nodes.len()).map(work).sum::<f64>() + (0..images).map(work).sum::<f64>();
        -self.ds * whole
    }
}

/// The springs of a spectral element.
#[derive(Debug, Clone)]
pub(crate) struct ElementSprings {
    /// Reference positions at the nodes, with one-sided limits at the ends.
    rest: Vec<[f64; 2]>,
    /// Row i of d/ds lambda d/ds; first row lambda d/ds, last row -lambda d/ds at the end points.
    pub(crate) matrix: Vec<f64>,
}

impl ElementSprings {
    /// Creates the springs of an element of this length from reference positions and stiffness at its nodes.
    pub(crate) fn new(
        reference: &Reference,
        rest: Vec<[f64; 2]>,
        stiffness: &[f64],
        length: f64,
    ) -> Self {
        let n = stiffness.len();
        let d = &reference.derivative;
        let mut matrix = vec![0.0; n * n];
        for j in 0..n {
            for i in 1..n - 1 {
                let sum: f64 = (0..n)
                    .map(|k| d[i * n + k] * stiffness[k] * d[k * n + j])
                    .sum();
                matrix[i * n + j] = sum / (length * length);
            }
            matrix[j] = stiffness[0] * d[j] / length;
            matrix[(n - 1) * n + j] = -stiffness[n - 1] * d[(n - 1) * n + j] / length;
        }
        Self { rest, matrix }
    }

    /// `out` += the pull at the nodes.
    pub(crate) fn add_pull_into(&self, nodes: &[[f64; 2]], out: &mut [[f64; 2]]) {
        for (out, row) in out.iter_mut().zip(self.matrix.chunks_exact(nodes.len())) {
            let mut sum = [0.0; 2];
            for ((a, c), c0) in row.iter().zip(nodes).zip(&self.rest) {
                sum[0] += a * (c[0] - c0[0]);
                sum[1] += a * (c[1] - c0[1]);
            }
            out[0] += sum[0];
            out[1] += sum[1];
        }
    }

    /// Whether `other` is the mirror image, to rounding.
    pub(crate) fn mirrors(&self, other: &Self) -> bool {
        let size = self.matrix.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut pairs = self.matrix.iter().zip(other.matrix.iter().rev());
        pairs.all(|(a, b)| (a - b).abs() <= 1e-13 * size)
    }
}

/// Integral of 1 / lambda between `from` and `to`: a Gauss rule on more and more panels until it
/// no longer changes, whatever the degree of the elements.
pub(crate) fn compliance(
    stiffness: impl Fn(f64) -> Result<f64, MembraneError>,
    from: f64,
    to: f64,
) -> Result<f64, MembraneError> {
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
