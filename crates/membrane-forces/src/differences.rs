//! The paper's second-order finite differences (3.1.2, with its scale corrected).

use std::f64::consts::PI;

use crate::band::BandMatrix;
use crate::error::{MembraneError, finite};
use crate::law::{LoadKind, PressureLaw};
use crate::measures::Measure;
use crate::membrane::Membrane;

/// A membrane at N equally spaced material points s_n = n ds, ds = 1 / (N - 1).
///
/// States and forces are flat: x0, y0, x1, y1, ..., 2 N numbers. Forces are per unit s:
///
/// ```text
/// F_e(n) = [ l(n+1/2) (u(n+1) - u(n)) + l(n-1/2) (u(n-1) - u(n))
///          + l2(n+1)  (u(n+2) - u(n)) + l2(n-1)  (u(n-2) - u(n)) ] / ds^2,      u = c - c0
/// F_p(n) = f (-d_y, d_x) / |d|      d = c(n+1) - c(n-1)      laws per material length, total force
/// F_p(n) = p (-d_y, d_x) / (2 ds)                            law per current length
/// ```
///
/// The two end nodes are held: their forces and their rows in every tangent are zero. A node
/// next to an end has no second neighbour on that side; its spring goes to the mirror image
/// u(-1) = 2 u(0) - u(1), which keeps the order two and the matrix symmetric.
///
/// [`FiniteDifferences::half`] keeps only the nodes up to the axis if the problem is its own mirror
/// image: a neighbour beyond it is then the image (x, -y) of the node N - 1 - n. The forces are
/// those of the whole curve. An odd N has a node on the axis, free along it and held on it; with an
/// even N the axis lies between the last node and its image.
///
/// Errors are of order ds^2 where lambda is smooth. Where it jumps c' does, and with it the normal, of which a
/// node has one: order ds under the laws per material length and total force (a jump at a node is best;
/// spectral elements with a breakpoint there lose nothing).
///
/// The `intensity` that pressure functions take is f or p: the load itself, or under the total-force law
/// the load over the surface, F / S(c), with S from [`FiniteDifferences::measure`].
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    law: PressureLaw,
    ds: f64,
    /// At the nodes of the state, as `start`.
    pub(crate) rest: Vec<f64>,
    pub(crate) start: Vec<f64>,
    /// lambda at s_(n + 1/2), of the whole curve.
    pub(crate) first: Vec<f64>,
    /// lambda_2 at s_n, of the whole curve, or empty.
    pub(crate) second: Vec<f64>,
}

/// Ten thousand times what resolves any balloon; some gigabytes with the solver's arrays.
const MOST_NODES: usize = 10_000_000;

impl FiniteDifferences {
    /// Samples `membrane` at `n_nodes` points. Cost O(N).
    ///
    /// # Errors
    /// Fewer than three nodes or more than ten million, a stiffness that is not positive at a sample, or coinciding
    /// neighbours in the rest shape.
    pub fn new(membrane: &Membrane, n_nodes: usize) -> Result<Self, MembraneError> {
        if n_nodes < 3 {
            return Err(MembraneError::TooFew {
                quantity: "nodes",
                given: n_nodes,
                least: 3,
            });
        }
        if n_nodes > MOST_NODES {
            return Err(MembraneError::TooMany {
                quantity: "nodes",
                given: n_nodes,
                most: MOST_NODES,
            });
        }
        let last = n_nodes - 1;
        let ds = 1.0 / last as f64;
        let mut rest = Vec::with_capacity(2 * n_nodes);
        for n in 0..n_nodes {
            let position = membrane.rest().at(n as f64 / last as f64).position;
            for value in position {
                rest.push(finite("rest curve", value)?);
            }
        }
        for index in 0..last {
            if rest[2 * index..2 * index + 2] == rest[2 * index + 2..2 * index + 4] {
                return Err(MembraneError::CoincidentPoints { index });
            }
        }
        let first = (0..last)
            .map(|n| membrane.stiffness().at((n as f64 + 0.5) / last as f64))
            .collect::<Result<_, _>>()?;
        let second = match membrane.second_neighbours() {
            Some(stiffness) => (0..n_nodes)
                .map(|n| stiffness.at(n as f64 / last as f64))
                .collect::<Result<_, _>>()?,
            None => Vec::new(),
        };
        let mut start = rest.clone();
        let s = |n: usize| n as f64 / last as f64;
        membrane.hold_ends((0..n_nodes).map(s).zip(start.as_chunks_mut::<2>().0));
        Ok(Self {
            law: membrane.law(),
            ds,
            rest,
            start,
            first,
            second,
        })
    }

