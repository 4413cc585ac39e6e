//! Scattered photons as arrays.

use crate::arrays::array;
use crate::errors::Failure;
use crate::work::{Progress, work};
use heart_phantom::{Phantom, PhantomError};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::Arc;

pub(crate) type Scattered<'py> = Result<Option<[Bound<'py, PyArrayDyn<f64>>; 2]>, Failure>;

/// Samples and standard errors of a gate in an energy window, `[view][row][bin]`.
pub(crate) fn arrays<'py>(
    py: Python<'py>,
    progress: Progress<'_, 'py>,
    phantom: &Arc<Phantom>,
    [gate, window]: [usize; 2],
) -> Scattered<'py> {
    let settings = phantom.scene().scatter.as_ref();
    let n_windows = settings.map_or(1, |settings| settings.windows.len());
    if window >= n_windows {
        let text = format!("window is {window}, and the scene has {n_windows}");
        return Err(PyValueError::new_err(text).into());
    }
    let camera = phantom.camera();
    let shape = [camera.n_views(), camera.n_rows(), camera.n_bins()];
    let phantom = phantom.clone();
    let made = work(py, progress, move |_| {
        let scatter = phantom.scatter(gate)?;
        Ok::<_, PhantomError>(scatter.map(|scatter| {
            let samples = (0..shape[0]).flat_map(|view| scatter.view(window, view));
            let errors = (0..shape[0]).flat_map(|view| scatter.standard_error(window, view));
            [samples.collect::<Vec<f64>>(), errors.collect()]
        }))
    })?;
    let Some([samples, errors]) = made else {
        return Ok(None);
    };
    Ok(Some([
        array(py, samples, &shape)?,
        array(py, errors, &shape)?,
    ]))
}
