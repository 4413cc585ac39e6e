//! `heart_phantom.membrane`: membranes in equilibrium.

use crate::arrays::{Given, array, numbers, of, points};
use crate::equilibrium::{PyEquilibrium, report};
use crate::errors::Failure;
use crate::recipe::{Recipe, Reduced};
use crate::values::{Whole, named};
use crate::work::work;
use heart_phantom::membrane_forces::{self, Profile, Quantity};
use heart_phantom::membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, Pair, PairEquilibrium, PressureLaw,
    ReferenceShape, Rubber, Solver,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// An elastic membrane of springs or rubber: reference configuration, material, pressure law.
///
/// Examples
/// --------
/// >>> from heart_phantom.membrane import Membrane
/// >>> balloon = Membrane.balloon(8.5, 1.75)
/// >>> round(balloon.solve(volume_gain=0.6).intensity, 9)
/// 17.483575278
#[pyclass(name = "Membrane", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyMembrane {
    membrane: Membrane,
    recipe: Recipe,
}

/// Arguments of a material.
struct Material<'a, 'py> {
    stiffness: Option<&'a Bound<'py, PyAny>>,
    law: Option<&'a Bound<'py, PyAny>>,
    rubber: Option<&'a Bound<'py, PyAny>>,
    thickness: Option<&'a Bound<'py, PyAny>>,
}

impl Material<'_, '_> {
    /// Makes a membrane; `name` and `arguments` are those of its constructor.
    fn of<'py>(
        &self,
        py: Python<'py>,
        rest: ReferenceShape,
        name: &str,
        arguments: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>,
    ) -> Result<PyMembrane, Failure> {
        let options = PyDict::new(py);
        for (name, value) in [
            ("stiffness", self.stiffness),
            ("law", self.law),
            ("rubber", self.rubber),
            ("thickness", self.thickness),
        ] {
            options.set_item(name, value)?;
        }
        let own = py.get_type::<PyMembrane>().getattr(name)?;
        let recipe = Recipe::new(py, &own, arguments)?.with_options(&options)?;
        let membrane = Membrane::new(rest);
        let made = match self.rubber {
            None => {
                only_with("thickness", self.thickness, "rubber")?;
                let stiffness = profile("stiffness", self.stiffness)?;
                membrane.with_stiffness(stiffness)
            }
            Some(rubber) => {
                only_with("stiffness", self.stiffness, "springs")?;
                let thickness = profile("thickness", self.thickness)?;
                membrane.with_rubber(Rubber::new(named("rubber", rubber)?, thickness)?)
            }
        };
        let membrane = match self.law {
            None => made,
            Some(law) => made.with_law(named::<PressureLaw>("law", law)?),
        };
        Ok(PyMembrane { membrane, recipe })
    }
}

fn only_with(what: &str, given: Option<&Bound<'_, PyAny>>, of: &str) -> PyResult<()> {
    given.map_or(Ok(()), |_| {
        let text = format!("{what} is given, which only {of} has");
        Err(PyValueError::new_err(text))
    })
}

/// A number, or samples from one end to the other.
fn profile<Q: Quantity>(
    what: &str,
    given: Option<&Bound<'_, PyAny>>,
) -> Result<Profile<Q>, Failure> {
    let Some(given) = given else {
        return Ok(Profile::UNIT);
    };
    let Given { samples, shape } = of::<f64>(what, given)?;
    Ok(match (shape.len(), &samples[..]) {
        (0, &[one]) => Profile::constant(one)?,
        _ => Profile::samples(&numbers(what, given)?)?,
    })
}

