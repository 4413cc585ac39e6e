//! The paper's second-order finite differences (3.1.2, with its scale corrected).

use std::sync::Arc;

use crate::curve::CurvePiece;
use crate::discrete::{DiscreteMembrane, Elastic, Setting};
use crate::error::{MembraneError, Result, at_least, at_most, finite};
use crate::material::Material;
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;
use crate::nodes::{Nodes, is_mirrored};
use crate::reference::CurvePoint;
use crate::rubber_nodes::NodeRubber;
use crate::springs::NodeSprings;

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
/// The two end nodes are fixed: their forces and their rows in every tangent are zero. A node next to an end has no second neighbour on
/// that side; its spring goes to the mirror image u(-1) = 2 u(0) - u(1), which keeps the order two and the matrix symmetric.
///
/// [`FiniteDifferences::half`] keeps only the nodes up to the axis if the problem is its own mirror image: a neighbour beyond it is then
/// the image (x, -y) of the node N - 1 - n. The forces are those of the whole curve. An odd N has a node on the axis, free along it and
/// fixed on it; with an even N the axis lies between the last node and its image.
///
/// A membrane of rubber consists of two-node elements with W at both nodes; it is always half a curve.
///
/// Errors are of order ds^2 for smooth lambda. At a jump of lambda, c' and the normal jump, but a node has one normal: order ds under the
/// laws per material length and total force. A jump at a node has the smallest error; spectral elements with a breakpoint there keep their
/// order.
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    setting: Setting,
}

/// Ten thousand times the number that resolves any balloon; some gigabytes with the solver's arrays.
const MOST_NODES: usize = 10_000_000;

impl FiniteDifferences {
    /// Samples `membrane` at `n_nodes` points of the whole curve; a state of rubber contains those up to the axis. Cost O(N).
    ///
    /// # Errors
    /// Fewer than three nodes or more than ten million, a stiffness that is not positive at a sample, or coinciding neighbours in the
    /// reference configuration; rubber that is not mirror-symmetric, has a law other than that of a pressure, or touches the axis away from
    /// its apex.
    pub fn new(membrane: &Membrane, n_nodes: usize) -> Result<Self> {
        Self::build(membrane, n_nodes, false)
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
    pub fn half(membrane: &Membrane, n_nodes: usize) -> Result<Self> {
        Self::build(membrane, n_nodes, true)
    }

    fn build(membrane: &Membrane, n_nodes: usize, half: bool) -> Result<Self> {
        at_least("nodes", n_nodes, 3)?;
        at_most("nodes", n_nodes, MOST_NODES)?;
        membrane.check_law()?;
        let positions = uniform(n_nodes);
        let mut rest = Vec::with_capacity(2 * n_nodes);
        for &s in &positions {
            for value in membrane.reference().at(s).position {
                rest.push(finite("reference curve", value)?);
            }
        }
        let mut pairs = rest.as_chunks::<2>().0.windows(2);
        if let Some(index) = pairs.position(|pair| pair[0] == pair[1]) {
            return Err(MembraneError::CoincidentPoints { index });
        }
        let mut start = rest.clone();
        membrane.hold_ends(positions.into_iter().zip(start.as_chunks_mut::<2>().0));
        let mirrored = is_mirrored(&rest) && is_mirrored(&start);
        let (nodes, elastic): (Nodes, Arc<dyn Elastic>) = match membrane.material() {
            Material::Springs { stiffness, second } => {
                let stiffness = (stiffness, second.as_ref());
                let mut springs = NodeSprings::new(membrane.law(), stiffness, &rest)?;
                if half && mirrored && springs.is_mirrored() {
                    springs = springs.half();
                }
                (springs.nodes, Arc::new(springs))
            }
            Material::Rubber(rubber) if mirrored => {
                let nodes = Nodes::all(n_nodes).half();
                nodes.cut(&mut rest);
                let rubber = NodeRubber::new(rubber, nodes, rest.as_chunks().0)?;
                (nodes, Arc::new(rubber))
            }
            Material::Rubber(_) => return Err(MembraneError::NotMirrored),
        };
        let setting = Setting::new(membrane, nodes, start, elastic);
        Ok(Self { setting })
    }

    /// Number of nodes N of the whole curve, fixed ends included.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.setting.nodes.whole
    }

    /// Spacing of the material coordinate.
    #[must_use]
    pub fn ds(&self) -> f64 {
        1.0 / (self.n_nodes() - 1) as f64
    }
}

impl DiscreteMembrane for FiniteDifferences {
    fn setting(&self) -> &Setting {
        &self.setting
    }

    /// The measure of the polyline through all nodes. Cost O(N).
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64> {
        self.setting.check_state(nodes)?;
        Ok(measure.value(nodes.as_chunks().0, self.is_half()))
    }

    fn measures(&self, nodes: &[f64]) -> Result<Measures> {
        self.setting.check_state(nodes)?;
        let points = nodes.as_chunks().0;
        Ok(Measure::ALL.map(|m| m.value(points, self.is_half())).into())
    }

    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        self.setting.assert_lengths([nodes.len(), out.len()]);
        let (points, out) = (nodes.as_chunks().0, out.as_chunks_mut().0);
        measure.gradient(points, self.is_half(), out);
    }

    fn positions(&self) -> Vec<f64> {
        uniform(self.n_nodes())
    }

    /// Empty: the curve consists of its points.
    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>> {
        self.setting.check_state(nodes)?;
        Ok(Vec::new())
    }

    /// Reference configuration plus a cubic Hermite interpolant of the displacement, with the accuracy of the nodes. In the cells next to a
    /// jump of the stiffness, where c' jumps, tangent and curvature are averages of both sides. Cost O(1).
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint> {
        self.setting.check_state(nodes)?;
        let s = s.clamp(0.0, 1.0);
        let last = self.n_nodes() - 1;
        let n = ((s * last as f64) as usize).min(last - 1);
        let (ds, t) = (self.ds(), s * last as f64 - n as f64);
        let (all, shape) = (self.setting.nodes, self.setting.membrane().reference());
        let mut out = shape.at(s);
        for k in 0..2 {
            let u = |m: usize| all.node(nodes, m)[k] - shape.at(m as f64 * ds).position[k];
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

/// Returns `n` material coordinates at equal distances from 0 to 1.
fn uniform(n: usize) -> Vec<f64> {
    let last = (n - 1) as f64;
    (0..n).map(|k| k as f64 / last).collect()
}
