//! Spectral elements: one polynomial per smooth piece, exponentially accurate.

use std::f64::consts::PI;

use crate::band::BandMatrix;
use crate::chebyshev::{Reference, local_index};
use crate::curve::CurvePiece;
use crate::discrete::{DiscreteMembrane, Setting, Tangent, forces_apart_into};
use crate::error::{MembraneError, at_least, at_most, finite, length};
use crate::material::{ElementSprings, Material, compliance};
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;
use crate::reference::CurvePoint;
use crate::rubber_energy::{RubberEnergy, Rule};

/// A membrane as polynomials of one degree p on elements that end at the breakpoints of reference configuration and stiffness.
///
/// The state is the curve at the Chebyshev points of every element, elements sharing their end
/// points, flat: x0, y0, x1, y1, ... Where a node lies inside an element the force is
///
/// ```text
/// (lambda u')' + f n,    u = c - c0,    n = (-c_y', c_x') / |c'|    (p (-c_y', c_x') under law 3)
/// ```
///
/// with the element's derivative; where two elements meet it is the jump of the tension,
/// (lambda u')_right - (lambda u')_left. Both vanish at equilibrium, also where c0' or lambda
/// jumps. Second neighbours enter by their limit, lambda + 4 lambda_2.
///
/// The forces of rubber are minus the derivatives of the energy by the nodes; the energy uses a Gauss rule of 3 p / 2 + 2 points per
/// element (Galerkin's method).
///
/// If reference configuration, stiffness and ends are mirror images about the x axis, only s in [0, 1/2] is discretised; the apex is then
/// free along the axis and fixed on it.
#[derive(Debug, Clone)]
pub struct SpectralElements {
    setting: Setting,
    pub(crate) reference: Reference,
    pub(crate) elements: Vec<Element>,
    material: ElementMaterial,
}

#[derive(Debug, Clone)]
enum ElementMaterial {
    Springs(Vec<ElementSprings>),
    Rubber(Box<RubberEnergy>),
}

/// The part of a curve from s = `from` to `to`.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// Interpolation at so many Chebyshev points is stable; higher degrees are never needed.
const MOST_DEGREE: usize = 1000;

/// About a gigabyte.
const MOST_SIZE: usize = 100_000_000;

impl SpectralElements {
    /// Discretises `membrane` by polynomials of degree `degree`, `per_piece` elements on each
    /// smooth piece. Cost O(elements degree^3).
    ///
    /// # Errors
    /// Degree below 2 or above 1000, no element per piece or more elements than 1e8 / (degree + 3)^2, a stiffness that is not positive at a
    /// node, a reference curve that is not finite; rubber that is not mirror-symmetric, has a law other than that of a pressure, or touches
    /// the axis away from its apex.
    pub fn new(
        membrane: &Membrane,
        degree: usize,
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        at_least("degree", degree, 2)?;
        at_least("elements per piece", per_piece, 1)?;
        // Each element stores a matrix of degree + 1 rows, its nodes, and the headers of its lists.
        let breaks = membrane.breakpoints(false);
        let size = per_piece
            .saturating_mul(breaks.len() - 1)
            .saturating_mul(degree.saturating_add(3).saturating_pow(2));
        let what = "degree, or (degree + 3)^2 times the elements";
        if degree > MOST_DEGREE {
            at_most(what, degree.max(size), MOST_DEGREE)?;
        }
        at_most(what, degree.max(size), MOST_SIZE)?;
        membrane.check_law()?;
        let reference = Reference::new(degree);
        let full = Self::on(membrane, &reference, &breaks, per_piece)?;
        if !full.is_symmetric() {
            return match &full.material {
                ElementMaterial::Springs(_) => Ok(full),
                ElementMaterial::Rubber(_) => Err(MembraneError::NotMirrored),
            };
        }
        let breaks = membrane.breakpoints(true);
        let mut half = Self::on(membrane, &reference, &breaks, per_piece)?;
        let len = half.start().len();
        half.setting.end_at_axis(len, true);
        // that of the whole: 2 pi over twice the integral
        half.setting.blow_up *= 0.5;
        Ok(half)
    }

