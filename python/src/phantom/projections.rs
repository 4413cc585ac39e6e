//! Projections, and their times and angles.

use crate::arrays::array;
use crate::errors::Failure;
use crate::product::{Floats, PyPhantom};
use crate::radon::PyGeometry;
use crate::scatter::{self, Scattered};
use crate::tables;
use crate::values::Whole;
use crate::work::Progress;
use heart_phantom::no_observer;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pymethods]
impl PyPhantom {
    /// Computes the projections of a gate, with the response and noise of the scene.
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
    ///     `float32[view][row][bin]`, activity times cm.
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If there is no such gate, or the shapes cannot be solved.
    #[pyo3(signature = (gate = Whole(0), *, progress = None), text_signature = "($self, gate=0, *, progress=None)")]
    fn views<'py>(&self, py: Python<'py>, gate: Whole, progress: Progress<'_, 'py>) -> Floats<'py> {
        self.floats(py, progress, &self.views_shape(), move |phantom, _| {
            Ok(phantom.sinograms(gate.0, &no_observer)?.samples)
        })
    }

    /// Computes one projection of a gate.
    ///
    /// Parameters
    /// ----------
    /// view : int
    ///     Index of the view.
    /// gate : int
    ///     Index of the gated projection set.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[row][bin]`, bitwise identical to that of `views`.
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If there is no such view or gate.
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

    /// Computes the scattered photons in the projections of a gate.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    /// window : int
    ///     Index of the energy window.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// list of ndarray, or None
    ///     Samples and their standard errors, `float64[view][row][bin]`; `None` without a section `[scatter]` or without activity.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If there is no such window.
    /// HeartPhantomError
    ///     If there is no such gate, or the tolerance is not reached.
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

    /// Computes the projections of all gates. Shapes that several gates share are projected once.
    ///
    /// Parameters
    /// ----------
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float32[gate][view][row][bin]`.
    #[pyo3(signature = (*, progress = None))]
    fn views_of_gates<'py>(&self, py: Python<'py>, progress: Progress<'_, 'py>) -> Floats<'py> {
        let [views, rows, bins] = self.views_shape();
        let shape = [self.phantom.n_gates(), views, rows, bins];
        self.floats(py, progress, &shape, |phantom, _| {
            phantom.sinograms_of_gates()
        })
    }

    /// Returns the angles of the views of a gate, averaged over their time.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[view]`, radians.
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

    /// Returns times and angles of the views of a gate.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `float64[view]` by name: `start` and `window`, the acquisition time, in seconds; `phase`, the cardiac phase at the start; `angle` in
    ///     radians.
    #[pyo3(signature = (gate = Whole(0)), text_signature = "($self, gate=0)")]
    fn view_times<'py>(&self, py: Python<'py>, gate: Whole) -> Result<Bound<'py, PyDict>, Failure> {
        tables::view_times(py, &self.phantom.view_times(gate.0)?)
    }

    /// Returns angles and bins of a gate, for `heart_phantom.radon`.
    ///
    /// Parameters
    /// ----------
    /// gate : int
    ///     Index of the gated projection set.
    ///
    /// Returns
    /// -------
    /// heart_phantom.radon.Geometry
    #[pyo3(signature = (gate = Whole(0)), text_signature = "($self, gate=0)")]
    fn geometry(&self, gate: Whole) -> Result<PyGeometry, Failure> {
        Ok(PyGeometry(self.phantom.geometry(gate.0)?))
    }
}
