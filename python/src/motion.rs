//! The motion of the wall, as arrays.

use crate::arrays::array;
use crate::errors::Failure;
use heart_phantom::MotionField;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// The motion of the wall from end-diastole at end-expiration to another time, on the voxels of the wall at end-diastole; zero elsewhere.
#[pyclass(name = "Motion", module = "heart_phantom", frozen, get_all)]
#[derive(Debug)]
pub(crate) struct PyMotion {
    /// Displacement along x, y, z, in cm: `float32[z][y][x][3]`.
    displacement: Py<PyArrayDyn<f32>>,
    /// Velocity of the beat along x, y, z, in cm/s: `float32[z][y][x][3]`.
    velocity: Py<PyArrayDyn<f32>>,
    /// Green's strain in the directions of the wall at end-diastole, rr, cc, ll, rc, rl, cl: `float32[z][y][x][6]`.
    strain: Py<PyArrayDyn<f32>>,
    /// The voxels whose centres are in the wall at end-diastole: `bool[z][y][x]`.
    wall: Py<PyArrayDyn<bool>>,
}

impl PyMotion {
    pub(crate) fn new(
        py: Python<'_>,
        field: MotionField,
        [nz, ny, nx]: [usize; 3],
    ) -> Result<Self, Failure> {
        let mut wall = vec![false; nz * ny * nx];
        for &voxel in &field.voxels {
            wall[voxel] = true;
        }
        Ok(Self {
            displacement: array(py, field.displacement, &[nz, ny, nx, 3])?.unbind(),
            velocity: array(py, field.velocity, &[nz, ny, nx, 3])?.unbind(),
            strain: array(py, field.strain, &[nz, ny, nx, 6])?.unbind(),
            wall: array(py, wall, &[nz, ny, nx])?.unbind(),
        })
    }
}

#[pymethods]
impl PyMotion {
    /// A motion of its arrays, for pickling.
    #[staticmethod]
    fn _restore(
        displacement: Py<PyArrayDyn<f32>>,
        velocity: Py<PyArrayDyn<f32>>,
        strain: Py<PyArrayDyn<f32>>,
        wall: Py<PyArrayDyn<bool>>,
    ) -> Self {
        Self {
            displacement,
            velocity,
            strain,
            wall,
        }
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let vectors = [&self.displacement, &self.velocity, &self.strain];
        let [displacement, velocity, strain] = vectors.map(|array| array.bind(py));
        let arrays = (displacement, velocity, strain, self.wall.bind(py));
        let own = py.get_type::<Self>().getattr("_restore")?;
        Ok((own, arrays.into_pyobject(py)?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let wall = self.wall.bind(py);
        let voxels = wall.call_method0("sum")?;
        let shape = wall.getattr("shape")?;
        Ok(format!(
            "<Motion: {voxels} voxels of the wall among {shape}>"
        ))
    }
}
