//! The membrane's equilibrium under a control: one bordered system.

use membrane_forces::{BandMatrix, FiniteDifferences, Measure, Measures, Membrane, PressureLaw};

use crate::banded::BandedLu;
use crate::control::Control;
use crate::error::NewtonError;
use crate::newton::{NewtonOptions, NewtonReport, ResidualSystem, newton};

/// How the curve is discretised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Discretisation {
    /// The paper's second-order finite differences with this many nodes.
    FiniteDifferences {
        /// Nodes N, held ends included.
        nodes: usize,
    },
}

/// A membrane ready to be solved: immutable, shared by threads.
///
/// ```
/// use membrane_newton::{Control, Discretisation, NewtonOptions, Solver};
/// use membrane_newton::{Membrane, RestShape};
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
/// let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes: 201 })?;
/// let dilated = solver.solve(Control::VolumeGain(0.6), &NewtonOptions::default())?;
/// assert!((dilated.intensity - 17.48).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solver {
    differences: FiniteDifferences,
    start: Measures,
}

/// A solved membrane.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Nodes [x, y] from s = 0 to s = 1, cm.
    pub points: Vec<[f64; 2]>,
    /// Force intensity f or p.
    pub intensity: f64,
    /// Load under the membrane's law: the intensity, or the total force.
    pub load: f64,
    /// Length, area, surface and volume of the discrete curve.
    pub measures: Measures,
    /// What the solve did.
    pub report: NewtonReport,
}

impl Solver {
    /// Discretises `membrane`.
    ///
    /// # Errors
    /// Too few nodes, a stiffness that is not positive, coinciding nodes.
    pub fn new(membrane: &Membrane, discretisation: Discretisation) -> Result<Self, NewtonError> {
        let Discretisation::FiniteDifferences { nodes } = discretisation;
        let differences = FiniteDifferences::new(membrane, nodes).map_err(NewtonError::membrane)?;
        let start = Measures::of(differences.start());
        Ok(Self { differences, start })
    }

    /// Measures of the start: the rest shape with its ends held.
    pub fn start_measures(&self) -> Measures {
        self.start
    }

    /// The start's nodes.
    pub fn start_points(&self) -> Vec<[f64; 2]> {
        self.differences.start().as_chunks::<2>().0.to_vec()
    }

    /// Solves from the start.
    ///
    /// # Errors
    /// A control nothing can be solved for; [`NewtonError::NotConverged`].
    pub fn solve(
        &self,
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Equilibrium, NewtonError> {
        self.solve_state(self.first_state(), control, options)
    }

    /// Solves from a nearby equilibrium of the same solver (warm start).
    ///
    /// # Errors
    /// As [`Solver::solve`].
    ///
    /// # Panics
    /// `near` has another number of nodes.
    pub fn solve_from(
        &self,
        near: &Equilibrium,
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Equilibrium, NewtonError> {
        self.solve_state(near.state(), control, options)
    }

    pub(crate) fn state_len(&self) -> usize {
        self.differences.start().len() + 1
    }

    pub(crate) fn first_state(&self) -> Vec<f64> {
        let mut state = self.differences.start().to_vec();
        state.push(0.0);
        state
    }

    fn solve_state(
        &self,
        mut state: Vec<f64>,
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Equilibrium, NewtonError> {
        let mut system = Bordered::new(self, self.target(control)?);
        let report = newton(&mut system, &mut state, options)?;
        Ok(self.equilibrium(&state, report))
    }

    pub(crate) fn equilibrium(&self, state: &[f64], report: NewtonReport) -> Equilibrium {
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let measures = Measures::of(nodes);
        let load = match self.differences.law() {
            PressureLaw::TotalForce => intensity * measures.surface,
            _ => intensity,
        };
        Equilibrium {
            points: nodes.as_chunks::<2>().0.to_vec(),
            intensity,
            load,
            measures,
            report,
        }
    }

    /// The equation that a control adds.
    pub(crate) fn target(&self, control: Control) -> Result<Target, NewtonError> {
        let check = |quantity, value: f64, above: f64| {
            if value.is_finite() && value > above {
                Ok(value)
            } else {
                Err(NewtonError::OutOfRange {
                    quantity,
                    value,
                    above,
                })
            }
        };
        let any = f64::NEG_INFINITY;
        Ok(match control {
            Control::Load(value) if self.differences.law() == PressureLaw::TotalForce => {
                Target::TotalForce(check("load", value, any)?)
            }
            Control::Load(value) => Target::Intensity(check("load", value, any)?),
            Control::Intensity(value) => Target::Intensity(check("intensity", value, any)?),
            Control::TotalForce(value) => Target::TotalForce(check("total force", value, any)?),
            Control::Volume(value) => {
                Target::Measure(Measure::Volume, check("volume", value, 0.0)?)
            }
            Control::VolumeGain(value) => Target::Measure(
                Measure::Volume,
                self.start.volume * (1.0 + check("volume gain", value, -1.0)?),
            ),
            Control::Area(value) => Target::Measure(Measure::Area, check("area", value, any)?),
        })
    }
}

impl Equilibrium {
    pub(crate) fn state(&self) -> Vec<f64> {
        let mut state = self.points.as_flattened().to_vec();
        state.push(self.intensity);
        state
    }
}

/// The border equation g(c, f) = 0.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Target {
    Intensity(f64),
    TotalForce(f64),
    Measure(Measure, f64),
}

/// [ K  b ; g_c  g_f ] for the unknowns (c, f), solved by block elimination.
pub(crate) struct Bordered<'a> {
    solver: &'a Solver,
    pub(crate) target: Target,
    band: BandMatrix,
    lu: BandedLu,
    elastic: Vec<f64>,
    /// K^-1 dF/df
    column: Vec<f64>,
    /// dg/dc
    pub(crate) row: Vec<f64>,
    corner: f64,
}

impl<'a> Bordered<'a> {
    pub(crate) fn new(solver: &'a Solver, target: Target) -> Self {
        let band = solver.differences.band();
        let n = band.len();
        Self {
            solver,
            target,
            lu: BandedLu::for_matrix(&band),
            band,
            elastic: vec![0.0; n],
            column: vec![0.0; n],
            row: vec![0.0; n],
            corner: 0.0,
        }
    }

