//! Spectral elements: one polynomial per smooth piece, exponentially accurate.

use std::sync::Arc;

use crate::chebyshev::Reference;
use crate::curve::CurvePiece;
use crate::discrete::{DiscreteMembrane, Elastic, Setting};
use crate::error::{MembraneError, Result, at_least, at_most, finite};
use crate::material::Material;
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;
use crate::nodes::{Nodes, is_mirrored};
use crate::reference::CurvePoint;
use crate::rubber_energy::RubberEnergy;
use crate::springs::ElementSprings;

/// A membrane as polynomials of one degree p on elements that end at the breakpoints of reference configuration and stiffness.
///
/// The state is the curve at the Chebyshev points of every element, elements sharing their end
/// points, flat: x0, y0, x1, y1, ... Where a node lies inside an element the force is
///
/// ```text
/// (lambda u')' + f n,    u = c - c0,    n = (-c_y', c_x') / |c'|    (p (-c_y', c_x') under law 3)
/// ```
///
/// with the element's derivative; where two elements meet it is the jump of the tension, (lambda u')_right - (lambda u')_left. Both vanish
/// at equilibrium, also where c0' or lambda jumps. Second neighbours enter by their limit, lambda + 4 lambda_2.
///
/// The forces of rubber are minus the derivatives of the energy by the nodes; the energy uses a Gauss rule of 3 p / 2 + 2 points per
/// element (Galerkin's method).
///
/// If reference configuration, stiffness and ends are mirror images about the x axis, only s in [0, 1/2] is discretised; the apex is then
/// free along the axis and fixed on it.
#[derive(Debug, Clone)]
pub struct SpectralElements {
    setting: Setting,
    pub(crate) reference: Arc<Reference>,
    elements: Vec<Element>,
}

/// The part of a curve from s = `from` to `to`.
#[derive(Debug, Clone)]
struct Element {
    from: f64,
    to: f64,
}

/// Interpolation at so many Chebyshev points is stable; higher degrees are never needed.
const MOST_DEGREE: usize = 1000;

/// Shortest smooth piece: the rounding of positions, over its length, is that of its strains.
const LEAST_PIECE: f64 = 1e-7;

/// About a gigabyte.
const MOST_SIZE: usize = 100_000_000;

impl SpectralElements {
    /// Discretises `membrane` by polynomials of degree `degree`, `per_piece` elements on each smooth piece. Cost O(elements degree^3).
    ///
    /// # Errors
    /// Degree below 2 or above 1000, no element per piece or more elements than 1e8 / (degree + 3)^2, breakpoints that differ by 1e-12 to 1e-7,
    /// a stiffness that is not positive at a node, a reference curve that is not finite; rubber that is not mirror-symmetric, has a law other than that of a pressure, or touches
    /// the axis away from its apex.
    pub fn new(membrane: &Membrane, degree: usize, per_piece: usize) -> Result<Self> {
        at_least("degree", degree, 2)?;
        at_least("elements per piece", per_piece, 1)?;
        // Each element stores a matrix of degree + 1 rows, its nodes, and the headers of its lists.
        let breaks = membrane.breakpoints(false);
        let size = per_piece
            .saturating_mul(breaks.len() - 1)
            .saturating_mul(degree.saturating_add(3).saturating_pow(2));
        at_most("degree", degree, MOST_DEGREE)?;
        at_most("(degree + 3)^2 times the elements", size, MOST_SIZE)?;
        if let Some(pair) = breaks
            .windows(2)
            .find(|pair| pair[1] - pair[0] < LEAST_PIECE)
        {
            let (s, apart, least) = (pair[0], pair[1] - pair[0], LEAST_PIECE);
            return Err(MembraneError::CloseBreakpoints { s, apart, least });
        }
        membrane.check_law()?;
        let reference = Arc::new(Reference::new(degree));
        let whole = Self::on(membrane, &reference, per_piece, false)?;
        match (whole.is_symmetric(), membrane.material()) {
            (true, _) => Self::on(membrane, &reference, per_piece, true),
            (false, Material::Springs { .. }) => Ok(whole),
            (false, Material::Rubber(_)) => Err(MembraneError::NotMirrored),
        }
    }

