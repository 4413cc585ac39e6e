//! A membrane ready to be solved under any control.

use std::sync::Arc;

use membrane_forces::{FiniteDifferences, Measures, Membrane, PressureLaw, SpectralElements};

use crate::bordered::Bordered;
use crate::continuation;
use crate::control::{Control, Target};
use crate::discrete::Discrete;
use crate::equilibrium::Equilibrium;
use crate::error::NewtonError;
use crate::options::{NewtonOptions, NewtonReport};

/// How the curve is discretised.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Discretisation {
    /// The paper's second-order finite differences with this many nodes.
    FiniteDifferences {
        /// Nodes N, held ends included.
        nodes: usize,
    },
    /// Spectral elements: polynomials of this degree, this many elements on each smooth piece.
    Spectral {
        /// Degree p of the polynomials.
        degree: usize,
        /// Elements on each smooth piece.
        per_piece: usize,
    },
}

/// A discretised membrane: immutable, cheap to clone, shared by threads.
///
/// ```
/// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, RestShape, Solver};
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
/// let solver = Solver::new(&membrane, Discretisation::Spectral { degree: 16, per_piece: 1 })?;
/// let dilated = solver.solve(Control::VolumeGain(0.6), &NewtonOptions::default())?;
/// assert!((dilated.intensity - 17.48357527761).abs() < 1e-10);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solver {
    pub(crate) inner: Arc<Inner>,
}

#[derive(Debug)]
pub(crate) struct Inner {
    pub(crate) membrane: Membrane,
    pub(crate) discrete: Discrete,
    pub(crate) start: Measures,
}

impl Solver {
    /// Discretises `membrane`.
    ///
    /// # Errors
    /// Too few nodes or too low a degree, a stiffness that is not positive, coinciding nodes.
    pub fn new(membrane: &Membrane, discretisation: Discretisation) -> Result<Self, NewtonError> {
        let discrete = match discretisation {
            Discretisation::FiniteDifferences { nodes } => {
                FiniteDifferences::new(membrane, nodes).map(Discrete::Differences)
            }
            Discretisation::Spectral { degree, per_piece } => {
                SpectralElements::new(membrane, degree, per_piece).map(Discrete::Spectral)
            }
        }
        .map_err(NewtonError::membrane)?;
        let start = discrete.measures(discrete.start());
        Ok(Self {
            inner: Arc::new(Inner {
                membrane: membrane.clone(),
                discrete,
                start,
            }),
        })
    }

    /// Measures of the start: the rest shape with its ends held.
    pub fn start_measures(&self) -> Measures {
        self.inner.start
    }

    /// The start as an equilibrium without load (it is one if the ends are held where they rest).
    pub fn start(&self) -> Equilibrium {
        self.equilibrium(self.start_state(), NewtonReport::default())
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
        self.solve_state(self.start_state(), control, options)
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
        self.solve_state(near.state.clone(), control, options)
    }

    fn solve_state(
        &self,
        mut state: Vec<f64>,
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Equilibrium, NewtonError> {
        let target = self.target(control)?;
        let mut system = self.system(target);
        let from = system.target_value(&state);
        let set = |system: &mut Bordered<'_>, value| system.target = target.with_value(value);
        let report = continuation::solve(
            &mut system,
            &mut state,
            (from, target.value()),
            set,
            options,
        )?;
        Ok(self.equilibrium(state, report))
    }

    pub(crate) fn target(&self, control: Control) -> Result<Target, NewtonError> {
        Target::new(control, &self.inner.discrete, &self.inner.start)
    }

    pub(crate) fn system(&self, target: Target) -> Bordered<'_> {
        Bordered::new(&self.inner.discrete, self.inner.start.length, target)
    }

    /// Nodes, then the force intensity.
    pub(crate) fn start_state(&self) -> Vec<f64> {
        let mut state = self.inner.discrete.start().to_vec();
        state.push(0.0);
        state
    }

    pub(crate) fn equilibrium(&self, state: Vec<f64>, report: NewtonReport) -> Equilibrium {
        let discrete = &self.inner.discrete;
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let measures = discrete.measures(nodes);
        let load = match discrete.law() {
            PressureLaw::TotalForce => intensity * measures.surface,
            _ => intensity,
        };
        Equilibrium {
            intensity,
            load,
            measures,
            report,
            inner: self.inner.clone(),
            state,
        }
    }
}
