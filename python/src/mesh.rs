//! Triangle meshes.

use crate::arrays::{array, check_shape, of, points};
use crate::errors::Failure;
use crate::values::choice;
use heart_phantom::files::{write_ply, write_stl};
use heart_phantom::revolve_voxel::Mesh;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::path::PathBuf;

/// A closed triangle mesh: two triangles at every edge, counter-clockwise seen from outside; cm.
#[pyclass(name = "Mesh", module = "heart_phantom.revolve", frozen)]
#[derive(Debug)]
pub(crate) struct PyMesh(Mesh);

impl From<Mesh> for PyMesh {
    fn from(mesh: Mesh) -> Self {
        Self(mesh)
    }
}

/// The formats of `PyMesh::write`.
#[derive(Debug, Clone, Copy)]
enum Format {
    Stl,
    Ply,
}

#[pymethods]
impl PyMesh {
    /// Points, x, y, z: `float64[n][3]`, a new array for each call.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let flat = self.0.vertices.iter().flat_map(|p| p.coords.data.0[0]);
        array(py, flat.collect(), &[self.0.vertices.len(), 3])
    }

    /// Outward unit normals of the surface at the points: `float64[n][3]`, a new array for each call.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let flat = self.0.normals.iter().flat_map(|n| n.data.0[0]);
        array(py, flat.collect(), &[self.0.normals.len(), 3])
    }

    /// Indices of the points of each triangle: `uint32[m][3]`, a new array for each call.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArrayDyn<u32>>, Failure> {
        let flat = self.0.triangles.as_flattened().to_vec();
        array(py, flat, &[self.0.triangles.len(), 3])
    }

    /// The volume enclosed by the triangles, cm^3.
    #[getter]
    fn volume(&self) -> f64 {
        self.0.volume()
    }

    /// Writes the mesh in mm.
    ///
    /// Parameters
    /// ----------
    /// path : path_like
    ///     A file with the suffix `.stl` or `.ply`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If it has another suffix.
    /// OSError
    ///     If it cannot be written.
    fn write(&self, path: PathBuf) -> Result<(), Failure> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let format = choice(
            "the extension",
            &extension,
            &[("stl", Format::Stl), ("ply", Format::Ply)],
        )?;
        match format {
            Format::Stl => write_stl(&path, &self.0)?,
            Format::Ply => write_ply(&path, &self.0)?,
        }
        Ok(())
    }

    fn __repr__(&self) -> String {
        let (points, triangles) = (self.0.vertices.len(), self.0.triangles.len());
        format!("<Mesh: {points} points, {triangles} triangles>")
    }

    /// A mesh of its arrays, for pickling.
    #[staticmethod]
    fn _restore(
        vertices: &Bound<'_, PyAny>,
        normals: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
    ) -> Result<Self, Failure> {
        let vertices = points::<3>("vertices", vertices)?;
        let normals = points::<3>("normals", normals)?;
        check_shape("normals", &[normals.len(), 3], &[vertices.len(), 3])?;
        let triangles = of::<u32>("triangles", triangles)?;
        check_shape(
            "triangles",
            &triangles.shape,
            &[triangles.samples.len() / 3, 3],
        )?;
        if let Some(index) = triangles
            .samples
            .iter()
            .find(|&&i| i as usize >= vertices.len())
        {
            let text = format!(
                "triangles contains {index}, beyond {} vertices",
                vertices.len()
            );
            return Err(PyValueError::new_err(text).into());
        }
        Ok(Self(Mesh::new(
            vertices.into_iter().map(Point3::from).collect(),
            normals.into_iter().map(Vector3::from).collect(),
            triangles.samples.as_chunks::<3>().0.to_vec(),
        )))
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> Result<(Bound<'py, PyAny>, Bound<'py, PyTuple>), Failure> {
        let arrays = (self.vertices(py)?, self.normals(py)?, self.triangles(py)?);
        let own = py.get_type::<Self>().getattr("_restore")?;
        Ok((own, arrays.into_pyobject(py)?))
    }
}
