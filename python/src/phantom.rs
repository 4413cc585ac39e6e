//! The methods of a phantom: the products of a scene as arrays.

use crate::arrays::{self, Given, array};
use crate::equilibrium::PyEquilibrium;
use crate::errors::Failure;
use crate::mesh::PyMesh;
use crate::motion::PyMotion;
use crate::product::{Floats, PyPhantom, reconstructed, volume};
use crate::radon::{PyGeometry, PyGrid};
use crate::rays::PyRayGeometry;
use crate::recipe::Recipe;
use crate::revolve::PyBody;
use crate::scatter::{self, Scattered};
use crate::scene::{PyScene, folded, scene_of};
use crate::tables;
use crate::values::{Whole, to_python};
use crate::work::{AtSignal, Progress, work, work_at};
use heart_phantom::membrane_newton::Equilibrium;
use heart_phantom::{Phantom, no_observer};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

type Any<'py> = Result<Bound<'py, PyAny>, Failure>;

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

    /// Reads a scene file; errors contain its name.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self, Failure> {
        let made = work(py, None, move |_| Phantom::load(&path))?;
        Ok(Self::from(made))
    }

    /// The phantom acquired along other rays, at their times, with mode, accuracy, activity and attenuation of the scene. It shares the
    /// solved shapes. `views` and `view` have the size of the rays.
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

    /// A phase of end-systole and one of end-diastole.
    #[getter]
    fn extreme_phases(&self) -> (f64, f64) {
        self.phantom.extreme_phases().into()
    }

    /// Warnings about values that are probably not intended, as text. The first projections, volume or run issue them as `SceneWarning`.
    pub(crate) fn warnings(&self, py: Python<'_>) -> Result<Vec<String>, Failure> {
        let warnings = self.made(py, None, Phantom::warnings)?;
        Ok(warnings.iter().map(ToString::to_string).collect())
    }

    /// Projections of a gate, `[view][row][bin]`, with blur and noise of the scene.
    #[pyo3(signature = (gate = Whole(0), *, progress = None), text_signature = "($self, gate=0, *, progress=None)")]
    fn views<'py>(&self, py: Python<'py>, gate: Whole, progress: Progress<'_, 'py>) -> Floats<'py> {
        self.floats(py, progress, &self.views_shape(), move |phantom, _| {
            Ok(phantom.sinograms(gate.0, &no_observer)?.samples)
        })
    }

    /// A view of a gate, `[row][bin]`.
    #[pyo3(signature = (view, gate = Whole(0), *, progress = None), text_signature = "($self, view, gate=0, *, progress=None)")]
    fn view<'py>(
        &self,
        py: Python<'py>,
        view: Whole,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let [_, rows, bins] = self.views_shape();
        self.floats(py, progress, &[rows, bins], move |phantom, _| {
            phantom.view(gate.0, view.0)
        })
    }

    /// The scattered photons in the projections of a gate in an energy window, and their standard errors: two arrays
    /// `float64[view][row][bin]`; `None` without a section `[scatter]` or without activity. The number of photon histories is not known in
    /// advance: `progress` remains at 0.5 while they are followed.
    #[pyo3(signature = (gate = Whole(0), window = Whole(0), *, progress = None), text_signature = "($self, gate=0, window=0, *, progress=None)")]
    fn scatter<'py>(
        &self,
        py: Python<'py>,
        gate: Whole,
        window: Whole,
        progress: Progress<'_, 'py>,
    ) -> Scattered<'py> {
        scatter::arrays(py, progress, &self.phantom, [gate.0, window.0])
    }

    /// Projections of all gates, `[gate][view][row][bin]`; shapes that several gates share are projected once.
    #[pyo3(signature = (*, progress = None))]
    fn views_of_gates<'py>(&self, py: Python<'py>, progress: Progress<'_, 'py>) -> Floats<'py> {
        let [views, rows, bins] = self.views_shape();
        let shape = [self.phantom.n_gates(), views, rows, bins];
        self.floats(py, progress, &shape, |phantom, _| {
            phantom.sinograms_of_gates()
        })
    }

    /// Angles of the views of a gate in radians, averaged over their time: `float64[view]`.
    #[pyo3(signature = (gate = Whole(0)), text_signature = "($self, gate=0)")]
    fn angles<'py>(
        &self,
        py: Python<'py>,
        gate: Whole,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let angles: Vec<_> = (self.phantom.view_times(gate.0)?.iter())
            .map(|time| time.angle)
            .collect();
        let n = angles.len();
        array(py, angles, &[n])
    }

    /// Times and angles of the views of a gate: a dictionary of `float64[view]`.
    ///
    /// `start` and `window` (acquisition time) in seconds; cardiac `phase` at the start; `angle` in radians.
    #[pyo3(signature = (gate = Whole(0)), text_signature = "($self, gate=0)")]
    fn view_times<'py>(&self, py: Python<'py>, gate: Whole) -> Result<Bound<'py, PyDict>, Failure> {
        tables::view_times(py, &self.phantom.view_times(gate.0)?)
    }

    /// Angles and bins of a gate, for `heart_phantom.radon`.
    #[pyo3(signature = (gate = Whole(0)), text_signature = "($self, gate=0)")]
    fn geometry(&self, gate: Whole) -> Result<PyGeometry, Failure> {
        Ok(PyGeometry(self.phantom.geometry(gate.0)?))
    }

    /// The pixel grid of a slice, for `heart_phantom.radon`.
    #[getter]
    fn grid(&self) -> PyGrid {
        PyGrid(*self.phantom.camera().image())
    }

    /// Reconstruction of a gate, `[z][y][x]`, by the method of the scene.
    #[pyo3(signature = (gate = Whole(0), *, progress = None), text_signature = "($self, gate=0, *, progress=None)")]
    fn volume<'py>(
        &self,
        py: Python<'py>,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        self.floats(py, progress, &self.volume_shape(), move |phantom, watch| {
            volume(phantom, gate.0, watch)
        })
    }

    /// Reconstruction, `[z][y][x]`, of given views `[view][row][bin]` of this camera, for example those of `views` with other noise.
    ///
    /// Views are converted to `float32`; their angles are those of the gate.
    #[pyo3(signature = (views, gate = Whole(0), *, progress = None), text_signature = "($self, views, gate=0, *, progress=None)")]
    fn reconstruct<'py>(
        &self,
        py: Python<'py>,
        views: &Bound<'py, PyAny>,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let Given { samples, shape } = arrays::of::<f32>("views", views)?;
        arrays::check_shape("views", &shape, &self.views_shape())?;
        self.floats(py, progress, &self.volume_shape(), move |phantom, watch| {
            reconstructed(phantom, gate.0, &samples, |share| watch.tell(share), watch)
        })
    }

    /// A slice of the reconstruction of a gate, `[y][x]`, from the rows of the views that it needs.
    #[pyo3(signature = (z, gate = Whole(0), *, progress = None), text_signature = "($self, z, gate=0, *, progress=None)")]
    fn slice<'py>(
        &self,
        py: Python<'py>,
        z: Whole,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let [_, ny, nx] = self.volume_shape();
        self.floats(py, progress, &[ny, nx], move |phantom, _| {
            phantom.slice(gate.0, z.0)
        })
    }

    /// Voxelised ground truth of a gate, `[z][y][x]`: activity averaged over each voxel and over the time of the views.
    #[pyo3(signature = (gate = Whole(0), *, progress = None), text_signature = "($self, gate=0, *, progress=None)")]
    fn truth<'py>(&self, py: Python<'py>, gate: Whole, progress: Progress<'_, 'py>) -> Floats<'py> {
        self.floats(py, progress, &self.volume_shape(), move |phantom, _| {
            phantom.truth(gate.0)
        })
    }

    /// A slice of the ground truth of a gate, `[y][x]`.
    #[pyo3(signature = (z, gate = Whole(0), *, progress = None), text_signature = "($self, z, gate=0, *, progress=None)")]
    fn truth_slice<'py>(
        &self,
        py: Python<'py>,
        z: Whole,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Floats<'py> {
        let [_, ny, nx] = self.volume_shape();
        self.floats(py, progress, &[ny, nx], move |phantom, _| {
            phantom.truth_slice(gate.0, z.0)
        })
    }

    /// Ground truth of all gates, `[gate][z][y][x]`; shapes that several gates share are voxelised once.
    #[pyo3(signature = (*, progress = None))]
    fn truth_of_gates<'py>(&self, py: Python<'py>, progress: Progress<'_, 'py>) -> Floats<'py> {
        let [nz, ny, nx] = self.volume_shape();
        let shape = [self.phantom.n_gates(), nz, ny, nx];
        self.floats(py, progress, &shape, |phantom, _| phantom.truth_of_gates())
    }

    /// Activity at a phase, `[z][y][x]`, averaged over each voxel.
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

    /// Label with the largest volume fraction in each voxel at a phase, `uint8[z][y][x]`; `label_names` lists their names.
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

    /// Linear attenuation coefficient at a phase in 1/cm, `[z][y][x]`, averaged over each voxel.
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

    /// Motion of the wall from end-diastole at end-expiration to a phase.
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

    /// Inner and outer surface at a phase, in the lab.
    #[pyo3(signature = (phase, breath = 0.0))]
    fn meshes(&self, py: Python<'_>, phase: f64, breath: f64) -> Result<(PyMesh, PyMesh), Failure> {
        let at = self.moment(phase, breath)?;
        let meshes = self.made(py, None, move |phantom| phantom.meshes(at))?;
        Ok(meshes.map(PyMesh::from).into())
    }

    /// The body at a phase; its layers are bounded by the inner and the outer surface.
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

    /// Inner and outer membrane at a phase, with their pressures.
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

    /// Volume of the cavity in mL at given phases, `float64`, with the shape of the phases.
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

    /// Volumes in mL, ejection fraction, cardiac output, wall thickness: a dictionary, as in `report.json`.
    fn numbers<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::numbers)?)
    }

    /// The heart at the phases that represent the projections, at end-diastole and at end-systole: a list of dictionaries.
    fn phases<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::phase_reports)?)
    }

    /// Torsion, shortening and motion of the scene's points at the phases that represent the projections: a list of dictionaries.
    fn motion_reports<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::motion_reports)?)
    }

    /// R-R intervals during the acquisition, a dictionary of lists; `None` if all are equal and accepted.
    fn beats<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.beats())
    }

    /// Comparison of a volume of a gate with the ground truth, both `[z][y][x]`: streaks, unevenness of the wall, blur; a dictionary.
    #[pyo3(signature = (volume, truth, gate = Whole(0)), text_signature = "($self, volume, truth, gate=0)")]
    fn artefacts<'py>(
        &self,
        py: Python<'py>,
        volume: &Bound<'py, PyAny>,
        truth: &Bound<'py, PyAny>,
        gate: Whole,
    ) -> Any<'py> {
        let volume = arrays::of::<f32>("volume", volume)?;
        let truth = arrays::of::<f32>("truth", truth)?;
        for (what, given) in [("volume", &volume), ("truth", &truth)] {
            arrays::check_shape(what, &given.shape, &self.volume_shape())?;
        }
        let report = self.made(py, None, move |phantom| {
            phantom.artefacts(gate.0, &volume.samples, &truth.samples)
        })?;
        to_python(py, &report)
    }

    /// Estimated upper limit of the memory of `run` in bytes: a dictionary of `shapes`, `views`, `volumes`, and `each_thread`.
    fn memory<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.memory())
    }

    /// Work done so far: a dictionary of counters.
    fn work<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.work())
    }

    /// Computes and writes the products of `[output]`, and `report.json`, whose content is returned.
    ///
    /// Every file is written atomically, `report.json` last. Ctrl-C ends the run after the current step.
    #[pyo3(signature = (folder, *, progress = None))]
    fn run<'py>(&self, py: Python<'py>, folder: PathBuf, progress: Progress<'_, 'py>) -> Any<'py> {
        let phantom = self.phantom.clone();
        let report = work_at(py, progress, AtSignal::Wait, move |watch| {
            let _ = watch.tell(0.0);
            heart_phantom::run(&phantom, &folder, &|at| watch.tell(at.fraction))
        })?;
        self.warn(py)?;
        to_python(py, &report)
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

    /// Products of all gates as an `xarray.Dataset` with the coordinates of their axes in cm, s and rad; needs xarray.
    ///
    /// `products`: `"projections"`, `"truth"`, `"reconstruction"`.
    #[pyo3(signature = (products = vec!["projections".to_owned(), "truth".to_owned()], *, progress = None), text_signature = "($self, products=('projections', 'truth'), *, progress=None)")]
    fn to_xarray<'py>(
        slf: &Bound<'py, Self>,
        products: Vec<String>,
        progress: Progress<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let module = slf.py().import("heart_phantom._xarray")?;
        module.call_method1("dataset", (slf, products, progress))
    }

    fn _repr_html_(&self) -> String {
        folded(&self.__repr__(), self.phantom.scene())
    }

    fn __getnewargs__(&self) -> (PyScene,) {
        (self.scene(),)
    }
}
