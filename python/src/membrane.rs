//! `heart_phantom.membrane`: membranes in equilibrium.

use crate::arrays::{Given, array, numbers, of, points};
use crate::errors::Failure;
use crate::values::{Whole, named};
use crate::work::work;
use heart_phantom::membrane_forces::{Profile, Quantity};
use heart_phantom::membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, MembraneError, NewtonOptions, NewtonReport,
    Pair, PairEquilibrium, PressureLaw, ReferenceShape, Rubber, RubberState, Solver,
};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Doubles<'py> = Result<Bound<'py, PyArrayDyn<f64>>, Failure>;

/// An elastic membrane: reference configuration, material, pressure law.
///
/// Springs have a `stiffness`, a number or samples from one end to the other, and a `law`: `"per-material-length"`, `"total-force"` or
/// `"per-current-length"`. `rubber` is `{"neo_hookean": {"mu": 400.0}}`, `{"mooney_rivlin": {"c1": 1.0, "c2": 0.1}}`,
/// `{"ogden": {"terms": [[mu, alpha], ...]}}` or `{"gent": {"mu": 1.0, "jm": 30.0}}`, moduli in kPa, with the reference `thickness` in cm;
/// its load is a pressure.
///
/// >>> from heart_phantom.membrane import Membrane
/// >>> balloon = Membrane.balloon(8.5, 1.75)
/// >>> round(balloon.solve(volume_gain=0.6).intensity, 9)
/// 17.483575278
#[pyclass(name = "Membrane", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyMembrane(Membrane);

/// Arguments of a material.
struct Material<'a, 'py> {
    stiffness: Option<&'a Bound<'py, PyAny>>,
    law: Option<&'a Bound<'py, PyAny>>,
    rubber: Option<&'a Bound<'py, PyAny>>,
    thickness: Option<&'a Bound<'py, PyAny>>,
}

impl Material<'_, '_> {
    fn of(&self, rest: ReferenceShape) -> Result<PyMembrane, Failure> {
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
        Ok(PyMembrane(match self.law {
            None => made,
            Some(law) => made.with_law(named::<PressureLaw>("law", law)?),
        }))
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
    /// A cylinder of `radius` closed by a hemisphere, of total length `h`: the paper's balloon.
    #[staticmethod]
    #[pyo3(signature = (h, radius, *, stiffness = None, law = None, rubber = None, thickness = None))]
    fn balloon(
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
        material.of(ReferenceShape::balloon(h, radius)?)
    }

    /// A flat disc, fixed at its edge.
    #[staticmethod]
    #[pyo3(signature = (radius, *, stiffness = None, law = None, rubber = None, thickness = None))]
    fn disc(
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
        material.of(ReferenceShape::disc(radius)?)
    }

    /// Points [x, y] from one fixed end over the apex to the other, `[n][2]`.
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
        material.of(ReferenceShape::polyline(&points::<2>("curve", curve)?)?)
    }

    /// The equilibrium at one prescribed quantity: `load` of the law, force `intensity`, `total_force`, `volume` (cm^3), `volume_gain`, (V
    /// - V0) / V0, or `area` (cm^2).
    ///
    /// Uses spectral elements to `tolerance` or of a fixed polynomial `degree`, or finite differences with a number of `nodes`.
    #[pyo3(signature = (*, load = None, intensity = None, total_force = None, volume = None, volume_gain = None, area = None, tolerance = 1e-12, degree = None, nodes = None))]
    #[expect(clippy::too_many_arguments, reason = "one of them is given")]
    fn solve(
        &self,
        py: Python<'_>,
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
        let (membrane, by) = (self.0.clone(), discretisation(tolerance, degree, nodes)?);
        let solved = work(py, move |_| {
            Solver::new(&membrane, by)?.solve(control, &NewtonOptions::default())
        })?;
        Ok(PyEquilibrium(solved))
    }

    fn __repr__(&self) -> String {
        let rest = self.0.reference().at(0.5).position[0];
        let made_of = match self.0.stiffness() {
            Some(_) => "springs",
            None => "rubber",
        };
        format!("<Membrane: of {made_of}, apex at {rest} cm at rest>")
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

/// A membrane in equilibrium.
#[pyclass(name = "Equilibrium", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyEquilibrium(pub(crate) Equilibrium);

#[pymethods]
impl PyEquilibrium {
    /// Force intensity: force per length of the curve, as defined by the law.
    #[getter]
    fn intensity(&self) -> f64 {
        self.0.intensity
    }

    /// Load under the membrane's law: the intensity, or the total force.
    #[getter]
    fn load(&self) -> f64 {
        self.0.load
    }

    /// Pressure across the membrane, force per current area, in the unit of the stiffness or of the moduli.
    #[getter]
    fn pressure(&self) -> f64 {
        self.0.pressure()
    }

    /// Length of the curve, cm.
    #[getter]
    fn length(&self) -> f64 {
        self.0.measures.length
    }

    /// Area within the curve, cm^2.
    #[getter]
    fn area(&self) -> f64 {
        self.0.measures.area
    }

    /// Lateral surface of revolution, cm^2.
    #[getter]
    fn surface(&self) -> f64 {
        self.0.measures.surface
    }

    /// Volume of revolution, cm^3.
    #[getter]
    fn volume(&self) -> f64 {
        self.0.measures.volume
    }

    /// Nodes [x, y] of the discretisation, from one end to the other: `float64[n][2]`.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let nodes = self.0.points();
        array(py, nodes.as_flattened().to_vec(), &[nodes.len(), 2])
    }

    /// Material coordinates of `points`, from 0 to 1: `float64[n]`.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let positions = self.0.positions();
        let n = positions.len();
        array(py, positions, &[n])
    }

