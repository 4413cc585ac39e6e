//! Poses of bodies.

use crate::arrays::{array, points};
use crate::errors::Failure;
use crate::recipe::{Recipe, Reduced};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

/// Position and orientation of a body in the lab; initially the identity, with the body's axis along x. Angles in radians.
///
/// Examples
/// --------
/// >>> import math
/// >>> from heart_phantom.revolve import Pose
/// >>> pose = Pose.axis_along_z(2.0).rotated_x(math.pi / 2).shifted([0, 0, 1])
/// >>> [round(x, 9) + 0.0 for x in pose.axis]
/// [0.0, -1.0, 0.0]
#[pyclass(name = "Pose", module = "heart_phantom.revolve", frozen, eq)]
#[derive(Debug)]
pub(crate) struct PyPose {
    pub(crate) pose: Pose,
    recipe: Recipe,
}

impl PartialEq for PyPose {
    fn eq(&self, other: &Self) -> bool {
        self.pose == other.pose
    }
}

impl PyPose {
    pub(crate) fn with_recipe(pose: Pose, recipe: Recipe) -> Self {
        Self { pose, recipe }
    }
}

#[pymethods]
impl PyPose {
    #[new]
    pub(crate) fn identity(py: Python<'_>) -> PyResult<Self> {
        let recipe = Recipe::new(py, py.get_type::<Self>().as_any(), ())?;
        Ok(Self::with_recipe(Pose::identity(), recipe))
    }

    /// Returns the pose with the body's axis along z.
    ///
    /// Parameters
    /// ----------
    /// axial_point : float
    ///     The point on the axis, in cm, that is at the lab's origin.
    ///
    /// Returns
    /// -------
    /// Pose
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a number is not finite.
    #[staticmethod]
    fn axis_along_z(py: Python<'_>, axial_point: f64) -> Result<Self, Failure> {
        let pose = Pose::axis_along_z(axial_point)?;
        let own = py.get_type::<Self>().getattr("axis_along_z")?;
        Ok(Self::with_recipe(
            pose,
            Recipe::new(py, &own, (axial_point,))?,
        ))
    }

    /// Returns the pose rotated about the lab's x axis.
    ///
    /// Parameters
    /// ----------
    /// angle : float
    ///     Radians.
    ///
    /// Returns
    /// -------
    /// Pose
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a number is not finite.
    fn rotated_x(slf: &Bound<'_, Self>, angle: f64) -> Result<Self, Failure> {
        let pose = slf.get().pose.rotated_x(angle)?;
        let recipe = Recipe::new(slf.py(), &slf.getattr("rotated_x")?, (angle,))?;
        Ok(Self::with_recipe(pose, recipe))
    }

    /// Returns the pose rotated about the lab's y axis.
    ///
    /// Parameters
    /// ----------
    /// angle : float
    ///     Radians.
    ///
    /// Returns
    /// -------
    /// Pose
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a number is not finite.
    fn rotated_y(slf: &Bound<'_, Self>, angle: f64) -> Result<Self, Failure> {
        let pose = slf.get().pose.rotated_y(angle)?;
        let recipe = Recipe::new(slf.py(), &slf.getattr("rotated_y")?, (angle,))?;
        Ok(Self::with_recipe(pose, recipe))
    }

    /// Returns the pose rotated about the lab's z axis.
    ///
    /// Parameters
    /// ----------
    /// angle : float
    ///     Radians.
    ///
    /// Returns
    /// -------
    /// Pose
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a number is not finite.
    fn rotated_z(slf: &Bound<'_, Self>, angle: f64) -> Result<Self, Failure> {
        let pose = slf.get().pose.rotated_z(angle)?;
        let recipe = Recipe::new(slf.py(), &slf.getattr("rotated_z")?, (angle,))?;
        Ok(Self::with_recipe(pose, recipe))
    }

    /// Returns the shifted pose.
    ///
    /// Parameters
    /// ----------
    /// by : (float, float, float)
    ///     Displacement (x, y, z) in cm.
    ///
    /// Returns
    /// -------
    /// Pose
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a number is not finite.
    fn shifted(slf: &Bound<'_, Self>, by: [f64; 3]) -> Result<Self, Failure> {
        let pose = slf.get().pose.shifted(Vector3::from(by))?;
        let recipe = Recipe::new(slf.py(), &slf.getattr("shifted")?, (by,))?;
        Ok(Self::with_recipe(pose, recipe))
    }

    /// Direction of the axis in the lab, from base to apex.
    #[getter]
    fn axis(&self) -> [f64; 3] {
        self.pose.axis().into()
    }

    /// Transforms points of the body to the lab.
    ///
    /// Parameters
    /// ----------
    /// places : array_like
    ///     `[n][3]`.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[n][3]`.
    fn to_lab<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        moved(py, places, |p| self.pose.to_lab(p))
    }

    /// Transforms points of the lab to the body's frame.
    ///
    /// Parameters
    /// ----------
    /// places : array_like
    ///     `[n][3]`.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[n][3]`.
    fn to_body<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        moved(py, places, |p| self.pose.to_body(p))
    }

    fn __repr__(&self) -> String {
        let ([x, y, z], origin) = (self.axis(), self.pose.to_lab(&Point3::origin()));
        let (a, b, c) = (origin.x, origin.y, origin.z);
        format!("<Pose: base at ({a:.4}, {b:.4}, {c:.4}), axis along ({x:.4}, {y:.4}, {z:.4})>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

fn moved<'py>(
    py: Python<'py>,
    places: &Bound<'py, PyAny>,
    to: impl Fn(&Point3<f64>) -> Point3<f64>,
) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
    let places = points::<3>("places", places)?;
    let n = places.len();
    let flat = places.into_iter().flat_map(|p| {
        let there: [f64; 3] = to(&Point3::from(p)).coords.into();
        there
    });
    array(py, flat.collect(), &[n, 3])
}