    fn on(
        membrane: &Membrane,
        reference: &Reference,
        breaks: &[f64],
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        let mut elements: Vec<Element> = Vec::new();
        let (mut positions, mut rest_all) = (vec![0.0], Vec::new());
        // of the integral of 1 / lambda, under a law that needs it
        let (mut scale, mut soft) = (0.0, 0.0);
        let mut material = match membrane.material() {
            Material::Springs { .. } => ElementMaterial::Springs(Vec::new()),
            Material::Rubber(rubber) => {
                ElementMaterial::Rubber(Box::new(RubberEnergy::new(rubber, Rule::gauss(reference))))
            }
        };
        let rest_breaks = membrane.reference().breakpoints();
        for piece in breaks.windows(2) {
            let inside = 0.5 * (piece[0] + piece[1]);
            let rest_piece = rest_breaks.partition_point(|&b| b <= inside) - 1;
            for k in 0..per_piece {
                let at = |k: usize| piece[0] + (piece[1] - piece[0]) * k as f64 / per_piece as f64;
                let to = if k + 1 == per_piece {
                    piece[1]
                } else {
                    at(k + 1)
                };
                let from = at(k);
                let s = reference.nodes.iter().map(|t| from + (to - from) * t);
                let rest_at = |s: f64| membrane.reference().at_in(rest_piece, s);
                let rest: Vec<[f64; 2]> = s.clone().map(|s| rest_at(s).position).collect();
                for value in rest.as_flattened() {
                    finite("rest curve", *value)?;
                }
                let skip = usize::from(!elements.is_empty());
                rest_all.extend(rest[skip..].as_flattened());
                positions.extend(s.skip(1));
                match &mut material {
                    ElementMaterial::Springs(springs) => {
                        // just inside, so that a jump at the element's end is evaluated on its side
                        let inside = (1e-12 * (to - from)).max(8.0 * f64::EPSILON);
                        let at = |s| membrane.effective_stiffness(s);
                        let nodes = reference.nodes.iter().map(|t| from + (to - from) * t);
                        let stiffness = nodes.map(|s| at(s.max(from + inside).min(to - inside)));
                        let stiffness: Vec<f64> = stiffness.collect::<Result<_, _>>()?;
                        if membrane.law().blows_up() {
                            soft += compliance(at, from, to)?;
                        }
                        scale = stiffness.iter().copied().fold(scale, f64::max);
                        let length = to - from;
                        springs.push(ElementSprings::new(reference, rest, &stiffness, length));
                    }
                    ElementMaterial::Rubber(rubber) => {
                        let place = |s: f64| {
                            let here = rest_at(s);
                            [here.position, here.first.map(|d| d * (to - from))]
                        };
                        rubber.push((from, to), place)?;
                        scale = rubber.scale();
                    }
                }
                elements.push(Element { from, to });
            }
        }
        let mut setting = Setting::new(membrane, positions.into_iter(), &rest_all);
        setting.stiffness_scale = scale;
        setting.blow_up = match &material {
            ElementMaterial::Springs(_) => 2.0 * PI / soft,
            ElementMaterial::Rubber(_) => f64::INFINITY,
        };
        Ok(Self {
            setting,
            reference: reference.clone(),
            elements,
            material,
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

    fn check_tangent(&self, tangent: &Tangent) -> Result<(), MembraneError> {
        let (size, count) = (2 * (self.degree() + 1), self.elements.len());
        length("blocks", tangent.blocks.len(), count)?;
        length("rows of the band", tangent.band.len(), 2 * (count + 1))?;
        (tangent.blocks.iter())
            .try_for_each(|block| length("numbers of a block", block.len(), size * size))
    }

    /// Clears the rows of fixed numbers, which are at ends of elements.
    fn clear_held_rows(&self, blocks: &mut [Vec<f64>]) {
        let (p, size) = (self.degree(), 2 * (self.degree() + 1));
        for &held in self.fixed() {
            let node = held / 2;
            let e = (node / p).min(self.elements.len() - 1);
            let row = 2 * local_index(node - e * p, p) + held % 2;
            blocks[e][row * size..(row + 1) * size].fill(0.0);
        }
    }

    fn rubber(&self, what: &'static str) -> Result<&RubberEnergy, MembraneError> {
        match &self.material {
            ElementMaterial::Rubber(rubber) => Ok(&**rubber),
            ElementMaterial::Springs(_) => Err(MembraneError::OtherMaterial { what }),
        }
    }

    fn piece(&self, nodes: &[f64], e: usize) -> CurvePiece {
        let local = nodes[self.window(e)].as_chunks::<2>().0;
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
        let size = self.start().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-13 * scale;
        let s = self.positions();
        let nodes = s.iter().zip(self.start().as_chunks::<2>().0);
        let mut images = nodes.clone().zip(nodes.rev());
        let same_material = match &self.material {
            ElementMaterial::Springs(springs) => {
                (springs.iter().zip(springs.iter().rev())).all(|(a, b)| a.mirrors(b))
            }
            ElementMaterial::Rubber(rubber) => rubber.are_symmetric(),
        };
        images.all(|((s, a), (image, b))| {
            close(*s, 1.0 - image, 1.0) && close(a[0], b[0], size) && close(a[1], -b[1], size)
        }) && same_material
    }
}

impl DiscreteMembrane for SpectralElements {
    fn setting(&self) -> &Setting {
        &self.setting
    }

    fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        self.setting.check([nodes.len(), out.len()]);
        out.fill(0.0);
        match &self.material {
            ElementMaterial::Springs(springs) => {
                for (e, springs) in springs.iter().enumerate() {
                    let (window, out) = (self.window(e), &mut out[self.window(e)]);
                    springs.add_pull_into(nodes[window].as_chunks().0, out.as_chunks_mut().0);
                }
            }
            ElementMaterial::Rubber(rubber) => {
                if rubber.forces_into(nodes, 0.0, out).is_err() {
                    out.fill(f64::NAN);
                }
            }
        }
        self.setting.hold(out, 0.0);
    }

    fn check_stretches(&self, nodes: &[f64]) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        match &self.material {
            ElementMaterial::Springs(_) => Ok(()),
            ElementMaterial::Rubber(rubber) => rubber.energy(nodes).map(drop),
        }
    }

    /// For springs zero where elements meet, because the force there is a jump of the tension.
    fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        length("forces", out.len(), nodes.len())?;
        out.fill(0.0);
        let p = self.degree();
        if let ElementMaterial::Rubber(rubber) = &self.material {
            rubber.pressure_into(nodes, intensity, out);
            self.setting.hold(out, 0.0);
            return Ok(());
        }
        for e in 0..self.elements.len() {
            for i in 1..p {
                let (d, scale) = self.direction(nodes, e, i)?;
                out[2 * (e * p + i)] = -intensity * d[1] * scale;
                out[2 * (e * p + i) + 1] = intensity * d[0] * scale;
            }
        }
        Ok(())
    }