    /// Number of nodes N of the whole curve, held ends included.
    pub fn n_nodes(&self) -> usize {
        self.first.len() + 1
    }

    /// Spacing of the material coordinate.
    pub fn ds(&self) -> f64 {
        self.ds
    }

    /// Pressure law of the membrane.
    pub fn law(&self) -> PressureLaw {
        self.law
    }

    /// Rest shape at the nodes, flat.
    pub fn rest(&self) -> &[f64] {
        &self.rest
    }

    /// The rest shape moved to where the membrane is held ([`Membrane::with_ends`]): where solvers
    /// start.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// Largest stiffness of any spring, second neighbours counted as 4 lambda_2.
    pub fn stiffness_scale(&self) -> f64 {
        let largest = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        largest(&self.first) + 4.0 * largest(&self.second)
    }

    /// Intensity at which the law per current length has no equilibrium any more and the curve
    /// runs to infinity; infinite under the other laws. From spring to spring the tangent turns by
    /// 2 atan(p ds / (2 lambda)), and the bound is reached when that adds up to 2 pi (2 pi over
    /// the integral of 1 / lambda as ds -> 0). Second neighbours count as 4 lambda_2. Cost O(N).
    pub fn blow_up(&self) -> f64 {
        if !self.law.blows_up() {
            return f64::INFINITY;
        }
        let second = |n: usize| {
            self.second
                .get(n)
                .zip(self.second.get(n + 1))
                .map_or(0.0, |(a, b)| 2.0 * (a + b))
        };
        let half: Vec<f64> = self
            .first
            .iter()
            .enumerate()
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

    /// Half bandwidth of every tangent: 3, or 4 with second neighbours.
    pub fn bandwidth(&self) -> usize {
        if self.second.is_empty() { 3 } else { 4 }
    }

    /// A zero matrix of the shape every tangent of this membrane fits.
    pub fn band(&self) -> BandMatrix {
        BandMatrix::of_shape(self.rest.len(), self.bandwidth(), self.bandwidth())
    }

    /// `out` = elastic force F_e per unit s.
    ///
    /// # Panics
    /// A length that is not that of [`FiniteDifferences::start`].
    pub fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        self.check(nodes, out);
        let scale = 1.0 / (self.ds * self.ds);
        let (c, c0) = (nodes.as_chunks::<2>().0, self.rest.as_chunks::<2>().0);
        let out = out.as_chunks_mut::<2>().0;
        let u = |m: usize| {
            let (at, sign) = self.place(m);
            [c[at][0] - c0[at][0], sign * (c[at][1] - c0[at][1])]
        };
        // The pull of each spring is computed once, and serves the nodes at both of its ends.
        let (mut here, mut before) = (u(0), [0.0; 2]);
        let next = c[1..].iter().zip(&c0[1..]);
        for ((out, stiffness), (c, c0)) in out.iter_mut().zip(&self.first).zip(next) {
            let there = [c[0] - c0[0], c[1] - c0[1]];
            let k = scale * stiffness;
            let pull = [k * (there[0] - here[0]), k * (there[1] - here[1])];
            *out = [pull[0] - before[0], pull[1] - before[1]];
            (here, before) = (there, pull);
        }
        let count = out.len();
        if self.is_half() {
            let there = u(count);
            let k = scale * self.first[count - 1];
            for i in 0..2 {
                out[count - 1][i] = k * (there[i] - here[i]) - before[i];
            }
        }
        if !self.second.is_empty() {
            let last = self.n_nodes() - 1;
            for n in self.moving() {
                let here = u(n);
                let right = if n + 1 < last {
                    (u(n + 2), 1.0)
                } else {
                    (u(last), 2.0)
                };
                let left = if n > 1 { (u(n - 2), 1.0) } else { (u(0), 2.0) };
                let (r, l) = (
                    scale * self.second[n + 1] * right.1,
                    scale * self.second[n - 1] * left.1,
                );
                for k in 0..2 {
                    out[n][k] += r * (right.0[k] - here[k]) + l * (left.0[k] - here[k]);
                }
            }
        }
        self.clear_held(out);
    }