    /// The curve [x, y] at material coordinates from 0 to 1, `float64[n][2]`, with the accuracy of the solve.
    fn at<'py>(&self, py: Python<'py>, s: &Bound<'py, PyAny>) -> Doubles<'py> {
        let s = finite(numbers("s", s)?)?;
        let flat = s.iter().flat_map(|&s| self.0.at(s).position).collect();
        array(py, flat, &[s.len(), 2])
    }

    /// State of rubber at material coordinates from 0 to 1: a dictionary of `stretches` `float64[n][3]` (meridional, hoop, thickness), and
    /// `tensions` `float64[n][2]` (kPa cm) and `stresses` `float64[n][2]` (kPa), meridional and hoop.
    fn rubber_state<'py>(
        &self,
        py: Python<'py>,
        s: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyDict>, Failure> {
        let s = finite(numbers("s", s)?)?;
        let n = s.len();
        let all = s.into_iter().map(|s| self.0.rubber_state(s));
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

    /// Report of the solve: a dictionary of counts, the scaled residual, and its `history`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        report(py, &self.0.report)
    }

    fn __repr__(&self) -> String {
        let (intensity, volume) = (self.0.intensity, self.0.measures.volume);
        format!("<Equilibrium: intensity {intensity:.6}, volume {volume:.6} cm^3>")
    }
}

fn finite(s: Vec<f64>) -> Result<Vec<f64>, MembraneError> {
    match s.iter().find(|s| !s.is_finite()) {
        Some(&given) => Err(MembraneError::NotFinite { what: "s", given }),
        None => Ok(s),
    }
}

fn report<'py>(py: Python<'py>, of: &NewtonReport) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    made.set_item("iterations", of.iterations)?;
    made.set_item("factorisations", of.factorisations)?;
    made.set_item("residual_calls", of.residual_calls)?;
    made.set_item("load_steps", of.load_steps)?;
    made.set_item("residual", of.residual)?;
    made.set_item("step", of.step)?;
    made.set_item("error", of.error)?;
    made.set_item("history", &of.history)?;
    Ok(made)
}

/// Two membranes in equilibrium with a wall of constant volume between them.
#[pyclass(name = "PairEquilibrium", module = "heart_phantom.membrane", frozen)]
#[derive(Debug)]
pub(crate) struct PyPairEquilibrium(PairEquilibrium);

#[pymethods]
impl PyPairEquilibrium {
    /// The inner membrane.
    #[getter]
    fn inner(&self) -> PyEquilibrium {
        PyEquilibrium(self.0.inner.clone())
    }

    /// The outer membrane.
    #[getter]
    fn outer(&self) -> PyEquilibrium {
        PyEquilibrium(self.0.outer.clone())
    }

    /// Volume between them, cm^3.
    #[getter]
    fn wall_volume(&self) -> f64 {
        self.0.wall_volume
    }

    /// Relative error of the volume of the wall.
    #[getter]
    fn wall_volume_error(&self) -> f64 {
        self.0.wall_volume_error
    }

    /// Report of the solve of both membranes: a dictionary.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        report(py, &self.0.report)
    }

    fn __repr__(&self) -> String {
        let (inner, wall) = (self.0.inner.measures.volume, self.0.wall_volume);
        format!("<PairEquilibrium: cavity {inner:.6} cm^3, wall {wall:.6} cm^3>")
    }
}

/// An inner and an outer membrane with a wall of constant volume between them, at a volume gain of the inner one.
///
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
    let (inner, outer) = (inner.get().0.clone(), outer.get().0.clone());
    let by = discretisation(tolerance, degree, nodes)?;
    let solved = work(py, move |_| {
        let pair = Pair::new(Solver::new(&inner, by)?, Solver::new(&outer, by)?)?;
        pair.solve_gain(volume_gain, &NewtonOptions::default())
    })?;
    Ok(PyPairEquilibrium(solved))
}
