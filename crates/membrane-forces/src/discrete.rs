//! The interface of a discretised membrane to solvers.

use std::f64::consts::PI;
use std::fmt::Debug;
use std::sync::Arc;

use crate::curve::CurvePiece;
use crate::error::{MembraneError, Result, finite};
use crate::law::PressureLaw;
use crate::material::Material;
use crate::measures::{Measure, Measures};
use crate::membrane::Membrane;
use crate::nodes::Nodes;
use crate::reference::CurvePoint;
use crate::tangent::{Layout, Tangent};

/// A membrane whose shape is defined by finitely many nodes.
///
/// A state contains their positions from s = 0, flat: x0, y0, x1, y1, ... Forces have the same layout and are per unit s. If reference
/// configuration, stiffness and ends are mirror images about the x axis, the state may end there ([`DiscreteMembrane::is_half`]); methods
/// for the whole curve still apply to the whole curve. A membrane of rubber is always such a half, and its forces are minus the derivatives
/// of its energy by its nodes, not per unit s.
///
/// Forces are F = -(1/w) d(E - p M)/dx at moving nodes, with the elastic energy E ([`DiscreteMembrane::elastic_energy`]), the intensity p and
/// a measure M of the whole curve:
///
/// | material | w | M |
/// | --- | --- | --- |
/// | springs, finite differences, whole curve | ds: forces are per unit s | 2-D area, under the law per current length |
/// | springs under the other laws | ds | none: the pressure force is not a gradient |
/// | springs, spectral elements | none: strong form, equal to the gradient per unit s in the limit | |
/// | rubber | 1: forces at the nodes | volume |
///
/// On half a curve of springs a moving node off the axis counts with its image: w = 2 ds.
///
/// The `intensity` that pressure functions take is f or p: the load itself, or under the total-force law the load over the
/// surface, F / S(c), with S from [`DiscreteMembrane::measure`].
///
/// NaN in a state or in `s` gives NaN in measures, points and curves; forces of such states are NaN or
/// [`MembraneError::CoincidentPoints`].
///
/// # Errors
/// [`MembraneError::WrongLength`] from every method that returns a `Result`: a state or slice whose length differs from that of
/// [`DiscreteMembrane::start`], or a [`Tangent`] of another membrane. [`MembraneError::PastStretch`] from every method with forces or
/// energies: rubber stretched beyond its limit.
///
/// # Panics
/// [`DiscreteMembrane::elastic_force_into`] and [`DiscreteMembrane::measure_gradient_into`] panic on a wrong length; they have no errors.
pub trait DiscreteMembrane: Debug + Send + Sync {
    /// Properties that do not depend on the discretisation.
    fn setting(&self) -> &Setting;

    /// Pressure law of the membrane.
    fn law(&self) -> PressureLaw {
        self.setting().membrane.law()
    }

    /// Reference configuration moved to the fixed ends ([`Membrane::with_ends`]): the initial state of solvers.
    fn start(&self) -> &[f64] {
        &self.setting().start
    }

    /// Whether the state ends at the axis and the rest of the curve is its mirror image.
    fn is_half(&self) -> bool {
        self.setting().nodes.is_half()
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
        match self.setting().membrane.material() {
            Material::Springs { .. } => self.law().intensity_scale(self.stiffness_scale(), length),
            // of a sphere of this meridian, some stiffness over its radius
            Material::Rubber(_) => PI * self.stiffness_scale() / length,
        }
    }