#[pymethods]
impl PyMembrane {
    /// Returns the paper's balloon: a cylinder closed by a hemisphere.
    ///
    /// Parameters
    /// ----------
    /// h : float
    ///     Total length in cm.
    /// radius : float
    ///     Radius in cm.
    /// stiffness : float or array_like, optional
    ///     Of springs: a number, or samples from one end to the other; by default 1.
    /// law : {"per-material-length", "total-force", "per-current-length"}, optional
    ///     The load of springs.
    /// rubber : dict, optional
    ///     `{"neo_hookean": {"mu": 400.0}}`, `{"mooney_rivlin": {"c1": 1.0, "c2": 0.1}}`, `{"ogden": {"terms": [[mu, alpha], ...]}}` or
    ///     `{"gent": {"mu": 1.0, "jm": 30.0}}`, moduli in kPa; by default springs. The load of rubber is a pressure.
    /// thickness : float or array_like, optional
    ///     Thickness of rubber in the reference configuration in cm, as `stiffness`.
    ///
    /// Returns
    /// -------
    /// Membrane
    ///
    /// Raises
    /// ------
    /// MembraneError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (h, radius, *, stiffness = None, law = None, rubber = None, thickness = None))]
    fn balloon(
        py: Python<'_>,
        h: f64,
        radius: f64,
        stiffness: Option<&Bound<'_, PyAny>>,
        law: Option<&Bound<'_, PyAny>>,
        rubber: Option<&Bound<'_, PyAny>>,
        thickness: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let material = Material {
            stiffness,
            law,
            rubber,
            thickness,
        };
        material.of(
            py,
            ReferenceShape::balloon(h, radius)?,
            "balloon",
            (h, radius),
        )
    }

    /// Returns a flat disc, fixed at its edge.
    ///
    /// Parameters
    /// ----------
    /// radius : float
    ///     Radius in cm.
    /// stiffness, law, rubber, thickness
    ///     As in `balloon`.
    ///
    /// Returns
    /// -------
    /// Membrane
    ///
    /// Raises
    /// ------
    /// MembraneError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (radius, *, stiffness = None, law = None, rubber = None, thickness = None))]
    fn disc(
        py: Python<'_>,
        radius: f64,
        stiffness: Option<&Bound<'_, PyAny>>,
        law: Option<&Bound<'_, PyAny>>,
        rubber: Option<&Bound<'_, PyAny>>,
        thickness: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let material = Material {
            stiffness,
            law,
            rubber,
            thickness,
        };
        material.of(py, ReferenceShape::disc(radius)?, "disc", (radius,))
    }

    /// Returns a membrane through given points.
    ///
    /// Parameters
    /// ----------
    /// curve : array_like
    ///     Points [x, y] from one fixed end over the apex to the other, `[n][2]`, in cm.
    /// stiffness, law, rubber, thickness
    ///     As in `balloon`.
    ///
    /// Returns
    /// -------
    /// Membrane
    ///
    /// Raises
    /// ------
    /// MembraneError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (curve, *, stiffness = None, law = None, rubber = None, thickness = None))]
    fn polyline(
        curve: &Bound<'_, PyAny>,
        stiffness: Option<&Bound<'_, PyAny>>,
        law: Option<&Bound<'_, PyAny>>,
        rubber: Option<&Bound<'_, PyAny>>,
        thickness: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let material = Material {
            stiffness,
            law,
            rubber,
            thickness,
        };
        let py = curve.py();
        let points = points::<2>("curve", curve)?;
        let given = array(py, points.as_flattened().to_vec(), &[points.len(), 2])?;
        material.of(py, ReferenceShape::polyline(&points)?, "polyline", (given,))
    }