    fn forces_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        elastic: &mut [f64],
        out: &mut [f64],
    ) -> Result<Option<f64>, MembraneError> {
        self.setting.check_state(nodes)?;
        length("forces", out.len(), nodes.len())?;
        let ElementMaterial::Rubber(rubber) = &self.material else {
            return forces_apart_into(self, nodes, intensity, elastic, out);
        };
        let volume = rubber.forces_into(nodes, intensity, out)?;
        self.setting.hold(out, 0.0);
        Ok(Some(volume))
    }

    /// A block for each element.
    fn tangent(&self) -> Tangent {
        let (count, size) = (self.elements.len(), 2 * (self.degree() + 1));
        Tangent {
            blocks: vec![vec![0.0; size * size]; count],
            band: BandMatrix::of_shape(2 * (count + 1), 3, 3),
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
        self.check_tangent(out)?;
        let p = self.degree();
        let mut columns = vec![0.0; 12 * (p + 1)];
        for (e, block) in out.blocks.iter_mut().enumerate() {
            match &self.material {
                ElementMaterial::Springs(springs) => {
                    self.element_tangent_into(&springs[e], e, nodes, intensity, block)?;
                }
                ElementMaterial::Rubber(rubber) => {
                    rubber.tangent_into(e, nodes, (intensity, least), &mut columns, block)?;
                }
            }
        }
        out.band.clear();
        self.clear_held_rows(&mut out.blocks);
        for &held in self.fixed() {
            let end = 2 * (held / 2 / p) + held % 2;
            out.band.add_inside(end, end, 1.0);
        }
        Ok(())
    }

    fn strain_energy(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
        self.rubber("strain energy")?.energy(nodes)
    }

    fn least_tension(&self, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
        match &self.material {
            ElementMaterial::Springs(_) => Ok(f64::INFINITY),
            ElementMaterial::Rubber(rubber) => rubber.least_tension(nodes),
        }
    }

    fn add_mass_into(&self, scale: f64, out: &mut Tangent) -> Result<(), MembraneError> {
        self.check_tangent(out)?;
        let rubber = self.rubber("mass")?;
        for (e, block) in out.blocks.iter_mut().enumerate() {
            rubber.add_mass_into(e, scale, block);
        }
        self.clear_held_rows(&mut out.blocks);
        Ok(())
    }

    /// By quadrature: area and volume are exact for the polynomials, length and surface have the error of a Gauss rule with 3 p / 2 + 2
    /// points per element. Cost O(elements p^2).
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64, MembraneError> {
        self.setting.check_state(nodes)?;
        Ok(self.integrate(measure, nodes, None))
    }

    fn measures(&self, nodes: &[f64]) -> Result<Measures, MembraneError> {
        self.setting.check_state(nodes)?;
        Ok(self.integrate_all(nodes))
    }

    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        self.setting.check([nodes.len(), out.len()]);
        out.fill(0.0);
        self.integrate(measure, nodes, Some(out));
    }

    fn positions(&self) -> Vec<f64> {
        let mut s = vec![0.0];
        for Element { from, to, .. } in &self.elements {
            s.extend((self.reference.nodes[1..].iter()).map(|t| from + (to - from) * t));
        }
        if self.is_half() {
            let mirrored: Vec<f64> = s[..s.len() - 1].iter().rev().map(|s| 1.0 - s).collect();
            s.extend(mirrored);
        }
        s
    }

    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>, MembraneError> {
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
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint, MembraneError> {
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
