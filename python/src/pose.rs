//! Poses of bodies.

use crate::arrays::{array, points};
use crate::errors::Failure;
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

/// Position and orientation of a body in the lab; initially the identity, with the body's axis along x. Angles in radians.
///
/// >>> import math
/// >>> from heart_phantom.revolve import Pose
/// >>> pose = Pose.axis_along_z(2.0).rotated_x(math.pi / 2).shifted([0, 0, 1])
/// >>> [round(x, 9) + 0.0 for x in pose.axis]
/// [0.0, -1.0, 0.0]
#[pyclass(name = "Pose", module = "heart_phantom.revolve", frozen, eq)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PyPose(pub(crate) Pose);

#[expect(
    clippy::wrong_self_convention,
    reason = "methods of a class of Python take a reference"
)]
#[pymethods]
impl PyPose {
    #[new]
    pub(crate) fn identity() -> Self {
        Self(Pose::identity())
    }

    /// The pose with the body's axis along z and its point `axial_point` (cm along the axis) at the lab's origin.
    #[staticmethod]
    fn axis_along_z(axial_point: f64) -> Result<Self, Failure> {
        Ok(Self(Pose::axis_along_z(axial_point)?))
    }

    /// The pose rotated about the lab's x axis.
    fn rotated_x(&self, angle: f64) -> Result<Self, Failure> {
        Ok(Self(self.0.rotated_x(angle)?))
    }

    /// The pose rotated about the lab's y axis.
    fn rotated_y(&self, angle: f64) -> Result<Self, Failure> {
        Ok(Self(self.0.rotated_y(angle)?))
    }

    /// The pose rotated about the lab's z axis.
    fn rotated_z(&self, angle: f64) -> Result<Self, Failure> {
        Ok(Self(self.0.rotated_z(angle)?))
    }

    /// The pose shifted by (x, y, z).
    fn shifted(&self, by: [f64; 3]) -> Result<Self, Failure> {
        Ok(Self(self.0.shifted(Vector3::from(by))?))
    }

    /// Direction of the axis in the lab, from base to apex.
    #[getter]
    fn axis(&self) -> [f64; 3] {
        self.0.axis().into()
    }

    /// Transforms points of the body, `[n][3]`, to the lab: `float64[n][3]`.
    fn to_lab<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        moved(py, places, |p| self.0.to_lab(p))
    }

    /// Transforms points of the lab, `[n][3]`, to the body's frame: `float64[n][3]`.
    fn to_body<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        moved(py, places, |p| self.0.to_body(p))
    }

    fn __repr__(&self) -> String {
        let ([x, y, z], origin) = (self.axis(), self.0.to_lab(&Point3::origin()));
        let (a, b, c) = (origin.x, origin.y, origin.z);
        format!("<Pose: base at ({a:.4}, {b:.4}, {c:.4}), axis along ({x:.4}, {y:.4}, {z:.4})>")
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
