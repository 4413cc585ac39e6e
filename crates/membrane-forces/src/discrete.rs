//! The interface of a discretised membrane to solvers, and the form of its tangent.

use std::fmt::Debug;

use crate::band::BandMatrix;
use crate::curve::CurvePiece;
use crate::error::{MembraneError, length};
use crate::law::PressureLaw;
use crate::material::Material;
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;
use crate::reference::CurvePoint;

/// A membrane whose shape is defined by finitely many nodes.
///
/// A state contains their positions from s = 0, flat: x0, y0, x1, y1, ... Forces have the same layout and are per unit s. If reference
/// configuration, stiffness and ends are mirror images about the x axis, the state may end there ([`DiscreteMembrane::is_half`]); methods
/// for the whole curve still apply to the whole curve. A membrane of rubber is always such a half, and its forces are minus the derivatives
/// of its energy by its nodes, not per unit s.
///
/// The `intensity` that pressure functions take is f or p: the load itself, or under the total-force law the load over the
/// surface, F / S(c), with S from [`DiscreteMembrane::measure`].
///
/// # Errors
/// [`MembraneError::WrongLength`] from every method that returns a `Result`: a state or slice whose length differs from that of
/// [`DiscreteMembrane::start`], or a [`Tangent`] of another membrane.
///
/// # Panics
/// [`DiscreteMembrane::elastic_force_into`] and [`DiscreteMembrane::measure_gradient_into`] panic on such a length; they have no other errors.
pub trait DiscreteMembrane: Debug + Send + Sync {
    /// Properties that do not depend on the discretisation.
    fn setting(&self) -> &Setting;

    /// Pressure law of the membrane.
    fn law(&self) -> PressureLaw {
        self.setting().law
    }

    /// Reference configuration moved to the fixed ends ([`Membrane::with_ends`](crate::Membrane::with_ends)): the initial state of solvers.
    fn start(&self) -> &[f64] {
        &self.setting().start
    }

    /// Whether the state ends at the axis and the rest of the curve is its mirror image.
    fn is_half(&self) -> bool {
        self.setting().half
    }

    /// Indices of the fixed numbers of a state, ascending: those of the ends, and the y of a node on the axis where the state ends.
    fn fixed(&self) -> &[usize] {
        &self.setting().fixed
    }

    /// Largest stiffness, lambda + 4 lambda_2; for rubber shear modulus times thickness.
    fn stiffness_scale(&self) -> f64 {
        self.setting().stiffness_scale
    }

    /// Intensity beyond which the law per current length has no equilibrium and the curve runs to infinity; infinite under the other laws.
    fn blow_up(&self) -> f64 {
        self.setting().blow_up
    }

    /// Intensity that moves a membrane of this length by about that length.
    fn intensity_scale(&self, length: f64) -> f64 {
        let Setting {
            membrane,
            stiffness_scale,
            ..
        } = self.setting();
        match membrane.material() {
            Material::Springs { .. } => self.law().intensity_scale(*stiffness_scale, length),
            // of a sphere of this meridian, some stiffness over its radius
            Material::Rubber(_) => std::f64::consts::PI * stiffness_scale / length,
        }
    }