    pub(crate) fn volume(&self, nodes: &[f64]) -> f64 {
        Measure::Volume.of(nodes)
    }

    pub(crate) fn volume_gradient_into(&self, nodes: &[f64], out: &mut [f64]) {
        Measure::Volume.gradient_into(nodes, out);
    }

    fn length_scale(&self) -> f64 {
        self.solver.start.length
    }

    fn force_scale(&self) -> f64 {
        self.solver.differences.stiffness_scale() * self.length_scale()
    }

    /// The border equation over its own scale, so that all equations count alike.
    fn target_scale(&self) -> f64 {
        let l = self.length_scale();
        match self.target {
            Target::Intensity(_) => self.force_scale(),
            Target::TotalForce(_) => self.force_scale() * l * l,
            Target::Measure(Measure::Area, _) => l * l,
            Target::Measure(_, _) => l * l * l,
        }
    }
}

impl ResidualSystem for Bordered<'_> {
    fn len(&self) -> usize {
        self.band.len() + 1
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        let n = self.band.len();
        let (nodes, f) = (&x[..n], x[n]);
        let d = &self.solver.differences;
        d.elastic_force_into(nodes, &mut self.elastic);
        d.pressure_force_into(nodes, f, &mut out[..n])
            .map_err(NewtonError::membrane)?;
        for (out, elastic) in out[..n].iter_mut().zip(&self.elastic) {
            *out += elastic;
        }
        out[n] = match self.target {
            Target::Intensity(value) => f - value,
            Target::TotalForce(value) => f * Measure::Surface.of(nodes) - value,
            Target::Measure(measure, value) => measure.of(nodes) - value,
        };
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let n = self.band.len();
        let (nodes, f) = (&x[..n], x[n]);
        let d = &self.solver.differences;
        self.band.clear();
        d.add_elastic_tangent(1.0, &mut self.band);
        d.add_pressure_tangent(nodes, f, 1.0, &mut self.band)
            .map_err(NewtonError::membrane)?;
        for k in [0, 1, n - 2, n - 1] {
            self.band.add(k, k, 1.0);
        }
        self.lu.factor(&self.band)?;
        d.pressure_force_into(nodes, 1.0, &mut self.column)
            .map_err(NewtonError::membrane)?;
        self.lu.solve_in_place(&mut self.column);
        self.corner = match self.target {
            Target::Intensity(_) => {
                self.row.fill(0.0);
                1.0
            }
            Target::TotalForce(_) => {
                Measure::Surface.gradient_into(nodes, &mut self.row);
                self.row.iter_mut().for_each(|g| *g *= f);
                Measure::Surface.of(nodes)
            }
            Target::Measure(measure, _) => {
                measure.gradient_into(nodes, &mut self.row);
                0.0
            }
        };
        let pivot = self.corner - dot(&self.row, &self.column);
        if pivot == 0.0 || !pivot.is_finite() {
            return Err(NewtonError::Singular { row: n, pivot });
        }
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) {
        let n = self.band.len();
        let (head, tail) = rhs.split_at_mut(n);
        self.lu.solve_in_place(head);
        let df = (tail[0] - dot(&self.row, head)) / (self.corner - dot(&self.row, &self.column));
        for (x, column) in head.iter_mut().zip(&self.column) {
            *x -= df * column;
        }
        tail[0] = df;
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        let n = self.band.len();
        let forces = residual[..n]
            .as_chunks::<2>()
            .0
            .iter()
            .map(|r| r[0].hypot(r[1]))
            .fold(0.0, nan_max);
        nan_max(
            forces / self.force_scale(),
            residual[n].abs() / self.target_scale(),
        )
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        let n = self.band.len();
        step[..n].iter().fold(0.0, |m, v| nan_max(m, v.abs())) / self.length_scale()
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The larger of the two, NaN if either is.
pub(crate) fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}