    /// Solves the equilibrium at one prescribed quantity.
    ///
    /// Parameters
    /// ----------
    /// load : float, optional
    ///     Load of the pressure law.
    /// intensity : float, optional
    ///     Force per length of the curve.
    /// total_force : float, optional
    ///     Total force.
    /// volume : float, optional
    ///     Volume in cm^3.
    /// volume_gain : float, optional
    ///     (V - V0) / V0.
    /// area : float, optional
    ///     Area within the curve in cm^2.
    /// tolerance : float
    ///     Accuracy of spectral elements.
    /// degree : int, optional
    ///     Fixed polynomial degree of spectral elements.
    /// nodes : int, optional
    ///     Number of nodes of finite differences, instead of spectral elements.
    ///
    /// Returns
    /// -------
    /// Equilibrium
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Unless exactly one quantity is given.
    /// MembraneError
    ///     If there is no equilibrium at the quantity.
    #[pyo3(signature = (*, load = None, intensity = None, total_force = None, volume = None, volume_gain = None, area = None, tolerance = 1e-12, degree = None, nodes = None))]
    #[expect(clippy::too_many_arguments, reason = "one of them is given")]
    fn solve(
        slf: &Bound<'_, Self>,
        load: Option<f64>,
        intensity: Option<f64>,
        total_force: Option<f64>,
        volume: Option<f64>,
        volume_gain: Option<f64>,
        area: Option<f64>,
        tolerance: f64,
        degree: Option<Whole>,
        nodes: Option<Whole>,
    ) -> Result<PyEquilibrium, Failure> {
        let control = one_of([
            load.map(Control::Load),
            intensity.map(Control::Intensity),
            total_force.map(Control::TotalForce),
            volume.map(Control::Volume),
            volume_gain.map(Control::VolumeGain),
            area.map(Control::Area),
        ])?;
        let py = slf.py();
        let by = discretisation(tolerance, degree, nodes)?;
        let options = PyDict::new(py);
        for (name, value) in [
            ("load", load),
            ("intensity", intensity),
            ("total_force", total_force),
            ("volume", volume),
            ("volume_gain", volume_gain),
            ("area", area),
        ] {
            options.set_item(name, value)?;
        }
        set_discretisation(&options, tolerance, degree, nodes)?;
        let recipe = Recipe::new(py, &slf.getattr("solve")?, ())?.with_options(&options)?;
        let membrane = slf.get().membrane.clone();
        let solved = work(py, None, move |_| {
            Solver::new(&membrane, by)?.solve(control, &NewtonOptions::default())
        })?;
        Ok(PyEquilibrium::with_recipe(solved, recipe))
    }

