//! The paper's second-order finite differences (3.1.2, with its scale corrected).

use crate::band::BandMatrix;
use crate::curve::CurvePiece;
use crate::discrete::{DiscreteMembrane, Setting, Tangent};
use crate::error::{MembraneError, at_least, at_most, finite, length};
use crate::half::Nodes;
use crate::material::{Material, NodeSprings};
use crate::measures::Measure;
use crate::membrane::Membrane;
use crate::reference::{CurvePoint, ReferenceShape};
use crate::rubber_nodes::NodeRubber;

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
/// The two end nodes are fixed: their forces and their rows in every tangent are zero. A node
/// next to an end has no second neighbour on that side; its spring goes to the mirror image
/// u(-1) = 2 u(0) - u(1), which keeps the order two and the matrix symmetric.
///
/// [`FiniteDifferences::half`] keeps only the nodes up to the axis if the problem is its own mirror
/// image: a neighbour beyond it is then the image (x, -y) of the node N - 1 - n. The forces are
/// those of the whole curve. An odd N has a node on the axis, free along it and fixed on it; with an
/// even N the axis lies between the last node and its image.
///
/// A membrane of rubber consists of two-node elements with W at both nodes; it is always half a curve.
///
/// Errors are of order ds^2 for smooth lambda. At a jump of lambda, c' and the normal jump, but a node has one normal: order ds under the
/// laws per material length and total force. A jump at a node has the smallest error; spectral elements with a breakpoint there keep their
/// order.
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    pub(crate) setting: Setting,
    shape: ReferenceShape,
    pub(crate) nodes: Nodes,
    ds: f64,
    /// Reference positions of the nodes of the state.
    rest: Vec<f64>,
    pub(crate) material: NodeMaterial,
}

#[derive(Debug, Clone)]
pub(crate) enum NodeMaterial {
    Springs(NodeSprings),
    Rubber(NodeRubber),
}

/// Ten thousand times the number that resolves any balloon; some gigabytes with the solver's arrays.
const MOST_NODES: usize = 10_000_000;

impl FiniteDifferences {
    /// Samples `membrane` at `n_nodes` points. Cost O(N).
    ///
    /// # Errors
    /// Fewer than three nodes or more than ten million, a stiffness that is not positive at a sample, or coinciding neighbours in the
    /// reference configuration; rubber that is not mirror-symmetric, has a law other than that of a pressure, or touches the axis away from
    /// its apex.
    pub fn new(membrane: &Membrane, n_nodes: usize) -> Result<Self, MembraneError> {
        at_least("nodes", n_nodes, 3)?;
        at_most("nodes", n_nodes, MOST_NODES)?;
        let last = n_nodes - 1;
        let mut rest = Vec::with_capacity(2 * n_nodes);
        for n in 0..n_nodes {
            let position = membrane.reference().at(n as f64 / last as f64).position;
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
        let (whole, kept) = (n_nodes, n_nodes);
        let mut nodes = Nodes { whole, kept };
        let (shape, ds) = (membrane.reference().clone(), 1.0 / last as f64);
        let material = match membrane.material() {
            Material::Springs { stiffness, second } => {
                let springs = NodeSprings::new(stiffness, second.as_ref(), rest.clone())?;
                setting.stiffness_scale = springs.scale();
                if setting.law.blows_up() {
                    setting.blow_up = springs.blow_up();
                }
                NodeMaterial::Springs(springs)
            }
            Material::Rubber(rubber) => {
                membrane.check_law()?;
                let thickness = |n: usize| rubber.thickness().at(n as f64 * ds);
                let mut most: f64 = 0.0;
                for n in 0..n_nodes {
                    let (here, image) = (thickness(n)?, thickness(last - n)?);
                    most = most.max(here);
                    if (here - image).abs() > 1e-12 * here {
                        return Err(MembraneError::NotMirrored);
                    }
                }
                let size = setting.start.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                if !is_mirrored(&rest, size) || !is_mirrored(&setting.start, size) {
                    return Err(MembraneError::NotMirrored);
                }
                nodes = nodes.half();
                setting.end_at_axis(2 * nodes.kept, n_nodes % 2 == 1);
                setting.stiffness_scale = rubber.energy().shear_modulus() * most;
                cut_rest(&mut rest, nodes);
                let positions = (0..n_nodes).map(|n| n as f64 * ds);
                let rubber = NodeRubber::new(rubber, nodes, rest.as_chunks().0, positions)?;
                NodeMaterial::Rubber(rubber)
            }
        };
        Ok(Self {
            setting,
            shape,
            nodes,
            ds,
            rest,
            material,
        })
    }

    /// As [`FiniteDifferences::new`], with only the nodes s <= 1/2 if reference configuration, stiffness and ends are mirror images about
    /// the x axis (to rounding, node by node); the whole curve otherwise.
    ///
    /// ```
    /// use membrane_forces::{DiscreteMembrane, FiniteDifferences, Membrane, ReferenceShape};
    /// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    /// let half = FiniteDifferences::half(&membrane, 201)?;
    /// assert!(half.is_half() && half.start().len() == 2 * 101 && half.n_nodes() == 201);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// As [`FiniteDifferences::new`].
    pub fn half(membrane: &Membrane, n_nodes: usize) -> Result<Self, MembraneError> {
        let mut this = Self::new(membrane, n_nodes)?;
        match &mut this.material {
            NodeMaterial::Springs(springs) => {
                let size = this.setting.start.iter();
                let size = size.fold(0.0f64, |m, v| m.max(v.abs()));
                if !(is_mirrored(&this.rest, size)
                    && is_mirrored(&this.setting.start, size)
                    && springs.are_symmetric())
                {
                    return Ok(this);
                }
                this.nodes = this.nodes.half();
                let kept = 2 * this.nodes.kept;
                this.setting.end_at_axis(kept, n_nodes % 2 == 1);
                springs.nodes = this.nodes;
                cut_rest(&mut this.rest, this.nodes);
                springs.rest.clone_from(&this.rest);
                springs.rest.shrink_to_fit();
            }
            NodeMaterial::Rubber(_) => (),
        }
        Ok(this)
    }

    /// Number of nodes N of the whole curve, fixed ends included.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.nodes.whole
    }

