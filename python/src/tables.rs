//! Views, their times, and volumes of a phantom.

use crate::arrays::array;
use crate::errors::Failure;
use heart_phantom::{Phantom, PhantomError, ViewTime};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A named column of a table of views.
type Column = (&'static str, fn(&ViewTime) -> f64);

/// Times and angles of views, a dictionary of `float64[view]`.
pub(crate) fn view_times<'py>(
    py: Python<'py>,
    times: &[ViewTime],
) -> Result<Bound<'py, PyDict>, Failure> {
    let made = PyDict::new(py);
    let columns: [Column; 4] = [
        ("start", |time| time.start),
        ("window", |time| time.window),
        ("phase", |time| time.phase),
        ("angle", |time| time.angle),
    ];
    for (name, of) in columns {
        let column: Vec<f64> = times.iter().map(of).collect();
        made.set_item(name, array(py, column, &[times.len()])?)?;
    }
    Ok(made)
}

/// Volumes of the cavity at phases.
pub(crate) fn cavity_volumes(
    phantom: &Phantom,
    phases: Vec<f64>,
) -> Result<Vec<f64>, PhantomError> {
    let [rest, _] = phantom.heart().reference_shape()?.volumes();
    let volume = |phase: f64| rest * (1.0 + phantom.cycle().gain(phase));
    Ok(phases.into_iter().map(volume).collect())
}
