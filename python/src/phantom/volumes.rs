//! Reconstructions, ground truth, and their comparison.

use crate::arrays::{self, Given};
use crate::errors::Failure;
use crate::product::{Floats, PyPhantom, reconstructed, volume};
use crate::values::{Whole, to_python};
use crate::work::Progress;
use pyo3::prelude::*;

#[pymethods]
impl PyPhantom {
    /// Projects and reconstructs a gate by the method of the scene.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[z][y][x]`.
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

    /// Reconstructs given views of this camera by the method of the scene.
    ///
    /// Parameters
    /// ----------
    /// views : array_like
    ///     `[view][row][bin]`, for example those of `views` with other noise; converted to `float32`.
    /// gate : int
    ///     Index of the gated projection set that has their angles.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[z][y][x]`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the views have another shape.
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

    /// Reconstructs one slice of a gate, from the rows of the views that it needs.
    ///
    /// Parameters
    /// ----------
    /// z : int
    ///     Index of the slice.
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[y][x]`.
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If there is no such slice or gate.
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

    /// Computes the ground truth of a gate: activity averaged over each voxel and over the time of the views.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[z][y][x]`, to the `truth.tolerance` of the scene.
    #[pyo3(signature = (gate = Whole(0), *, progress = None), text_signature = "($self, gate=0, *, progress=None)")]
    fn truth<'py>(&self, py: Python<'py>, gate: Whole, progress: Progress<'_, 'py>) -> Floats<'py> {
        self.floats(py, progress, &self.volume_shape(), move |phantom, _| {
            phantom.truth(gate.0)
        })
    }

    /// Computes one slice of the ground truth of a gate.
    ///
    /// Parameters
    /// ----------
    /// z : int
    ///     Index of the slice.
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[y][x]`.
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If there is no such slice or gate.
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

    /// Computes the ground truth of all gates. Shapes that several gates share are voxelised once.
    ///
    /// Parameters
    /// ----------
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[gate][z][y][x]`.
    #[pyo3(signature = (*, progress = None))]
    fn truth_of_gates<'py>(&self, py: Python<'py>, progress: Progress<'_, 'py>) -> Floats<'py> {
        let [nz, ny, nx] = self.volume_shape();
        let shape = [self.phantom.n_gates(), nz, ny, nx];
        self.floats(py, progress, &shape, |phantom, _| phantom.truth_of_gates())
    }

    /// Compares a volume of a gate with the ground truth.
    ///
    /// Parameters
    /// ----------
    /// volume, truth : array_like
    ///     `[z][y][x]`, as `volume` and `truth` return them.
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Streaks, unevenness of the wall, blur and root mean square error.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an array has another shape.
    #[pyo3(signature = (volume, truth, gate = Whole(0), *, progress = None), text_signature = "($self, volume, truth, gate=0, *, progress=None)")]
    fn artefacts<'py>(
        &self,
        py: Python<'py>,
        volume: &Bound<'py, PyAny>,
        truth: &Bound<'py, PyAny>,
        gate: Whole,
        progress: Progress<'_, 'py>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let volume = arrays::of::<f32>("volume", volume)?;
        let truth = arrays::of::<f32>("truth", truth)?;
        for (what, given) in [("volume", &volume), ("truth", &truth)] {
            arrays::check_shape(what, &given.shape, &self.volume_shape())?;
        }
        let report = self.made(py, progress, move |phantom| {
            phantom.artefacts(gate.0, &volume.samples, &truth.samples)
        })?;
        to_python(py, &report)
    }
}