    /// Spacing of the material coordinate.
    #[must_use]
    pub fn ds(&self) -> f64 {
        self.ds
    }

    /// Returns the reference configuration at the nodes, flat.
    #[must_use]
    pub fn reference(&self) -> &[f64] {
        &self.rest
    }

    /// Half bandwidth of every tangent: 3, or 4 with second neighbours.
    #[must_use]
    pub fn bandwidth(&self) -> usize {
        match &self.material {
            NodeMaterial::Springs(springs) if !springs.second.is_empty() => 4,
            NodeMaterial::Springs(_) | NodeMaterial::Rubber(_) => 3,
        }
    }

    /// A zero matrix of the shape every tangent of this membrane fits.
    #[must_use]
    pub fn band(&self) -> BandMatrix {
        BandMatrix::of_shape(self.start().len(), self.bandwidth(), self.bandwidth())
    }

    /// Elastic energy of the whole curve relative to the start, force per s times cm; for rubber that of the body, NaN beyond its largest
    /// stretch. Cost O(N).
    ///
    /// # Panics
    /// The length of `nodes` differs from that of [`DiscreteMembrane::start`].
    #[must_use]
    pub fn elastic_energy(&self, nodes: &[f64]) -> f64 {
        self.setting.check([nodes.len()]);
        match &self.material {
            NodeMaterial::Springs(springs) => springs.energy(nodes, self.start()),
            NodeMaterial::Rubber(rubber) => {
                let at = |nodes: &[f64]| rubber.energy(nodes.as_chunks().0).unwrap_or(f64::NAN);
                at(nodes) - at(self.start())
            }
        }
    }

    /// c(n+1) - c(n-1) and the factor that makes it the tangent the law multiplies.
    #[inline]
    pub(crate) fn normal(&self, nodes: &[f64], n: usize) -> Result<([f64; 2], f64), MembraneError> {
        let next = self.node(nodes, n + 1);
        let d = [next[0] - nodes[2 * n - 2], next[1] - nodes[2 * n - 1]];
        Ok((d, self.setting.law.factor(d, 2.0 * self.ds, n)?))
    }

    /// Node `n` of the whole curve in state `nodes`; `n` < N.
    #[inline]
    fn node(&self, nodes: &[f64], n: usize) -> [f64; 2] {
        let (at, sign) = self.nodes.place(n);
        [nodes[2 * at], sign * nodes[2 * at + 1]]
    }

    /// Returns node `n` of the whole curve in state `nodes`; `None` if n >= N or the state has a length other than
    /// [`DiscreteMembrane::start`].
    #[must_use]
    pub fn point(&self, nodes: &[f64], n: usize) -> Option<[f64; 2]> {
        let there = nodes.len() == self.start().len() && n < self.n_nodes();
        there.then(|| self.node(nodes, n))
    }