    fn __repr__(&self) -> String {
        let rest = self.membrane.reference().at(0.5).position[0];
        let made_of = match self.membrane.material() {
            membrane_forces::Material::Springs { .. } => "springs",
            membrane_forces::Material::Rubber(_) => "rubber",
        };
        format!("<Membrane: of {made_of}, apex at {rest} cm in the reference configuration>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

fn one_of<const N: usize>(given: [Option<Control>; N]) -> PyResult<Control> {
    let mut all = given.into_iter().flatten();
    match (all.next(), all.next()) {
        (Some(control), None) => Ok(control),
        (one, _) => {
            let count = one.map_or("none is", |_| "several are");
            let text = format!(
                "one of load, intensity, total_force, volume, volume_gain, area is needed, {count} given"
            );
            Err(PyValueError::new_err(text))
        }
    }
}

fn set_discretisation(
    options: &Bound<'_, PyDict>,
    tolerance: f64,
    degree: Option<Whole>,
    nodes: Option<Whole>,
) -> PyResult<()> {
    options.set_item("tolerance", tolerance)?;
    options.set_item("degree", degree.map(|n| n.0))?;
    options.set_item("nodes", nodes.map(|n| n.0))
}

fn discretisation(
    tolerance: f64,
    degree: Option<Whole>,
    nodes: Option<Whole>,
) -> PyResult<Discretisation> {
    match (degree, nodes) {
        (None, None) => Ok(Discretisation::SpectralAdaptive { tolerance }),
        (Some(Whole(degree)), None) => Ok(Discretisation::Spectral {
            degree,
            per_piece: 1,
        }),
        (None, Some(Whole(nodes))) => Ok(Discretisation::FiniteDifferences { nodes }),
        (Some(_), Some(_)) => {
            let text =
                "degree is of spectral elements, nodes of finite differences; give one of them";
            Err(PyValueError::new_err(text))
        }
    }
}

/// Two membranes in equilibrium with a wall of constant volume between them.
#[pyclass(name = "PairEquilibrium", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyPairEquilibrium {
    pair: PairEquilibrium,
    recipe: Recipe,
}

#[pymethods]
impl PyPairEquilibrium {
    /// The inner membrane.
    #[getter]
    fn inner(slf: &Bound<'_, Self>) -> PyResult<PyEquilibrium> {
        let recipe = Recipe::property(slf.as_any(), "inner")?;
        Ok(PyEquilibrium::with_recipe(
            slf.get().pair.inner.clone(),
            recipe,
        ))
    }

    /// The outer membrane.
    #[getter]
    fn outer(slf: &Bound<'_, Self>) -> PyResult<PyEquilibrium> {
        let recipe = Recipe::property(slf.as_any(), "outer")?;
        Ok(PyEquilibrium::with_recipe(
            slf.get().pair.outer.clone(),
            recipe,
        ))
    }

    /// Volume between them, cm^3.
    #[getter]
    fn wall_volume(&self) -> f64 {
        self.pair.wall_volume
    }

    /// Relative error of the volume of the wall.
    #[getter]
    fn wall_volume_error(&self) -> f64 {
        self.pair.wall_volume_error
    }

    /// Returns the report of the solve of both membranes, as `Equilibrium.report`.
    ///
    /// Returns
    /// -------
    /// dict
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        report(py, &self.pair.report)
    }

    fn __repr__(&self) -> String {
        let (inner, wall) = (self.pair.inner.measures.volume, self.pair.wall_volume);
        format!("<PairEquilibrium: cavity {inner:.6} cm^3, wall {wall:.6} cm^3>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

/// Solves two membranes with a wall of constant volume between them.
///
/// Parameters
/// ----------
/// inner, outer : Membrane
///     The membranes.
/// volume_gain : float
///     (V - V0) / V0 of the inner membrane.
/// tolerance : float
///     Accuracy of spectral elements.
/// degree : int, optional
///     Fixed polynomial degree of spectral elements.
/// nodes : int, optional
///     Number of nodes of finite differences, instead of spectral elements.
///
/// Returns
/// -------
/// PairEquilibrium
///
/// Raises
/// ------
/// MembraneError
///     If there is no equilibrium at the gain.
///
/// Examples
/// --------
/// >>> from heart_phantom.membrane import Membrane, solve_pair
/// >>> pair = solve_pair(Membrane.balloon(8.5, 1.75), Membrane.balloon(9.5, 2.75), 0.6)
/// >>> abs(pair.wall_volume_error) < 1e-12
/// True
#[pyfunction]
#[pyo3(signature = (inner, outer, volume_gain, *, tolerance = 1e-12, degree = None, nodes = None))]
pub(crate) fn solve_pair(
    py: Python<'_>,
    inner: &Bound<'_, PyMembrane>,
    outer: &Bound<'_, PyMembrane>,
    volume_gain: f64,
    tolerance: f64,
    degree: Option<Whole>,
    nodes: Option<Whole>,
) -> Result<PyPairEquilibrium, Failure> {
    let by = discretisation(tolerance, degree, nodes)?;
    let options = PyDict::new(py);
    set_discretisation(&options, tolerance, degree, nodes)?;
    let own = py.import("heart_phantom.membrane")?.getattr("solve_pair")?;
    let recipe = Recipe::new(py, &own, (inner, outer, volume_gain))?.with_options(&options)?;
    let (inner, outer) = (inner.get().membrane.clone(), outer.get().membrane.clone());
    let solved = work(py, None, move |_| {
        let pair = Pair::new(Solver::new(&inner, by)?, Solver::new(&outer, by)?)?;
        pair.solve_gain(volume_gain, &NewtonOptions::default())
    })?;
    Ok(PyPairEquilibrium {
        pair: solved,
        recipe,
    })
}