    /// Computes the elastic force F_e, zero where the membrane is fixed. It is NaN where rubber is stretched beyond its limit, which
    /// [`DiscreteMembrane::check_stretches`] reports as an error.
    fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]);

    /// Checks that no rubber is stretched beyond its limit; springs have none.
    ///
    /// # Errors
    /// [`MembraneError::PastStretch`].
    fn check_stretches(&self, nodes: &[f64]) -> Result<(), MembraneError>;

    /// Computes the pressure force F_p at force intensity `intensity`, zero where the membrane is fixed. It is linear in the intensity, so
    /// intensity 1 gives dF_p / d intensity.
    ///
    /// # Errors
    /// The curve has no direction at a node, so its normal is undefined.
    fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError>;

    /// Computes F_e + F_p at force intensity `intensity`, with `elastic` as scratch. Returns the volume if it is a by-product, as for
    /// spectral elements of rubber.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::pressure_force_into`] and [`DiscreteMembrane::check_stretches`].
    fn forces_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        elastic: &mut [f64],
        out: &mut [f64],
    ) -> Result<Option<f64>, MembraneError> {
        forces_apart_into(self, nodes, intensity, elastic, out)
    }

    /// Returns a zero tangent for [`DiscreteMembrane::tangent_into`].
    fn tangent(&self) -> Tangent;

    /// Computes the derivative of F_e + F_p by the state at constant intensity, with a unit in the rows of fixed numbers.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::pressure_force_into`] and [`DiscreteMembrane::check_stretches`].
    fn tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut Tangent,
    ) -> Result<(), MembraneError> {
        self.taut_tangent_into(nodes, intensity, f64::NEG_INFINITY, out)
    }

    /// Computes [`DiscreteMembrane::tangent_into`] with tensions along the meridian of at least `least` times the shear modulus (over l1, per
    /// reference area), which makes the tangent of slack rubber regular. The tangent of springs is exact.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::tangent_into`].
    fn taut_tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        least: f64,
        out: &mut Tangent,
    ) -> Result<(), MembraneError>;

    /// Elastic energy of a body of rubber: the integral of 2 pi r0 h W over the meridian, zero in the reference configuration.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::check_stretches`]; [`MembraneError::OtherMaterial`] for springs.
    fn strain_energy(&self, nodes: &[f64]) -> Result<f64, MembraneError>;

    /// Least tension of rubber along the meridian, dW/dl1 over l1 and the shear modulus, as in [`DiscreteMembrane::taut_tangent_into`].
    /// Infinite for springs.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::check_stretches`].
    fn least_tension(&self, nodes: &[f64]) -> Result<f64, MembraneError>;

    /// Adds `scale` times the mass matrix of rubber of density 1 to the rows of moving nodes.
    ///
    /// The mass matrix of spectral elements is the integral of 2 pi r0 h over the meridian times the products of the functions of two
    /// nodes; that of two-node elements is diagonal. It is symmetric and positive definite.
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`] for springs.
    fn add_mass_into(&self, scale: f64, out: &mut Tangent) -> Result<(), MembraneError>;

    /// Computes a measure of the whole curve.
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64, MembraneError>;

    /// Computes all four measures of the whole curve.
    fn measures(&self, nodes: &[f64]) -> Result<Measures, MembraneError> {
        Ok(Measures {
            length: self.measure(Measure::Length, nodes)?,
            area: self.measure(Measure::Area, nodes)?,
            surface: self.measure(Measure::Surface, nodes)?,
            volume: self.measure(Measure::Volume, nodes)?,
        })
    }

    /// Computes the gradient of [`DiscreteMembrane::measure`] by the state.
    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]);

    /// Returns the material coordinate of every node of the whole curve, s from 0 to 1.
    fn positions(&self) -> Vec<f64>;

    /// Returns all nodes of the whole curve.
    fn points(&self, nodes: &[f64]) -> Result<Vec<[f64; 2]>, MembraneError> {
        length("nodes", nodes.len(), self.start().len())?;
        let points = nodes.as_chunks::<2>().0;
        // a node on the axis is its own image
        let own = self.fixed().last() == Some(&(nodes.len() - 1));
        let others = &points[..points.len() - usize::from(own)];
        let mirrored = others.iter().rev().map(|&[x, y]| [x, -y]);
        let beyond = if self.is_half() { others.len() } else { 0 };
        Ok(points
            .iter()
            .copied()
            .chain(mirrored.take(beyond))
            .collect())
    }

    /// Returns the whole curve as polynomials; empty if the curve consists of its points.
    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>, MembraneError>;

    /// Evaluates the whole curve at material coordinate `s`, clamped to [0, 1].
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint, MembraneError>;
}

/// Implements [`DiscreteMembrane::forces_into`] by separate calls.
pub(crate) fn forces_apart_into(
    membrane: &(impl DiscreteMembrane + ?Sized),
    nodes: &[f64],
    intensity: f64,
    elastic: &mut [f64],
    out: &mut [f64],
) -> Result<Option<f64>, MembraneError> {
    membrane.elastic_force_into(nodes, elastic);
    if elastic.iter().any(|force| force.is_nan()) {
        membrane.check_stretches(nodes)?;
    }
    membrane.pressure_force_into(nodes, intensity, out)?;
    for (out, elastic) in out.iter_mut().zip(elastic) {
        *out += *elastic;
    }
    Ok(None)
}

/// Derivative of the forces by the state: dense blocks along the diagonal, coupled by a band.
///
/// Each block belongs to an element. Its rows and columns, x before y, are those of the element's inner nodes, then of its first, then of
/// its last node, which is the first of the next element. The band contains the end nodes of elements. Entries of blocks and band add.
/// Without blocks the band contains all nodes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Tangent {
    /// Square matrices, row by row.
    pub blocks: Vec<Vec<f64>>,
    /// The band.
    pub band: BandMatrix,
}

impl Tangent {
    /// Computes `out` = A `x` with this matrix A. Cost O(number of entries).
    ///
    /// A vector whose length is not that of a state.
    /// A length that is not that of a state.
    pub fn mul_into(&self, x: &[f64], out: &mut [f64]) {
        let Some(block) = self.blocks.first() else {
            return self.band.mul_into(x, out);
        };
        let size = block.len().isqrt();
        let stride = size - 2;
        let ends: Vec<usize> = (0..self.band.len())
            .map(|i| i / 2 * stride + i % 2)
            .collect();
        let at_ends: Vec<f64> = ends.iter().map(|&end| x[end]).collect();
        let mut product = vec![0.0; ends.len()];
        self.band.mul_into(&at_ends, &mut product);
        out.fill(0.0);
        ends.iter()
            .zip(product)
            .for_each(|(&end, value)| out[end] = value);
        for (e, block) in self.blocks.iter().enumerate() {
            let first = e * stride;
            let inner = first + 2..first + stride;
            let places: Vec<usize> = inner
                .chain(first..first + 2)
                .chain(first + stride..first + size)
                .collect();
            for (row, &to) in block.chunks_exact(size).zip(&places) {
                let products = row.iter().zip(&places).map(|(a, &from)| a * x[from]);
                out[to] += products.sum::<f64>();
            }
        }
    }
}

/// The properties of a discretised membrane that do not depend on the discretisation; the methods of [`DiscreteMembrane`] document each.
#[derive(Debug, Clone)]
pub struct Setting {
    pub(crate) membrane: Membrane,
    pub(crate) law: PressureLaw,
    pub(crate) start: Vec<f64>,
    pub(crate) half: bool,
    pub(crate) fixed: Vec<usize>,
    pub(crate) stiffness_scale: f64,
    pub(crate) blow_up: f64,
}

impl Setting {
    /// Returns the discretised membrane.
    #[must_use]
    pub fn membrane(&self) -> &Membrane {
        &self.membrane
    }

    /// Collects the properties of the whole of `membrane`, with reference positions `rest` at `s`.
    pub(crate) fn new(membrane: &Membrane, s: impl Iterator<Item = f64>, rest: &[f64]) -> Self {
        let mut start = rest.to_vec();
        membrane.hold_ends(s.zip(start.as_chunks_mut::<2>().0));
        let last = start.len() - 2;
        Self {
            membrane: membrane.clone(),
            law: membrane.law(),
            start,
            half: false,
            fixed: vec![0, 1, last, last + 1],
            stiffness_scale: 0.0,
            blow_up: f64::INFINITY,
        }
    }

    /// Ends the curve at the axis, after `len` numbers, the last of them on the axis if it has an `apex`.
    pub(crate) fn end_at_axis(&mut self, len: usize, apex: bool) {
        self.half = true;
        self.start.truncate(len);
        self.start.shrink_to_fit();
        self.fixed.truncate(2);
        if apex {
            self.fixed.push(len - 1);
            self.start[len - 1] = 0.0;
        }
    }

    /// Writes `value` where the membrane is fixed.
    pub(crate) fn hold(&self, values: &mut [f64], value: f64) {
        for &held in &self.fixed {
            values[held] = value;
        }
    }

    /// # Panics
    /// One of `lengths` differs from that of a state.
    pub(crate) fn check<const N: usize>(&self, lengths: [usize; N]) {
        let expected = [self.start.len(); N];
        assert_eq!(lengths, expected, "numbers in states or forces");
    }

    pub(crate) fn check_state(&self, nodes: &[f64]) -> Result<(), MembraneError> {
        length("nodes", nodes.len(), self.start.len())
    }
}