    /// `band` += `scale` dF_e/dc. Block tridiagonal with diagonal blocks; pentadiagonal with
    /// second neighbours; independent of the state; symmetric among interior nodes.
    ///
    /// # Panics
    /// `band` has not the rows, or not the diagonals, of [`FiniteDifferences::band`].
    pub fn add_elastic_tangent_into(&self, scale: f64, band: &mut BandMatrix) {
        self.check_band(band);
        let last = self.n_nodes() - 1;
        let scale = scale / (self.ds * self.ds);
        for n in self.moving() {
            for k in 0..2 {
                if self.is_held(n, k) {
                    continue;
                }
                let mut spring = |m: usize, stiffness: f64| {
                    let (at, sign) = self.place(m);
                    let sign = if k == 0 { 1.0 } else { sign };
                    band.add_inside(2 * n + k, 2 * at + k, sign * scale * stiffness);
                    band.add_inside(2 * n + k, 2 * n + k, -scale * stiffness);
                };
                spring(n + 1, self.first[n]);
                spring(n - 1, self.first[n - 1]);
                if !self.second.is_empty() {
                    if n + 1 < last {
                        spring(n + 2, self.second[n + 1])
                    } else {
                        spring(last, 2.0 * self.second[last])
                    }
                    if n > 1 {
                        spring(n - 2, self.second[n - 1])
                    } else {
                        spring(0, 2.0 * self.second[0])
                    }
                }
            }
        }
    }

