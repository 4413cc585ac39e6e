//! Spectral elements: one polynomial per smooth piece, exponentially accurate.

use std::f64::consts::PI;

use crate::chebyshev::Reference;
use crate::curve::CurvePiece;
use crate::error::{MembraneError, finite, length};
use crate::law::PressureLaw;
use crate::material::{Element, breakpoints, compliance, elastic_matrix};
use crate::membrane::Membrane;
use crate::rest::CurvePoint;

/// A membrane as polynomials of one degree p on elements that follow the breakpoints of its rest
/// shape and stiffness.
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
/// If rest shape, stiffness and ends are mirror images about the x axis, only s in [0, 1/2] is
/// discretised; the apex is then free along the axis and held on it.
#[derive(Debug, Clone)]
pub struct SpectralElements {
    law: PressureLaw,
    half: bool,
    pub(crate) reference: Reference,
    pub(crate) elements: Vec<Element>,
    start: Vec<f64>,
    stiffness_scale: f64,
    /// Integral of 1 / lambda over s in [0, 1]; 0 under the laws that do not need it.
    compliance: f64,
}

/// Interpolation at so many Chebyshev points is stable, and far beyond need.
const MOST_DEGREE: usize = 1000;

/// About a gigabyte.
const MOST_SIZE: usize = 100_000_000;

impl SpectralElements {
    /// Discretises `membrane` by polynomials of degree `degree`, `per_piece` elements on each
    /// smooth piece. Cost O(elements degree^3).
    ///
    /// # Errors
    /// Degree below 2 or above 1000, no element per piece or more elements than 1e8 over
    /// (degree + 3)^2, a stiffness that is not positive at a node, a rest curve that is not finite.
    pub fn new(
        membrane: &Membrane,
        degree: usize,
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        if degree < 2 {
            return Err(MembraneError::TooFew {
                quantity: "degree",
                given: degree,
                least: 2,
            });
        }
        if per_piece == 0 {
            return Err(MembraneError::TooFew {
                quantity: "elements per piece",
                given: 0,
                least: 1,
            });
        }
        // Each element keeps a matrix of degree + 1 rows, its nodes and the heads of its lists.
        let pieces = breakpoints(membrane, false).len() - 1;
        let size = per_piece
            .saturating_mul(pieces)
            .saturating_mul(degree.saturating_add(3).saturating_pow(2));
        if degree > MOST_DEGREE || size > MOST_SIZE {
            return Err(MembraneError::TooMany {
                quantity: "degree, or (degree + 3)^2 times the elements",
                given: degree.max(size),
                most: if degree > MOST_DEGREE {
                    MOST_DEGREE
                } else {
                    MOST_SIZE
                },
            });
        }
        let reference = Reference::new(degree);
        let full = Self::on(
            membrane,
            &reference,
            &breakpoints(membrane, false),
            per_piece,
        )?;
        if !is_symmetric(&full) {
            return Ok(full);
        }
        let mut half = Self::on(
            membrane,
            &reference,
            &breakpoints(membrane, true),
            per_piece,
        )?;
        half.half = true;
        half.compliance *= 2.0;
        let apex = half.start.len() - 1;
        half.start[apex] = 0.0;
        Ok(half)
    }

