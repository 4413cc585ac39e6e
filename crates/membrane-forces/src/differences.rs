//! The paper's second-order finite differences (3.1.2, with its scale corrected).

use crate::band::BandMatrix;
use crate::curve::CurvePiece;
use crate::discrete::{DiscreteMembrane, Setting, Tangent};
use crate::error::{MembraneError, at_least, at_most, finite, length};
use crate::law::LoadKind;
use crate::material::NodeSprings;
use crate::measures::Measure;
use crate::membrane::Membrane;
use crate::rest::{CurvePoint, RestShape};

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
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    setting: Setting,
    shape: RestShape,
    springs: NodeSprings,
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
        at_least("nodes", n_nodes, 3)?;
        at_most("nodes", n_nodes, MOST_NODES)?;
        let last = n_nodes - 1;
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
        let s = (0..n_nodes).map(|n| n as f64 / last as f64);
        let mut setting = Setting::new(membrane, s, &rest);
        let springs = NodeSprings::new(membrane, rest)?;
        setting.stiffness_scale = springs.scale();
        if setting.law.blows_up() {
            setting.blow_up = springs.blow_up();
        }
        Ok(Self {
            setting,
            shape: membrane.rest().clone(),
            springs,
        })
    }

    /// [`FiniteDifferences::new`], of which only the nodes with s <= 1/2 are kept if rest shape,
    /// stiffness and ends are mirror images about the x axis (to rounding, node by node); the
    /// whole curve otherwise.
    ///
    /// ```
    /// use membrane_forces::{DiscreteMembrane, FiniteDifferences, Membrane, RestShape};
    /// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
    /// let half = FiniteDifferences::half(&membrane, 201)?;
    /// assert!(half.is_half() && half.start().len() == 2 * 101 && half.n_nodes() == 201);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// As [`FiniteDifferences::new`].
    pub fn half(membrane: &Membrane, n_nodes: usize) -> Result<Self, MembraneError> {
        let mut this = Self::new(membrane, n_nodes)?;
        if !this.is_symmetric() {
            return Ok(this);
        }
        let nodes = this.springs.nodes.half();
        this.setting.end_at_axis(2 * nodes.kept, n_nodes % 2 == 1);
        this.springs.nodes = nodes;
        let rest = &mut this.springs.rest;
        rest.truncate(2 * nodes.kept);
        rest.shrink_to_fit();
        if n_nodes % 2 == 1 {
            rest[2 * nodes.kept - 1] = 0.0;
        }
        Ok(this)
    }

    /// Whether the whole curve equals its own mirror image to rounding.
    fn is_symmetric(&self) -> bool {
        let size = self.start().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-13 * size;
        let mirrored = |nodes: &[f64]| {
            let points = nodes.as_chunks::<2>().0;
            let mut pairs = points.iter().zip(points.iter().rev());
            pairs.all(|(a, b)| close(a[0], b[0]) && close(a[1], -b[1]))
        };
        mirrored(&self.springs.rest) && mirrored(self.start()) && self.springs.are_symmetric()
    }

    /// Number of nodes N of the whole curve, held ends included.
    pub fn n_nodes(&self) -> usize {
        self.springs.nodes.whole
    }

    /// Spacing of the material coordinate.
    pub fn ds(&self) -> f64 {
        self.springs.ds
    }

    /// Rest shape at the nodes, flat.
    pub fn rest(&self) -> &[f64] {
        &self.springs.rest
    }

    /// Half bandwidth of every tangent: 3, or 4 with second neighbours.
    pub fn bandwidth(&self) -> usize {
        if self.springs.second.is_empty() { 3 } else { 4 }
    }

    /// A zero matrix of the shape every tangent of this membrane fits.
    pub fn band(&self) -> BandMatrix {
        BandMatrix::of_shape(self.start().len(), self.bandwidth(), self.bandwidth())
    }

    /// Elastic energy of the whole curve above that of its start, force per s times cm. Cost O(N).
    ///
    /// # Panics
    /// A length that is not that of [`DiscreteMembrane::start`].
    pub fn elastic_energy(&self, nodes: &[f64]) -> f64 {
        self.setting.check([nodes.len()]);
        self.springs.energy(nodes, self.start())
    }

    /// `band` += `scale` dF_e/dc. Block tridiagonal with diagonal blocks; pentadiagonal with
    /// second neighbours; independent of the state; symmetric among interior nodes.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if `band` has not the rows, [`MembraneError::TooFew`] if it has not the diagonals, of
    /// [`FiniteDifferences::band`].
    pub fn add_elastic_tangent_into(
        &self,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.check_band(band)?;
        self.springs.add_tangent_into(scale, band);
        Ok(())
    }

    /// `band` += `scale` dF_p/dc at fixed intensity: the exact derivative (Eq. 14 with its signs
    /// corrected). Under the total-force law the full derivative has a rank-one part as well,
    /// see [`FiniteDifferences::pressure_rank_one_into`].
    ///
    /// # Errors
    /// The neighbours of a node coincide; [`MembraneError::WrongLength`] of `nodes`; `band` as in
    /// [`FiniteDifferences::add_elastic_tangent_into`].
    pub fn add_pressure_tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.setting.refuse(nodes)?;
        self.check_band(band)?;
        let f = intensity * scale;
        for n in self.springs.nodes.moving() {
            let (d, per_length) = self.normal(nodes, n)?;
            let (next, sign) = self.springs.nodes.place(n + 1);
            let by = self.setting.law.derivative(f, d, per_length);
            for row in 0..2 {
                if self.springs.nodes.is_held(n, row) {
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

    /// `band` += what the pressure part of Eq. 14 of Rohmer et al. 2006 **as printed** has beside the derivative: its entries
    /// dF^x/dc_y(n-1) and dF^y/dc_x(n-1) have the wrong sign on 1/n. It is here to show what Newton does with it.
    ///
    /// # Errors
    /// As [`FiniteDifferences::add_pressure_tangent_into`].
    pub fn add_misprint_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.setting.refuse(nodes)?;
        self.check_band(band)?;
        for n in self.springs.nodes.moving() {
            // right: f (1/n - d^2/n^3); printed: f (d^2/n^3 + 1/n), and its negative for the other
            let (d, per_length) = self.normal(nodes, n)?;
            let f = intensity * per_length.powi(3);
            band.add_inside(2 * n, 2 * n - 1, 2.0 * f * d[1] * d[1]);
            if !self.springs.nodes.is_held(n, 1) {
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
    /// The neighbours of a node coincide; [`MembraneError::WrongLength`] of one of the three.
    pub fn pressure_rank_one_into(
        &self,
        nodes: &[f64],
        load: f64,
        column: &mut [f64],
        row: &mut [f64],
    ) -> Result<bool, MembraneError> {
        self.setting.refuse(nodes)?;
        length("column", column.len(), nodes.len())?;
        length("row", row.len(), nodes.len())?;
        match self.setting.law.load_kind() {
            LoadKind::Intensity => {
                column.fill(0.0);
                row.fill(0.0);
                Ok(false)
            }
            LoadKind::TotalForce => {
                let surface = self.measure(Measure::Surface, nodes)?;
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
        Ok((d, self.setting.law.factor(d, 2.0 * self.springs.ds, n)?))
    }

    /// Node `n` of the whole curve in state `nodes`; `n` < N.
    #[inline]
    fn node(&self, nodes: &[f64], n: usize) -> [f64; 2] {
        let (at, sign) = self.springs.nodes.place(n);
        [nodes[2 * at], sign * nodes[2 * at + 1]]
    }

    /// Node `n` of the whole curve in state `nodes`; none if n >= N or the state has another length than
    /// [`DiscreteMembrane::start`].
    pub fn point(&self, nodes: &[f64], n: usize) -> Option<[f64; 2]> {
        let there = nodes.len() == self.start().len() && n < self.n_nodes();
        there.then(|| self.node(nodes, n))
    }

    fn check_band(&self, band: &BandMatrix) -> Result<(), MembraneError> {
        length("rows of the band", band.len(), self.start().len())?;
        let diagonals = band.lower().min(band.upper());
        at_least("diagonals on either side", diagonals, self.bandwidth())
    }
}

impl DiscreteMembrane for FiniteDifferences {
    fn setting(&self) -> &Setting {
        &self.setting
    }

    fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        self.setting.check([nodes.len(), out.len()]);
        self.springs.pull_into(nodes, out.as_chunks_mut::<2>().0);
        self.setting.hold(out, 0.0);
    }

    fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        self.setting.refuse(nodes)?;
        length("forces", out.len(), nodes.len())?;
        let points = nodes.as_chunks::<2>().0;
        let last = points.len() - 1;
        let forces = out.as_chunks_mut::<2>().0;
        let neighbours = points.iter().zip(&points[2..]);
        let steps = neighbours.map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
        let inside = &mut forces[1..last];
        if !self
            .setting
            .law
            .forces_into(intensity, steps, 2.0 * self.springs.ds, inside)
        {
            for n in 1..last {
                self.normal(nodes, n)?;
            }
        }
        if self.is_half() {
            let (d, scale) = self.normal(nodes, last)?;
            forces[last] = [-intensity * scale * d[1], intensity * scale * d[0]];
        }
        self.setting.hold(out, 0.0);
        Ok(())
    }

    fn tangent(&self) -> Tangent {
        Tangent {
            blocks: Vec::new(),
            band: self.band(),
        }
    }

    fn tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut Tangent,
    ) -> Result<(), MembraneError> {
        self.setting.refuse(nodes)?;
        self.check_band(&out.band)?;
        out.band.clear();
        self.add_elastic_tangent_into(1.0, &mut out.band)?;
        self.add_pressure_tangent_into(nodes, intensity, 1.0, &mut out.band)?;
        for &held in self.held() {
            out.band.add_inside(held, held, 1.0);
        }
        Ok(())
    }

    /// That of the polyline through all nodes. Cost O(N).
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.refuse(nodes)?;
        let points = nodes.as_chunks::<2>().0;
        Ok(if self.is_half() {
            measure.of_half(points)
        } else {
            measure.of(points)
        })
    }

    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        self.setting.check([nodes.len(), out.len()]);
        let (points, out) = (nodes.as_chunks().0, out.as_chunks_mut().0);
        if self.is_half() {
            measure.half_gradient_into(points, out);
        } else {
            measure.gradient_into(points, out);
        }
    }

    fn positions(&self) -> Vec<f64> {
        let last = self.n_nodes() - 1;
        (0..=last).map(|n| n as f64 / last as f64).collect()
    }

    /// None: the curve is its points.
    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>, MembraneError> {
        self.setting.refuse(nodes)?;
        Ok(Vec::new())
    }

    /// The rest shape plus a cubic Hermite interpolant of the displacement, as accurate as the nodes (in the cells next to a jump
    /// of the stiffness, where c' jumps, tangent and curvature are means of both sides). Cost O(1).
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint, MembraneError> {
        self.setting.refuse(nodes)?;
        let s = s.clamp(0.0, 1.0);
        let last = self.n_nodes() - 1;
        let n = ((s * last as f64) as usize).min(last - 1);
        let (ds, t) = (self.springs.ds, s * last as f64 - n as f64);
        let mut out = self.shape.at(s);
        for k in 0..2 {
            let u = |m: usize| self.node(nodes, m)[k] - self.shape.at(m as f64 * ds).position[k];
            // slope per cell at node m: central, one-sided of second order at the ends
            let slope = |m: usize| match m {
                0 => -1.5 * u(0) + 2.0 * u(1) - 0.5 * u(2),
                m if m == last => 1.5 * u(m) - 2.0 * u(m - 1) + 0.5 * u(m - 2),
                m => 0.5 * (u(m + 1) - u(m - 1)),
            };
            let (a, b, da, db) = (u(n), u(n + 1), slope(n), slope(n + 1));
            let (c2, c3) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
            out.position[k] += a + t * (da + t * (c2 + t * c3));
            out.first[k] += (da + t * (2.0 * c2 + 3.0 * t * c3)) / ds;
            out.second[k] += (2.0 * c2 + 6.0 * t * c3) / (ds * ds);
        }
        Ok(out)
    }
}