    /// Discretises the whole curve, or `half` of it.
    fn on(
        membrane: &Membrane,
        reference: &Arc<Reference>,
        per_piece: usize,
        half: bool,
    ) -> Result<Self> {
        let mut elements = Vec::new();
        for piece in membrane.breakpoints(half).windows(2) {
            let at = |k: usize| piece[0] + (piece[1] - piece[0]) * k as f64 / per_piece as f64;
            for k in 1..=per_piece {
                let to = if k == per_piece { piece[1] } else { at(k) };
                elements.push(Element {
                    from: at(k - 1),
                    to,
                });
            }
        }
        let curve = membrane.reference();
        let mut start = vec![[0.0; 2]; elements.len() * (reference.nodes.len() - 1) + 1];
        let mut springs = ElementSprings::new(membrane.law(), reference.clone(), half);
        let mut energy = match membrane.material() {
            Material::Springs { .. } => None,
            Material::Rubber(rubber) => Some(RubberEnergy::new(rubber, reference.clone())),
        };
        for (e, &Element { from, to }) in elements.iter().enumerate() {
            let inside = 0.5 * (from + to);
            let piece = curve.breakpoints().partition_point(|&b| b <= inside) - 1;
            let s = reference.nodes.iter().map(|t| from + (to - from) * t);
            let rest: Vec<[f64; 2]> = s.map(|s| curve.at_in(piece, s).position).collect();
            for value in rest.as_flattened() {
                finite("reference curve", *value)?;
            }
            let skip = usize::from(e > 0);
            start[e * (rest.len() - 1) + skip..][..rest.len() - skip]
                .copy_from_slice(&rest[skip..]);
            match &mut energy {
                None => springs.push(membrane, (from, to), rest)?,
                Some(energy) => energy.push((from, to), |s| {
                    let here = curve.at_in(piece, s);
                    [here.position, here.first.map(|d| d * (to - from))]
                })?,
            }
        }
        let elastic: Arc<dyn Elastic> = match energy {
            None => Arc::new(springs),
            Some(energy) => Arc::new(energy),
        };
        let kept = start.len();
        let whole = if half { 2 * kept - 1 } else { kept };
        let positions = positions(&elements, &reference.nodes);
        membrane.hold_ends(positions.into_iter().zip(&mut start));
        let nodes = Nodes { whole, kept };
        Ok(Self {
            setting: Setting::new(membrane, nodes, start.into_flattened(), elastic),
            reference: reference.clone(),
            elements,
        })
    }

    /// Degree p of the polynomials.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.reference.nodes.len() - 1
    }

    /// Number of elements.
    #[must_use]
    pub fn n_elements(&self) -> usize {
        self.elements.len()
    }

    fn piece(&self, nodes: &[f64], e: usize) -> CurvePiece {
        let local = nodes[self.reference.window(e)].as_chunks::<2>().0;
        let along = |k: usize| local.iter().map(|c| c[k]).collect::<Vec<_>>();
        CurvePiece {
            from: self.elements[e].from,
            to: self.elements[e].to,
            x: self.reference.coefficients(&along(0)),
            y: self.reference.coefficients(&along(1)),
        }
    }

    /// Whether the curve is mirror-symmetric to rounding, node by node and spring by spring.
    fn is_symmetric(&self) -> bool {
        let s = self.positions();
        let mut images = s.iter().zip(s.iter().rev());
        images.all(|(s, image)| (s + image - 1.0).abs() <= 1e-13)
            && is_mirrored(self.start())
            && self.setting.is_mirrored()
    }
}

impl DiscreteMembrane for SpectralElements {
    fn setting(&self) -> &Setting {
        &self.setting
    }

    /// By quadrature: area and volume are exact for the polynomials, length and surface have the error of a Gauss rule with 3 p / 2 + 2
    /// points per element. Cost O(elements p^2).
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64> {
        self.setting.check_state(nodes)?;
        let [value] = self.integrate([measure], nodes);
        Ok(value)
    }

    fn measures(&self, nodes: &[f64]) -> Result<Measures> {
        self.setting.check_state(nodes)?;
        Ok(self.integrate(Measure::ALL, nodes).into())
    }

    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        self.setting.assert_lengths([nodes.len(), out.len()]);
        out.fill(0.0);
        self.add_gradient(measure, nodes, out);
    }

    fn positions(&self) -> Vec<f64> {
        let mut s = positions(&self.elements, &self.reference.nodes);
        if self.is_half() {
            let mirrored: Vec<f64> = s[..s.len() - 1].iter().rev().map(|s| 1.0 - s).collect();
            s.extend(mirrored);
        }
        s
    }

    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>> {
        self.setting.check_state(nodes)?;
        let mut pieces: Vec<CurvePiece> = (0..self.elements.len())
            .map(|e| self.piece(nodes, e))
            .collect();
        if self.is_half() {
            let mirrored: Vec<_> = pieces.iter().rev().map(CurvePiece::mirrored).collect();
            pieces.extend(mirrored);
        }
        Ok(pieces)
    }

    /// Where elements meet, the derivatives are those of the left one. Cost O(p^2); for many s use [`DiscreteMembrane::pieces`] once.
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint> {
        self.setting.check_state(nodes)?;
        let s = s.clamp(0.0, 1.0);
        let mirrored = self.is_half() && s > 0.5;
        let here = if mirrored { 1.0 - s } else { s };
        let e = self.elements.partition_point(|element| element.to < here);
        let piece = self.piece(nodes, e.min(self.elements.len() - 1));
        Ok(if mirrored {
            piece.mirrored().at(s)
        } else {
            piece.at(s)
        })
    }
}

/// Returns the material coordinates of the nodes of `elements`, whose own coordinates are `nodes`.
fn positions(elements: &[Element], nodes: &[f64]) -> Vec<f64> {
    let mut s = vec![0.0];
    for Element { from, to } in elements {
        s.extend(nodes[1..].iter().map(|t| from + (to - from) * t));
    }
    s
}