    fn on(
        membrane: &Membrane,
        reference: &Reference,
        breaks: &[f64],
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        let n = reference.nodes.len();
        let mut this = Self {
            law: membrane.law(),
            half: false,
            reference: reference.clone(),
            elements: Vec::new(),
            start: Vec::new(),
            stiffness_scale: 0.0,
            compliance: 0.0,
        };
        let rest_breaks = membrane.rest().breakpoints();
        for piece in breaks.windows(2) {
            let inside = 0.5 * (piece[0] + piece[1]);
            let rest_piece = rest_breaks.partition_point(|&b| b <= inside) - 1;
            for k in 0..per_piece {
                let at = |k: usize| piece[0] + (piece[1] - piece[0]) * k as f64 / per_piece as f64;
                let (from, to) = (
                    at(k),
                    if k + 1 == per_piece {
                        piece[1]
                    } else {
                        at(k + 1)
                    },
                );
                let s = |t: f64| from + (to - from) * t;
                // just inside, so that a jump at the element's end is seen from its side
                let inside = (1e-12 * (to - from)).max(8.0 * f64::EPSILON);
                let mut stiffness = Vec::with_capacity(n);
                for &t in &reference.nodes {
                    let s = s(t).max(from + inside).min(to - inside);
                    stiffness.push(membrane.effective_stiffness(s)?);
                }
                if membrane.law().blows_up() {
                    this.compliance += compliance(membrane, from, to)?;
                }
                this.stiffness_scale = stiffness
                    .iter()
                    .copied()
                    .fold(this.stiffness_scale, f64::max);
                let rest: Vec<[f64; 2]> = reference
                    .nodes
                    .iter()
                    .map(|&t| membrane.rest().at_in(rest_piece, s(t)).position)
                    .collect();
                for value in rest.as_flattened() {
                    finite("rest curve", *value)?;
                }
                let skip = if this.elements.is_empty() { 0 } else { 1 };
                this.start.extend(rest[skip..].as_flattened());
                let elastic = elastic_matrix(reference, &stiffness, to - from);
                this.elements.push(Element {
                    from,
                    to,
                    rest,
                    elastic,
                });
            }
        }
        let positions = this.positions();
        membrane.hold_ends(positions.into_iter().zip(this.start.as_chunks_mut::<2>().0));
        Ok(this)
    }

    /// Pressure law of the membrane.
    pub fn law(&self) -> PressureLaw {
        self.law
    }

    /// Degree p of the polynomials.
    pub fn degree(&self) -> usize {
        self.reference.nodes.len() - 1
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.elements.len()
    }

    /// Whether only s in [0, 1/2] is discretised, the rest being its mirror image.
    pub fn is_half(&self) -> bool {
        self.half
    }

    /// The rest shape moved to where the membrane is held ([`Membrane::with_ends`]): where solvers
    /// start.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// Largest stiffness, lambda + 4 lambda_2.
    pub fn stiffness_scale(&self) -> f64 {
        self.stiffness_scale
    }

    /// Intensity at which the law per current length has no equilibrium any more and the curve
    /// runs to infinity, 2 pi over the integral of 1 / lambda; infinite under the other laws.
    pub fn blow_up(&self) -> f64 {
        if self.law.blows_up() {
            2.0 * PI / self.compliance
        } else {
            f64::INFINITY
        }
    }

    /// Whether the x and the y of the first and of the last node are held.
    pub fn held(&self) -> [[bool; 2]; 2] {
        [[true, true], [!self.half, true]]
    }

