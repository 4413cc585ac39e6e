//! Reports, and the run of a scene.

use crate::errors::Failure;
use crate::product::PyPhantom;
use crate::values::to_python;
use crate::work::{AtSignal, Progress, work_at};
use heart_phantom::Phantom;
use pyo3::prelude::*;
use std::path::PathBuf;

type Any<'py> = Result<Bound<'py, PyAny>, Failure>;

#[pymethods]
impl PyPhantom {
    /// A phase of end-systole and one of end-diastole.
    #[getter]
    fn extreme_phases(&self) -> (f64, f64) {
        self.phantom.cycle().extreme_phases().into()
    }

    /// Returns volumes in mL, ejection fraction, cardiac output and wall thickness, as in `report.json`.
    ///
    /// Returns
    /// -------
    /// dict
    fn numbers<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::numbers)?)
    }

    /// Describes the heart at the phases that represent the projections, at end-diastole and at end-systole.
    ///
    /// Returns
    /// -------
    /// list of dict
    fn phases<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::phase_reports)?)
    }

    /// Returns torsion, shortening and motion of the scene's points at the phases that represent the projections.
    ///
    /// Returns
    /// -------
    /// list of dict
    fn motion_reports<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.made(py, None, Phantom::motion_reports)?)
    }

    /// Returns the R-R intervals during the acquisition.
    ///
    /// Returns
    /// -------
    /// dict or None
    ///     Lists by name; `None` if all intervals are equal and accepted.
    fn beats<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.beats())
    }

    /// Lists values of the scene that are allowed, but probably not intended.
    ///
    /// The first projections, volume or run issue them as `SceneWarning`.
    ///
    /// Returns
    /// -------
    /// list of str
    pub(crate) fn warnings(&self, py: Python<'_>) -> Result<Vec<String>, Failure> {
        let warnings = self.made(py, None, Phantom::warnings)?;
        Ok(warnings.iter().map(ToString::to_string).collect())
    }

    /// Estimates the upper limit of the memory of `run`.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Bytes: `shapes`, `views`, `volumes`, and `each_thread`.
    fn memory<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.memory())
    }

    /// Returns counters of the work done so far.
    ///
    /// Returns
    /// -------
    /// dict
    fn work<'py>(&self, py: Python<'py>) -> Any<'py> {
        to_python(py, &self.phantom.work())
    }

    /// Computes and writes the products of `[output]`.
    ///
    /// Each file is written atomically, `report.json` last. Ctrl-C ends the run after the current step.
    ///
    /// Parameters
    /// ----------
    /// folder : path_like
    ///     The directory of the files.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// dict
    ///     The content of `report.json`.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If a file cannot be written, or the directory contains files of another origin.
    /// HeartPhantomError
    ///     If a product cannot be computed.
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

    /// Returns products of all gates with the coordinates of their axes in cm, s and rad; needs xarray.
    ///
    /// Parameters
    /// ----------
    /// products : sequence of str
    ///     `"projections"`, `"truth"`, `"reconstruction"`.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// xarray.Dataset
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a product is unknown.
    #[pyo3(signature = (products = vec!["projections".to_owned(), "truth".to_owned()], *, progress = None), text_signature = "($self, products=('projections', 'truth'), *, progress=None)")]
    fn to_xarray<'py>(
        slf: &Bound<'py, Self>,
        products: Vec<String>,
        progress: Progress<'_, 'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let module = slf.py().import("heart_phantom._xarray")?;
        module.call_method1("dataset", (slf, products, progress))
    }
}
