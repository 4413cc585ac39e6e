//! The methods of a phantom: the products of a scene as arrays.

mod projections;
mod reports;
mod states;
mod volumes;

use crate::errors::Failure;
use crate::product::PyPhantom;
use crate::radon::PyGrid;
use crate::rays::PyRayGeometry;
use crate::scene::{PyScene, folded, scene_of};
use crate::values::Whole;
use crate::work::work;
use heart_phantom::Phantom;
use pyo3::prelude::*;
use std::path::PathBuf;

#[pymethods]
impl PyPhantom {
    #[new]
    #[pyo3(signature = (scene = None, *, memory = None))]
    fn new(
        py: Python<'_>,
        scene: Option<&Bound<'_, PyAny>>,
        memory: Option<Whole>,
    ) -> Result<Self, Failure> {
        Self::of(py, scene_of(scene)?, memory)
    }

    /// Reads a scene file.
    ///
    /// Parameters
    /// ----------
    /// path : path_like
    ///     The file.
    ///
    /// Returns
    /// -------
    /// Phantom
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If the file cannot be read.
    /// SceneError
    ///     If the scene is invalid, with file, line, column and field.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self, Failure> {
        let made = work(py, None, move |_| Phantom::load(&path))?;
        Ok(Self::from(made))
    }

    /// Returns the phantom acquired along other rays, at their times.
    ///
    /// Mode, accuracy, activity and attenuation are those of the scene. Solved shapes are shared.
    ///
    /// Parameters
    /// ----------
    /// rays : RayGeometry
    ///     The rays of each view.
    ///
    /// Returns
    /// -------
    /// Phantom
    ///     Its `views` and `view` have the size of the rays.
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If the scene cannot be acquired along other rays.
    fn along(&self, py: Python<'_>, rays: PyRayGeometry) -> Result<Self, Failure> {
        Ok(Self::from(
            self.made(py, None, |phantom| phantom.along(rays.0))?,
        ))
    }

    /// The scene.
    #[getter]
    fn scene(&self) -> PyScene {
        PyScene(self.phantom.scene().clone())
    }

    /// Number of gated projection sets: cardiac gates (or 1) x respiratory gates (or 1).
    #[getter]
    fn n_gates(&self) -> usize {
        self.phantom.n_gates()
    }

    /// Shape of a volume, `(z, y, x)`.
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        self.volume_shape().into()
    }

    /// Voxel size in cm, in the order of a volume's axes: z, y, x.
    #[getter]
    fn spacing(&self) -> (f64, f64, f64) {
        let [x, y, z] = self.phantom.camera().grid().spacing();
        (z, y, x)
    }

    /// Centre of the first voxel in cm, in the order of a volume's axes: z, y, x.
    #[getter]
    fn origin(&self) -> (f64, f64, f64) {
        let [x, y, z] = self.phantom.camera().grid().origin();
        (z, y, x)
    }

    /// Names of the labels, from 0.
    #[getter]
    fn label_names(&self) -> Vec<String> {
        self.phantom.label_names()
    }

    /// The pixel grid of a slice, for `heart_phantom.radon`.
    #[getter]
    fn grid(&self) -> PyGrid {
        PyGrid(*self.phantom.camera().image())
    }

    fn __repr__(&self) -> String {
        let [views, rows, bins] = self.views_shape();
        let [nz, ny, nx] = self.volume_shape();
        let gates = match self.phantom.n_gates() {
            1 => String::new(),
            n => format!("{n} gates of "),
        };
        let spacing = self.phantom.camera().grid().spacing()[0];
        format!(
            "<Phantom: {gates}{views} views of {rows} x {bins} samples, {nz} x {ny} x {nx} voxels of {spacing} cm>"
        )
    }

    fn _repr_html_(&self) -> String {
        folded(&self.__repr__(), self.phantom.scene())
    }

    fn __getnewargs__(&self) -> (PyScene,) {
        (self.scene(),)
    }
}