    /// `out` = elastic force (see the type's description); zero where the curve is held.
    ///
    /// # Panics
    /// A length that is not that of [`SpectralElements::start`].
    pub fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        self.check(nodes, out);
        out.fill(0.0);
        let n = self.degree() + 1;
        for (e, element) in self.elements.iter().enumerate() {
            let base = 2 * e * (n - 1);
            let local = nodes[base..base + 2 * n].as_chunks::<2>().0;
            for i in 0..n {
                let row = &element.elastic[i * n..(i + 1) * n];
                let mut sum = [0.0; 2];
                for j in 0..n {
                    sum[0] += row[j] * (local[j][0] - element.rest[j][0]);
                    sum[1] += row[j] * (local[j][1] - element.rest[j][1]);
                }
                out[base + 2 * i] += sum[0];
                out[base + 2 * i + 1] += sum[1];
            }
        }
        self.clear_held(out);
    }

    /// `out` = pressure force at force intensity `intensity`, linear in it; zero where elements
    /// meet and where the curve is held.
    ///
    /// # Errors
    /// The curve has no direction at a node.
    ///
    /// # Panics
    /// A length that is not that of [`SpectralElements::start`].
    pub fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        self.check(nodes, out);
        out.fill(0.0);
        let p = self.degree();
        for e in 0..self.elements.len() {
            for i in 1..p {
                let (d, scale) = self.direction(nodes, e, i)?;
                out[2 * (e * p + i)] = -intensity * d[1] * scale;
                out[2 * (e * p + i) + 1] = intensity * d[0] * scale;
            }
        }
        Ok(())
    }

    /// Tangent of element `element`: derivative of the forces it contributes by its own nodes,
    /// 2 (p + 1) rows and columns, row by row, **interior nodes first, then its first, then its
    /// last node**, x before y. Rows of end nodes are shares of the tension jump: add those of
    /// neighbours; where the curve is held put a unit row instead.
    ///
    /// # Errors
    /// The curve has no direction at a node; [`MembraneError::NoSuchElement`].
    ///
    /// # Panics
    /// A length: of `nodes` that of [`SpectralElements::start`], of `out` (2 (p + 1))^2.
    pub fn element_tangent_into(
        &self,
        element: usize,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        let p = self.degree();
        let (n, size) = (p + 1, 2 * (p + 1));
        self.check(nodes, nodes);
        assert_eq!(out.len(), size * size, "element tangent");
        let Some(this) = self.elements.get(element) else {
            return Err(MembraneError::NoSuchElement {
                given: element,
                count: self.elements.len(),
            });
        };
        let per_s = 1.0 / (this.to - this.from);
        for i in 0..n {
            let derivative = &self.reference.derivative[i * n..(i + 1) * n];
            let elastic = &this.elastic[i * n..(i + 1) * n];
            // the pressure force by c', row by row
            let mut by = [[0.0; 2]; 2];
            if i > 0 && i < p {
                let (d, scale) = self.direction(nodes, element, i)?;
                by = self.law.derivative(intensity * per_s, d, scale);
            }
            let first = 2 * local_index(i, p) * size;
            let (x_row, y_row) = out[first..first + 2 * size].split_at_mut(size);
            for j in 0..n {
                let column = 2 * local_index(j, p);
                x_row[column] = elastic[j] + by[0][0] * derivative[j];
                x_row[column + 1] = by[0][1] * derivative[j];
                y_row[column] = by[1][0] * derivative[j];
                y_row[column + 1] = elastic[j] + by[1][1] * derivative[j];
            }
        }
        Ok(())
    }

    /// Material coordinate of every node of the whole curve, s from 0 to 1.
    pub fn positions(&self) -> Vec<f64> {
        let mut s = vec![0.0];
        for element in &self.elements {
            s.extend(
                self.reference.nodes[1..]
                    .iter()
                    .map(|t| element.from + (element.to - element.from) * t),
            );
        }
        if self.half {
            let mirrored: Vec<f64> = s[..s.len() - 1].iter().rev().map(|s| 1.0 - s).collect();
            s.extend(mirrored);
        }
        s
    }

    /// The whole curve at those positions, s from 0 to 1.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if `nodes` has not the length of [`SpectralElements::start`].
    pub fn points(&self, nodes: &[f64]) -> Result<Vec<[f64; 2]>, MembraneError> {
        length("nodes", nodes.len(), self.start.len())?;
        let mut points = nodes.as_chunks::<2>().0.to_vec();
        if self.half {
            let mirrored: Vec<[f64; 2]> = points[..points.len() - 1]
                .iter()
                .rev()
                .map(|&[x, y]| [x, -y])
                .collect();
            points.extend(mirrored);
        }
        Ok(points)
    }

    /// The whole curve as one polynomial per element, s from 0 to 1.
    ///
    /// # Errors
    /// As [`SpectralElements::points`].
    pub fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>, MembraneError> {
        length("nodes", nodes.len(), self.start.len())?;
        let mut pieces: Vec<CurvePiece> = (0..self.elements.len())
            .map(|e| self.piece(nodes, e))
            .collect();
        if self.half {
            let mirrored: Vec<_> = pieces.iter().rev().map(CurvePiece::mirrored).collect();
            pieces.extend(mirrored);
        }
        Ok(pieces)
    }

    fn piece(&self, nodes: &[f64], e: usize) -> CurvePiece {
        let p = self.degree();
        let local = nodes[2 * e * p..2 * (e + 1) * p + 2].as_chunks::<2>().0;
        let along = |k: usize| local.iter().map(|c| c[k]).collect::<Vec<_>>();
        CurvePiece {
            from: self.elements[e].from,
            to: self.elements[e].to,
            x: self.reference.coefficients(&along(0)),
            y: self.reference.coefficients(&along(1)),
        }
    }

    /// The whole curve at material coordinate `s`, clamped to [0, 1]; where elements meet the
    /// derivatives are those of the one on the left. Cost O(p^2); for many s take
    /// [`SpectralElements::pieces`] once.
    ///
    /// # Errors
    /// As [`SpectralElements::points`].
    pub fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint, MembraneError> {
        length("nodes", nodes.len(), self.start.len())?;
        let s = s.clamp(0.0, 1.0);
        let mirrored = self.half && s > 0.5;
        let here = if mirrored { 1.0 - s } else { s };
        let e = self.elements.partition_point(|element| element.to < here);
        let piece = self.piece(nodes, e.min(self.elements.len() - 1));
        Ok(if mirrored {
            piece.mirrored().at(s)
        } else {
            piece.at(s)
        })
    }

    pub(crate) fn element_length(&self, element: usize) -> f64 {
        self.elements[element].to - self.elements[element].from
    }

    /// c' by s at node `i` of element `e`, and the factor that makes it what the law multiplies.
    #[inline]
    fn direction(
        &self,
        nodes: &[f64],
        e: usize,
        i: usize,
    ) -> Result<([f64; 2], f64), MembraneError> {
        let p = self.degree();
        let row = &self.reference.derivative[i * (p + 1)..(i + 1) * (p + 1)];
        let local = nodes[2 * e * p..2 * (e + 1) * p + 2].as_chunks::<2>().0;
        let mut d = [0.0; 2];
        for (a, c) in row.iter().zip(local) {
            d[0] += a * c[0];
            d[1] += a * c[1];
        }
        let per_s = 1.0 / self.element_length(e);
        d = [d[0] * per_s, d[1] * per_s];
        // d is c' itself: the way while s grows by 1
        Ok((d, self.law.factor(d, 1.0, e * p + i)?))
    }

    fn clear_held(&self, out: &mut [f64]) {
        let last = out.len() - 2;
        let [first, end] = self.held();
        for k in 0..2 {
            if first[k] {
                out[k] = 0.0;
            }
            if end[k] {
                out[last + k] = 0.0;
            }
        }
    }

    pub(crate) fn check(&self, nodes: &[f64], out: &[f64]) {
        let n = self.start.len();
        assert!(
            nodes.len() == n && out.len() == n,
            "expected {n} numbers, got {} and {}",
            nodes.len(),
            out.len()
        );
    }
}

/// Place of node `i` in an element's tangent: interior nodes first, then the two ends.
fn local_index(i: usize, p: usize) -> usize {
    match i {
        0 => p - 1,
        i if i == p => p,
        i => i - 1,
    }
}

/// Whether `full` equals its own mirror image to rounding, node by node and spring by spring.
fn is_symmetric(full: &SpectralElements) -> bool {
    let size = full.start.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-13 * scale;
    let points = full.start.as_chunks::<2>().0;
    let s = full.positions();
    let mirrored = |k: usize| {
        let ([x, y], [mx, my]) = (points[k], points[points.len() - 1 - k]);
        close(s[k], 1.0 - s[points.len() - 1 - k], 1.0) && close(x, mx, size) && close(y, -my, size)
    };
    let even = |(a, b): (&Element, &Element)| {
        let size = a.elastic.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut pairs = a.elastic.iter().zip(b.elastic.iter().rev());
        pairs.all(|(a, b)| close(*a, *b, size))
    };
    (0..points.len()).all(mirrored)
        && full
            .elements
            .iter()
            .zip(full.elements.iter().rev())
            .all(even)
}
