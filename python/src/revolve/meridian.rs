//! Meridians, the curves that are revolved.

use crate::arrays::array;
use crate::errors::Failure;
use crate::recipe::{Recipe, Reduced};
use heart_phantom::revolve_voxel::{MassProperties, Meridian};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A meridian, the curve that is revolved.
///
/// Parameters
/// ----------
/// points : array_like
///     (x along the axis, r >= 0 from it) from base to apex, `[n][2]`, cm. Discs close ends off the axis.
/// ring : bool
///     Whether the curve is closed and need not touch the axis, such as that of a torus.
///
/// Raises
/// ------
/// RevolveError
///     If the points are not a meridian.
///
/// Examples
/// --------
/// >>> from heart_phantom.revolve import Meridian
/// >>> round(Meridian([[0, 1], [3, 0]]).measures()["volume"], 9)  # a cone: pi
/// 3.141592654
#[pyclass(name = "Meridian", module = "heart_phantom.revolve", frozen)]
#[derive(Debug)]
pub(crate) struct PyMeridian {
    pub(super) meridian: Meridian,
    recipe: Recipe,
}

#[pymethods]
impl PyMeridian {
    #[new]
    #[pyo3(signature = (points, *, ring = false))]
    pub(super) fn new(points: &Bound<'_, PyAny>, ring: bool) -> Result<Self, Failure> {
        let py = points.py();
        let points = crate::arrays::points::<2>("points", points)?;
        let options = PyDict::new(py);
        options.set_item("ring", ring)?;
        let own = py.get_type::<Self>();
        let given = array(py, points.as_flattened().to_vec(), &[points.len(), 2])?;
        Ok(Self {
            meridian: match ring {
                true => Meridian::ring(&points)?,
                false => Meridian::new(&points)?,
            },
            recipe: Recipe::new(py, own.as_any(), (given,))?.with_options(&options)?,
        })
    }

    /// Returns the measures of the solid.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `volume` in cm^3, `surface` in cm^2; at density 1 `first_moment` and `second_moment` about x = 0, `polar_inertia` about the axis.
    fn measures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        measures(py, &self.meridian.mass_properties())
    }

    /// Extent along the axis.
    #[getter]
    fn x_range(&self) -> (f64, f64) {
        self.meridian.x_range().into()
    }

    /// Largest radius.
    #[getter]
    fn r_max(&self) -> f64 {
        self.meridian.r_max()
    }

    fn __repr__(&self) -> String {
        let ([low, high], r) = (self.meridian.x_range(), self.meridian.r_max());
        let n = self.meridian.n_segments();
        format!("<Meridian: {n} segments, x from {low} to {high}, r up to {r}>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

pub(super) fn measures<'py>(py: Python<'py>, of: &MassProperties) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    for (name, value) in [
        ("volume", of.volume),
        ("surface", of.surface),
        ("first_moment", of.first_moment),
        ("second_moment", of.second_moment),
        ("polar_inertia", of.polar_inertia),
    ] {
        made.set_item(name, value)?;
    }
    Ok(made)
}