    /// Computes the elastic force F_e, zero where the membrane is fixed: per unit s for springs, at the nodes for rubber. All numbers are NaN
    /// if rubber is stretched beyond its limit.
    ///
    /// # Panics
    /// `nodes` or `out` has another length than [`DiscreteMembrane::start`].
    fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        let setting = self.setting();
        setting.assert_lengths([nodes.len(), out.len()]);
        if setting.elastic.pull_into(nodes, out).is_err() {
            out.fill(f64::NAN);
        }
        setting.hold(out);
    }

    /// Computes the pressure force F_p at force intensity `intensity`, zero where the membrane is fixed. It is linear in the intensity, so
    /// intensity 1 gives dF_p / d intensity. For springs of spectral elements it is zero where elements meet, because the force there is a
    /// jump of the tension.
    ///
    /// # Errors
    /// [`MembraneError::CoincidentPoints`]: the curve has no direction at a node, so its normal is undefined;
    /// [`MembraneError::OutOfRange`]: an intensity that is not finite.
    fn pressure_force_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()> {
        let setting = self.setting();
        setting.check_state(nodes)?;
        finite("force intensity", intensity)?;
        MembraneError::length("forces", out.len(), nodes.len())?;
        setting.elastic.push_into(nodes, intensity, out)?;
        setting.hold(out);
        Ok(())
    }

    /// Computes F_e + F_p at force intensity `intensity`, with `scratch` of the same length, whose content is then undefined. Returns the
    /// volume if it is a by-product, as for spectral elements of rubber.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::pressure_force_into`].
    fn forces_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        scratch: &mut [f64],
        out: &mut [f64],
    ) -> Result<Option<f64>> {
        let setting = self.setting();
        setting.check_state(nodes)?;
        finite("force intensity", intensity)?;
        MembraneError::length("forces", out.len(), nodes.len())?;
        MembraneError::length("scratch of forces", scratch.len(), nodes.len())?;
        let volume = (setting.elastic).forces_into(nodes, intensity, scratch, out)?;
        setting.hold(out);
        Ok(volume)
    }

    /// Returns a zero tangent for [`DiscreteMembrane::tangent_into`]: a band, or a block for each spectral element.
    fn tangent(&self) -> Tangent {
        Tangent::zeros(self.setting().elastic.layout())
    }

    /// Computes the derivative of F_e + F_p by the state at constant intensity, with the unit matrix in the rows and columns of fixed numbers.
    ///
    /// Under the total-force law, f = F / S, the full derivative also has the rank-one part -(F / S^2) n (x) grad S, with n the
    /// [pressure force](DiscreteMembrane::pressure_force_into) at intensity 1.
    ///
    /// # Errors
    /// As [`DiscreteMembrane::pressure_force_into`].
    fn tangent_into(&self, nodes: &[f64], intensity: f64, out: &mut Tangent) -> Result<()> {
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
    ) -> Result<()> {
        let setting = self.setting();
        setting.check_state(nodes)?;
        finite("force intensity", intensity)?;
        out.check(setting.elastic.layout())?;
        (setting.elastic).tangent_into(nodes, (intensity, least), out)?;
        out.hold(&setting.fixed);
        Ok(())
    }

    /// Elastic energy. For rubber: the integral of 2 pi r0 h W over the meridian, zero in the reference configuration. For springs: that of
    /// the whole curve above that of the start, force per s times cm.
    fn elastic_energy(&self, nodes: &[f64]) -> Result<f64> {
        let setting = self.setting();
        setting.check_state(nodes)?;
        setting.elastic.energy(nodes, &setting.start)
    }

    /// Least tension of rubber along the meridian, dW/dl1 over l1 and the shear modulus, as in [`DiscreteMembrane::taut_tangent_into`].
    /// Infinite for springs.
    fn least_tension(&self, nodes: &[f64]) -> Result<f64> {
        self.setting().check_state(nodes)?;
        self.setting().elastic.least_tension(nodes)
    }

    /// Adds `scale` times the mass matrix of rubber of density 1 to the rows of moving nodes.
    ///
    /// The mass matrix of spectral elements is the integral of 2 pi r0 h over the meridian times the products of the functions of two
    /// nodes; that of two-node elements is diagonal. It is symmetric and positive definite.
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`] for springs.
    fn add_mass_into(&self, scale: f64, out: &mut Tangent) -> Result<()> {
        let setting = self.setting();
        out.check(setting.elastic.layout())?;
        setting.elastic.add_mass_into(scale, &setting.fixed, out)
    }

    /// Computes a measure of the whole curve.
    fn measure(&self, measure: Measure, nodes: &[f64]) -> Result<f64>;

    /// Computes all four measures of the whole curve.
    fn measures(&self, nodes: &[f64]) -> Result<Measures>;

    /// Computes the gradient of [`DiscreteMembrane::measure`] by the state, with polynomials at fixed points of quadrature. Where a curve crosses the
    /// axis inside an element, those of the surface move with it, so that the derivative of the measure differs by about the error of the quadrature.
    ///
    /// # Panics
    /// `nodes` or `out` has another length than [`DiscreteMembrane::start`].
    fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]);

    /// Returns the material coordinate of every node of the whole curve, s from 0 to 1. Node n of a state has the n-th one, also if the state
    /// ends at the axis and therefore has fewer nodes.
    fn positions(&self) -> Vec<f64>;

    /// Returns all nodes of the whole curve.
    fn points(&self, nodes: &[f64]) -> Result<Vec<[f64; 2]>> {
        self.setting().check_state(nodes)?;
        let all = self.setting().nodes;
        Ok((0..all.whole).map(|n| all.node(nodes, n)).collect())
    }

    /// Returns the whole curve as polynomials; empty if the curve consists of its points.
    fn pieces(&self, nodes: &[f64]) -> Result<Vec<CurvePiece>>;

    /// Evaluates the whole curve at material coordinate `s`, clamped to [0, 1].
    fn at(&self, nodes: &[f64], s: f64) -> Result<CurvePoint>;
}

/// The forces of one material in one discretisation, and their derivatives. Rows of fixed numbers may have any value. Lengths of slices are
/// those of a state.
pub(crate) trait Elastic: Debug + Send + Sync {
    /// [`DiscreteMembrane::stiffness_scale`].
    fn scale(&self) -> f64;

    /// [`DiscreteMembrane::blow_up`] under the law per current length.
    fn blow_up(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether the material of the whole curve is its own mirror image, to rounding.
    fn is_mirrored(&self) -> bool;

    /// `out` = F_e.
    fn pull_into(&self, nodes: &[f64], out: &mut [f64]) -> Result<()>;

    /// `out` = F_p.
    fn push_into(&self, nodes: &[f64], intensity: f64, out: &mut [f64]) -> Result<()>;

    /// [`DiscreteMembrane::forces_into`].
    fn forces_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        elastic: &mut [f64],
        out: &mut [f64],
    ) -> Result<Option<f64>> {
        self.pull_into(nodes, elastic)?;
        self.push_into(nodes, intensity, out)?;
        let sums = out.iter_mut().zip(elastic);
        sums.for_each(|(out, elastic)| *out += *elastic);
        Ok(None)
    }

    fn layout(&self) -> Layout;

    /// [`DiscreteMembrane::taut_tangent_into`] for intensity and least tension.
    fn tangent_into(&self, nodes: &[f64], state: (f64, f64), out: &mut Tangent) -> Result<()>;

    /// [`DiscreteMembrane::elastic_energy`].
    fn energy(&self, nodes: &[f64], start: &[f64]) -> Result<f64>;

    /// [`DiscreteMembrane::least_tension`].
    fn least_tension(&self, _nodes: &[f64]) -> Result<f64> {
        Ok(f64::INFINITY)
    }

    /// [`DiscreteMembrane::add_mass_into`] with these `fixed` numbers.
    fn add_mass_into(&self, _scale: f64, _fixed: &[usize], _out: &mut Tangent) -> Result<()> {
        let (what, needs) = ("mass matrix", "rubber");
        Err(MembraneError::OtherMaterial { what, needs })
    }
}

/// The properties of a discretised membrane that do not depend on the discretisation; the methods of [`DiscreteMembrane`] document each.
#[derive(Debug, Clone)]
pub struct Setting {
    membrane: Membrane,
    pub(crate) nodes: Nodes,
    start: Vec<f64>,
    fixed: Vec<usize>,
    elastic: Arc<dyn Elastic>,
    stiffness_scale: f64,
    blow_up: f64,
}

impl Setting {
    /// Returns the discretised membrane.
    #[must_use]
    pub fn membrane(&self) -> &Membrane {
        &self.membrane
    }

    /// Collects the properties of `membrane`, with its start at all or at more `nodes`.
    pub(crate) fn new(
        membrane: &Membrane,
        nodes: Nodes,
        mut start: Vec<f64>,
        elastic: Arc<dyn Elastic>,
    ) -> Self {
        nodes.cut(&mut start);
        let last = start.len() - 1;
        let mut fixed = vec![0, 1];
        match (nodes.is_half(), nodes.has_apex()) {
            (false, _) => fixed.extend([last - 1, last]),
            (true, true) => fixed.push(last),
            (true, false) => (),
        }
        let blows_up = membrane.law().blows_up();
        Self {
            membrane: membrane.clone(),
            nodes,
            start,
            fixed,
            stiffness_scale: elastic.scale(),
            blow_up: if blows_up {
                elastic.blow_up()
            } else {
                f64::INFINITY
            },
            elastic,
        }
    }

    pub(crate) fn is_mirrored(&self) -> bool {
        self.elastic.is_mirrored()
    }

    /// Writes zeros where the membrane is fixed.
    fn hold(&self, values: &mut [f64]) {
        self.fixed.iter().for_each(|&held| values[held] = 0.0);
    }

    /// # Panics
    /// One of `lengths` differs from that of a state.
    pub(crate) fn assert_lengths<const N: usize>(&self, lengths: [usize; N]) {
        let expected = [self.start.len(); N];
        assert_eq!(lengths, expected, "numbers in states or forces");
    }

    pub(crate) fn check_state(&self, nodes: &[f64]) -> Result<()> {
        MembraneError::length("nodes", nodes.len(), self.start.len())
    }
}
