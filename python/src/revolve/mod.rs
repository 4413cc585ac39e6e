//! `heart_phantom.revolve`: solids of revolution.

mod meridian;
mod samples;

pub(crate) use meridian::PyMeridian;

use crate::errors::Failure;
use crate::mesh::PyMesh;
use crate::pose::PyPose;
use crate::recipe::{Recipe, Reduced};
use crate::values::Whole;
use crate::work::{Progress, work};
use heart_phantom::revolve_voxel::{Body, Pose};
use meridian::measures;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Nested solids of revolution about one axis in a pose. Chords and measures are exact for the given polylines.
///
/// Region 0 is the inside of layer 0, region k is layer k without layer k - 1; activities have one value per region. Lengths in cm.
///
/// Parameters
/// ----------
/// layers : sequence of Meridian or array_like
///     Meridians, or their points, innermost first.
/// pose : Pose, optional
///     By default the identity.
///
/// Raises
/// ------
/// RevolveError
///     If there is no layer, or the points of a layer are not a meridian.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.revolve import Body
/// >>> cone = Body([[[0.0, 1.0], [3.0, 0.0]]])
/// >>> cone.chords([[1.5, -5.0, 0.0]], [0.0, 1.0, 0.0]).tolist()
/// [1.0]
#[pyclass(name = "Body", module = "heart_phantom.revolve", frozen)]
#[derive(Debug)]
pub(crate) struct PyBody {
    body: Arc<Body>,
    recipe: Recipe,
}

impl PyBody {
    pub(crate) fn with_recipe(body: Body, recipe: Recipe) -> Self {
        Self {
            body: Arc::new(body),
            recipe,
        }
    }
}

#[pymethods]
impl PyBody {
    #[new]
    #[pyo3(signature = (layers, pose = None))]
    fn new(
        py: Python<'_>,
        layers: Vec<Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyPose>>,
    ) -> Result<Self, Failure> {
        let layers = layers.iter().map(|layer| match layer.cast::<PyMeridian>() {
            Ok(meridian) => Ok(meridian.clone()),
            Err(_) => Ok(Bound::new(py, PyMeridian::new(layer, false)?)?),
        });
        let layers = layers.collect::<Result<Vec<_>, Failure>>()?;
        let own = layers.iter().map(|layer| layer.get().meridian.clone());
        let body = Body::new(
            own.collect(),
            pose.map_or_else(Pose::identity, |pose| pose.get().pose),
        )?;
        let recipe = Recipe::new(py, py.get_type::<Self>().as_any(), (layers, pose))?;
        Ok(Self::with_recipe(body, recipe))
    }

    /// The pose.
    #[getter]
    fn pose(slf: &Bound<'_, Self>) -> PyResult<PyPose> {
        let recipe = Recipe::property(slf.as_any(), "pose")?;
        Ok(PyPose::with_recipe(*slf.get().body.pose(), recipe))
    }

    /// Number of layers.
    #[getter]
    fn n_layers(&self) -> usize {
        self.body.layers().len()
    }

    /// Returns the body in another pose.
    ///
    /// Parameters
    /// ----------
    /// pose : Pose
    ///     Replaces the pose of the body.
    ///
    /// Returns
    /// -------
    /// Body
    fn with_pose(slf: &Bound<'_, Self>, pose: &Bound<'_, PyPose>) -> PyResult<Self> {
        let body = slf.get().body.with_pose(pose.get().pose);
        let recipe = Recipe::new(slf.py(), &slf.getattr("with_pose")?, (pose,))?;
        Ok(Self::with_recipe(body, recipe))
    }

    /// Returns the measures of a region in the body's frame.
    ///
    /// Parameters
    /// ----------
    /// region : int
    ///     Index of the region.
    ///
    /// Returns
    /// -------
    /// dict
    ///     As `Meridian.measures`.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If there is no such region.
    fn measures<'py>(&self, py: Python<'py>, region: Whole) -> Result<Bound<'py, PyDict>, Failure> {
        Ok(measures(py, &self.body.region_measures(region.0)?)?)
    }

    /// Computes a triangle mesh of the surface of a layer.
    ///
    /// Parameters
    /// ----------
    /// layer : int
    ///     Index of the layer.
    /// tolerance : float
    ///     Largest distance from the surface in cm. The number of triangles scales as 1 / `tolerance`.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// Mesh
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If there is no such layer, or the mesh has too many points.
    #[pyo3(signature = (layer = Whole(0), *, tolerance = 0.01, progress = None), text_signature = "($self, layer=0, *, tolerance=0.01, progress=None)")]
    fn mesh(
        &self,
        py: Python<'_>,
        layer: Whole,
        tolerance: f64,
        progress: Progress<'_, '_>,
    ) -> Result<PyMesh, Failure> {
        let body = self.body.clone();
        let mesh = work(py, progress, move |_| body.mesh(layer.0, tolerance))?;
        Ok(mesh.into())
    }

    /// Returns the bounding box of a layer along the lab's axes.
    ///
    /// Parameters
    /// ----------
    /// layer : int
    ///     Index of the layer.
    ///
    /// Returns
    /// -------
    /// tuple of list
    ///     Lowest and highest corner, (x, y, z).
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If there is no such layer.
    #[pyo3(signature = (layer = Whole(0)), text_signature = "($self, layer=0)")]
    fn bounding_box(&self, layer: Whole) -> Result<([f64; 3], [f64; 3]), Failure> {
        let [low, high] = self.body.bounding_box(layer.0)?;
        Ok((low.coords.into(), high.coords.into()))
    }

    fn __repr__(&self) -> String {
        let volumes = self
            .body
            .layers()
            .iter()
            .map(|layer| layer.mass_properties().volume);
        let volumes: Vec<_> = volumes.map(|volume| format!("{volume:.4}")).collect();
        format!("<Body: layers of {} cm^3>", volumes.join(", "))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}
