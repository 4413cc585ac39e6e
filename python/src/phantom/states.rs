//! The heart at one phase: voxels, surfaces, membranes.

use crate::arrays::{self, Given, array};
use crate::equilibrium::PyEquilibrium;
use crate::errors::Failure;
use crate::mesh::PyMesh;
use crate::motion::PyMotion;
use crate::product::{Floats, PyPhantom};
use crate::recipe::Recipe;
use crate::revolve::PyBody;
use crate::tables;
use crate::work::Progress;
use heart_phantom::membrane_newton::Equilibrium;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

#[pymethods]
impl PyPhantom {
    /// Computes the activity at a phase, averaged over each voxel.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[z][y][x]`, 1/mL.
    #[pyo3(signature = (phase, breath = 0.0, *, progress = None))]
    fn activity<'py>(
        &self,
        py: Python<'py>,
        phase: f64,
        breath: f64,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let at = self.moment(phase, breath)?;
        self.floats(py, progress, &self.volume_shape(), move |phantom, _| {
            phantom.activity(at)
        })
    }

    /// Computes the linear attenuation coefficient at a phase, averaged over each voxel.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[z][y][x]`, 1/cm.
    #[pyo3(signature = (phase, breath = 0.0, *, progress = None))]
    fn attenuation<'py>(
        &self,
        py: Python<'py>,
        phase: f64,
        breath: f64,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let at = self.moment(phase, breath)?;
        self.floats(py, progress, &self.volume_shape(), move |phantom, _| {
            phantom.attenuation(at)
        })
    }

    /// Computes the label with the largest volume fraction in each voxel at a phase.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `uint8[z][y][x]`; `label_names` lists their names.
    #[pyo3(signature = (phase, breath = 0.0, *, progress = None))]
    fn labels<'py>(
        &self,
        py: Python<'py>,
        phase: f64,
        breath: f64,
        progress: Progress<'_, 'py>,
    ) -> Result<Bound<'py, PyArrayDyn<u8>>, Failure> {
        let at = self.moment(phase, breath)?;
        let labels = self.made(py, progress, move |phantom| phantom.labels(at))?;
        array(py, labels, &self.volume_shape())
    }

    /// Computes the motion of the wall from end-diastole at end-expiration to a phase.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// Motion
    #[pyo3(signature = (phase, breath = 0.0, *, progress = None))]
    fn motion(
        &self,
        py: Python<'_>,
        phase: f64,
        breath: f64,
        progress: Progress<'_, '_>,
    ) -> Result<PyMotion, Failure> {
        let at = self.moment(phase, breath)?;
        let field = self.made(py, progress, move |phantom| phantom.motion(at))?;
        PyMotion::new(py, field, self.volume_shape())
    }

    /// Computes meshes of the inner and the outer surface at a phase, in the lab frame.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// tuple of heart_phantom.revolve.Mesh
    ///     Inner and outer surface; the relative error of the enclosed volumes is at most the `output.mesh_tolerance` of the scene.
    #[pyo3(signature = (phase, breath = 0.0, *, progress = None))]
    fn meshes(
        &self,
        py: Python<'_>,
        phase: f64,
        breath: f64,
        progress: Progress<'_, '_>,
    ) -> Result<(PyMesh, PyMesh), Failure> {
        let at = self.moment(phase, breath)?;
        let meshes = self.made(py, progress, move |phantom| phantom.meshes(at))?;
        Ok(meshes.map(PyMesh::from).into())
    }

    /// Returns the solid at a phase.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    /// breath : float
    ///     Respiratory position, 0 to 1; other than 0 only with respiration.
    ///
    /// Returns
    /// -------
    /// heart_phantom.revolve.Body
    ///     Layer 0 is bounded by the inner surface, layer 1 by the outer surface.
    #[pyo3(signature = (phase, breath = 0.0))]
    fn body(&self, py: Python<'_>, phase: f64, breath: f64) -> Result<PyBody, Failure> {
        let at = self.moment(phase, breath)?;
        let body = self.made(py, None, move |phantom| {
            let pose = phantom.pose(at.breath)?;
            Ok(phantom.shape(at.phase)?.body().with_pose(pose))
        })?;
        let recipe = Recipe::of_phantom(py, self.phantom.scene(), "body", (phase, breath), None)?;
        Ok(PyBody::with_recipe(body, recipe))
    }

    /// Returns the membranes at a phase, with their pressures.
    ///
    /// Parameters
    /// ----------
    /// phase : float
    ///     Cardiac phase, 0 to 1.
    ///
    /// Returns
    /// -------
    /// tuple of heart_phantom.membrane.Equilibrium
    ///     Inner and outer membrane.
    fn membranes(
        &self,
        py: Python<'_>,
        phase: f64,
    ) -> Result<(PyEquilibrium, PyEquilibrium), Failure> {
        let shape = self.made(py, None, move |phantom| phantom.shape(phase))?;
        let solution = shape.solution();
        let one = |item: usize, membrane: &Equilibrium| {
            let recipe =
                Recipe::of_phantom(py, self.phantom.scene(), "membranes", (phase,), Some(item))?;
            Ok::<_, PyErr>(PyEquilibrium::with_recipe(membrane.clone(), recipe))
        };
        Ok((one(0, &solution.inner)?, one(1, &solution.outer)?))
    }

    /// Returns the volume of the cavity at given phases.
    ///
    /// Parameters
    /// ----------
    /// phases : array_like
    ///     Cardiac phases, 0 to 1.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64`, mL, with the shape of the phases.
    fn cavity_volumes<'py>(
        &self,
        py: Python<'py>,
        phases: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let Given { samples, shape } = arrays::of::<f64>("phases", phases)?;
        let volumes = self.made(py, None, move |phantom| {
            tables::cavity_volumes(phantom, samples)
        })?;
        array(py, volumes, &shape)
    }
}