    /// `out` = pressure force F_p per unit s at force intensity `intensity`; it is linear in
    /// the intensity, so intensity 1 gives dF_p / d intensity.
    ///
    /// # Errors
    /// The neighbours of a node coincide, so its normal is undefined.
    ///
    /// # Panics
    /// A length that is not that of [`FiniteDifferences::start`].
    pub fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        self.check(nodes, out);
        let flat = nodes;
        let nodes = nodes.as_chunks::<2>().0;
        let out = out.as_chunks_mut::<2>().0;
        let neighbours = nodes.iter().zip(&nodes[2..]);
        let steps = neighbours.map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
        let inside = &mut out[1..nodes.len() - 1];
        let ds = 2.0 * self.ds;
        if !self.law.forces_into(intensity, steps, ds, inside) {
            for n in 1..nodes.len() - 1 {
                self.normal(flat, n)?;
            }
        }
        if self.is_half() {
            let last = nodes.len() - 1;
            let (d, scale) = self.normal(flat, last)?;
            out[last] = [-intensity * scale * d[1], intensity * scale * d[0]];
        }
        self.clear_held(out);
        Ok(())
    }

    /// `band` += `scale` dF_p/dc at fixed intensity: the exact derivative (Eq. 14 with its signs
    /// corrected). Under the total-force law the full derivative has a rank-one part as well,
    /// see [`FiniteDifferences::pressure_rank_one_into`].
    ///
    /// # Errors
    /// The neighbours of a node coincide.
    ///
    /// # Panics
    /// `nodes` not of the length of [`FiniteDifferences::start`], or `band` as in
    /// [`FiniteDifferences::add_elastic_tangent_into`].
    pub fn add_pressure_tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.check(nodes, nodes);
        self.check_band(band);
        let f = intensity * scale;
        for n in self.moving() {
            let (d, per_length) = self.normal(nodes, n)?;
            let (next, sign) = self.place(n + 1);
            let by = self.law.derivative(f, d, per_length);
            for row in 0..2 {
                if self.is_held(n, row) {
                    continue;
                }
                band.add_inside(2 * n + row, 2 * next, by[row][0]);
                band.add_inside(2 * n + row, 2 * next + 1, sign * by[row][1]);
                band.add_inside(2 * n + row, 2 * n - 2, -by[row][0]);
                band.add_inside(2 * n + row, 2 * n - 1, -by[row][1]);
            }
        }
        Ok(())
    }

    /// `band` += `scale` times the pressure part of Eq. 14 **with the signs as printed** in Rohmer
    /// et al. 2006: the entries dF^x/dc_y(n-1) and dF^y/dc_x(n-1) have the wrong sign on 1/n, so
    /// this is not the derivative. It is here to show what Newton does with it.
    ///
    /// # Errors
    /// The neighbours of a node coincide.
    ///
    /// # Panics
    /// As [`FiniteDifferences::add_pressure_tangent_into`].
    pub fn add_pressure_tangent_as_printed_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.add_pressure_tangent_into(nodes, intensity, scale, band)?;
        for n in self.moving() {
            // right: f (1/n - d^2/n^3); printed: f (d^2/n^3 + 1/n), and its negative for the other
            let (d, per_length) = self.normal(nodes, n)?;
            let f = intensity * scale * per_length.powi(3);
            band.add_inside(2 * n, 2 * n - 1, 2.0 * f * d[1] * d[1]);
            if !self.is_held(n, 1) {
                band.add_inside(2 * n + 1, 2 * n - 2, -2.0 * f * d[0] * d[0]);
            }
        }
        Ok(())
    }

    /// The part of the pressure tangent that is not in the band: under the total-force law
    /// dF_p/dc = band + `column` (x) `row`, with `column` = -(load / S^2) n and `row` = grad S.
    /// Returns whether there is one; under the other laws both are set to zero.
    ///
    /// # Errors
    /// The neighbours of a node coincide.
    ///
    /// # Panics
    /// A length that is not that of [`FiniteDifferences::start`].
    pub fn pressure_rank_one_into(
        &self,
        nodes: &[f64],
        load: f64,
        column: &mut [f64],
        row: &mut [f64],
    ) -> Result<bool, MembraneError> {
        self.check(nodes, column);
        self.check(nodes, row);
        match self.law.load_kind() {
            LoadKind::Intensity => {
                column.fill(0.0);
                row.fill(0.0);
                Ok(false)
            }
            LoadKind::TotalForce => {
                let surface = self.value(Measure::Surface, nodes);
                self.pressure_force_into(nodes, -load / (surface * surface), column)?;
                self.measure_gradient_into(Measure::Surface, nodes, row);
                Ok(true)
            }
        }
    }

    /// c(n+1) - c(n-1) and the factor that makes it the tangent the law multiplies.
    #[inline]
    fn normal(&self, nodes: &[f64], n: usize) -> Result<([f64; 2], f64), MembraneError> {
        let next = self.node(nodes, n + 1);
        let d = [next[0] - nodes[2 * n - 2], next[1] - nodes[2 * n - 1]];
        Ok((d, self.law.factor(d, 2.0 * self.ds, n)?))
    }

    fn check_band(&self, band: &BandMatrix) {
        let (n, bandwidth) = (self.rest.len(), self.bandwidth());
        assert!(
            band.len() == n && band.lower().min(band.upper()) >= bandwidth,
            "expected {n} rows with {bandwidth} diagonals on either side, got {} with {} and {}",
            band.len(),
            band.lower(),
            band.upper()
        );
    }

    pub(crate) fn check(&self, nodes: &[f64], out: &[f64]) {
        let n = self.rest.len();
        assert!(
            nodes.len() == n && out.len() == n,
            "expected {n} numbers, got {} and {}",
            nodes.len(),
            out.len()
        );
    }
}
