//! Membranes in equilibrium.

use crate::arrays::{array, numbers};
use crate::errors::Failure;
use crate::recipe::{Recipe, Reduced};
use heart_phantom::membrane_newton::{Equilibrium, MembraneError, NewtonReport, RubberState};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Doubles<'py> = Result<Bound<'py, PyArrayDyn<f64>>, Failure>;

/// A membrane in equilibrium.
#[pyclass(name = "Equilibrium", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyEquilibrium {
    equilibrium: Equilibrium,
    recipe: Recipe,
}

impl PyEquilibrium {
    pub(crate) fn with_recipe(equilibrium: Equilibrium, recipe: Recipe) -> Self {
        Self {
            equilibrium,
            recipe,
        }
    }
}

#[pymethods]
impl PyEquilibrium {
    /// Force intensity: force per length of the curve, as defined by the law.
    #[getter]
    fn intensity(&self) -> f64 {
        self.equilibrium.intensity
    }

    /// Load under the membrane's law: the intensity, or the total force.
    #[getter]
    fn load(&self) -> f64 {
        self.equilibrium.load
    }

    /// Pressure across the membrane, force per current area, in the unit of the stiffness or of the moduli.
    #[getter]
    fn pressure(&self) -> f64 {
        self.equilibrium.pressure()
    }

    /// Length of the curve, cm.
    #[getter]
    fn length(&self) -> f64 {
        self.equilibrium.measures.length
    }

    /// Area within the curve, cm^2.
    #[getter]
    fn area(&self) -> f64 {
        self.equilibrium.measures.area
    }

    /// Lateral surface of revolution, cm^2.
    #[getter]
    fn surface(&self) -> f64 {
        self.equilibrium.measures.surface
    }

    /// Volume of revolution, cm^3.
    #[getter]
    fn volume(&self) -> f64 {
        self.equilibrium.measures.volume
    }

    /// Nodes [x, y] of the discretisation, from one end to the other: `float64[n][2]`.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let nodes = self.equilibrium.points();
        array(py, nodes.as_flattened().to_vec(), &[nodes.len(), 2])
    }

    /// Material coordinates of `points`, from 0 to 1: `float64[n]`.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let positions = self.equilibrium.positions();
        let n = positions.len();
        array(py, positions, &[n])
    }

    /// Evaluates the curve with the accuracy of the solve.
    ///
    /// Parameters
    /// ----------
    /// s : array_like
    ///     Material coordinates, 0 to 1.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Points [x, y], `float64[n][2]`, cm.
    ///
    /// Raises
    /// ------
    /// MembraneError
    ///     If a coordinate is not finite.
    fn at<'py>(&self, py: Python<'py>, s: &Bound<'py, PyAny>) -> Doubles<'py> {
        let s = finite(numbers("s", s)?)?;
        let flat = s
            .iter()
            .flat_map(|&s| self.equilibrium.at(s).position)
            .collect();
        array(py, flat, &[s.len(), 2])
    }

    /// Evaluates the state of rubber.
    ///
    /// Parameters
    /// ----------
    /// s : array_like
    ///     Material coordinates, 0 to 1.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `stretches` `float64[n][3]`: meridional, hoop, thickness; `tensions` `float64[n][2]` in kPa cm and `stresses` `float64[n][2]` in kPa:
    ///     meridional, hoop.
    ///
    /// Raises
    /// ------
    /// MembraneError
    ///     If a coordinate is not finite, or the membrane is not of rubber.
    fn rubber_state<'py>(
        &self,
        py: Python<'py>,
        s: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyDict>, Failure> {
        let s = finite(numbers("s", s)?)?;
        let n = s.len();
        let all = s.into_iter().map(|s| self.equilibrium.rubber_state(s));
        let all = all.collect::<Result<Vec<RubberState>, _>>()?;
        let made = PyDict::new(py);
        let stretches: Vec<f64> = all.iter().flat_map(|at| at.stretches).collect();
        made.set_item("stretches", array(py, stretches, &[n, 3])?)?;
        let tensions: Vec<f64> = all.iter().flat_map(|at| at.tensions).collect();
        made.set_item("tensions", array(py, tensions, &[n, 2])?)?;
        let stresses: Vec<f64> = all.iter().flat_map(|at| at.stresses).collect();
        made.set_item("stresses", array(py, stresses, &[n, 2])?)?;
        Ok(made)
    }

    /// Returns the report of the solve.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Counts, the scaled residual, and its `history`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        report(py, &self.equilibrium.report)
    }

    fn __repr__(&self) -> String {
        let (intensity, volume) = (self.equilibrium.intensity, self.equilibrium.measures.volume);
        format!("<Equilibrium: intensity {intensity:.6}, volume {volume:.6} cm^3>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

fn finite(s: Vec<f64>) -> Result<Vec<f64>, MembraneError> {
    for &given in &s {
        MembraneError::within("s", given, f64::MIN, f64::MAX)?;
    }
    Ok(s)
}

pub(crate) fn report<'py>(py: Python<'py>, of: &NewtonReport) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    made.set_item("iterations", of.iterations)?;
    made.set_item("factorisations", of.factorisations)?;
    made.set_item("residual_calls", of.residual_calls)?;
    made.set_item("load_steps", of.load_steps)?;
    made.set_item("residual", of.residual)?;
    made.set_item("step", of.step)?;
    made.set_item("iteration_error", of.iteration_error)?;
    made.set_item("history", &of.history)?;
    Ok(made)
}