    fn rubber(&self, what: &'static str) -> Result<&NodeRubber, MembraneError> {
        match &self.material {
            NodeMaterial::Rubber(rubber) => Ok(rubber),
            NodeMaterial::Springs(_) => Err(MembraneError::OtherMaterial { what }),
        }
    }

    pub(crate) fn check_band(&self, band: &BandMatrix) -> Result<(), MembraneError> {
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
        match &self.material {
            NodeMaterial::Springs(springs) => {
                springs.pull_into(nodes, out.as_chunks_mut::<2>().0);
            }
            NodeMaterial::Rubber(rubber) => {
                let pulled = rubber.pull_into(nodes.as_chunks().0, out.as_chunks_mut().0);
                if pulled.is_err() {
                    out.fill(f64::NAN);
                }
            }
        }
        self.setting.hold(out, 0.0);
    }

    fn check_stretches(&self, nodes: &[f64]) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        match &self.material {
            NodeMaterial::Springs(_) => Ok(()),
            NodeMaterial::Rubber(rubber) => rubber.check(nodes.as_chunks().0),
        }
    }

    fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        length("forces", out.len(), nodes.len())?;
        if let NodeMaterial::Rubber(_) = &self.material {
            self.measure_gradient_into(Measure::Volume, nodes, out);
            out.iter_mut().for_each(|value| *value *= intensity);
            self.setting.hold(out, 0.0);
            return Ok(());
        }
        let points = nodes.as_chunks::<2>().0;
        let last = points.len() - 1;
        let forces = out.as_chunks_mut::<2>().0;
        let neighbours = points.iter().zip(&points[2..]);
        let steps = neighbours.map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
        let inside = &mut forces[1..last];
        if !self
            .setting
            .law
            .forces_into(intensity, steps, 2.0 * self.ds, inside)
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

    fn taut_tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        least: f64,
        out: &mut Tangent,
    ) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        self.check_band(&out.band)?;
        out.band.clear();
        match &self.material {
            NodeMaterial::Springs(springs) => {
                springs.add_tangent_into(1.0, &mut out.band);
                self.add_pressure_tangent_into(nodes, intensity, 1.0, &mut out.band)?;
            }
            NodeMaterial::Rubber(rubber) => {
                let points = nodes.as_chunks().0;
                rubber.add_tangent_into(points, intensity, least, &mut out.band)?;
            }
        }
        for &held in self.fixed() {
            out.band.add_inside(held, held, 1.0);
        }
        Ok(())
    }

    fn strain_energy(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
        self.rubber("strain energy")?.energy(nodes.as_chunks().0)
    }

    fn least_tension(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
        match &self.material {
            NodeMaterial::Springs(_) => Ok(f64::INFINITY),
            NodeMaterial::Rubber(rubber) => rubber.least_tension(nodes.as_chunks().0),
        }
    }

    fn add_mass_into(&self, scale: f64, out: &mut Tangent) -> Result<(), MembraneError> {
        self.check_band(&out.band)?;
        self.rubber("mass")?.add_mass_into(scale, &mut out.band);
        Ok(())
    }

    /// The measure of the polyline through all nodes. Cost O(N).
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
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

    /// Empty: the curve consists of its points.
    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>, MembraneError> {
        self.setting.check_state(nodes)?;
        Ok(Vec::new())
    }

    /// Reference configuration plus a cubic Hermite interpolant of the displacement, with the accuracy of the nodes. In the cells next to a
    /// jump of the stiffness, where c' jumps, tangent and curvature are averages of both sides. Cost O(1).
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint, MembraneError> {
        self.setting.check_state(nodes)?;
        let s = s.clamp(0.0, 1.0);
        let last = self.n_nodes() - 1;
        let n = ((s * last as f64) as usize).min(last - 1);
        let (ds, t) = (self.ds, s * last as f64 - n as f64);
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

/// Whether a curve of this size is mirror-symmetric to rounding.
fn is_mirrored(nodes: &[f64], size: f64) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-13 * size;
    let points = nodes.as_chunks::<2>().0;
    let mut pairs = points.iter().zip(points.iter().rev());
    pairs.all(|(a, b)| close(a[0], b[0]) && close(a[1], -b[1]))
}

/// Cuts reference positions at the axis, which contains the last of an odd number of nodes.
fn cut_rest(rest: &mut Vec<f64>, nodes: Nodes) {
    rest.truncate(2 * nodes.kept);
    rest.shrink_to_fit();
    if nodes.whole % 2 == 1 {
        rest[2 * nodes.kept - 1] = 0.0;
    }
}
