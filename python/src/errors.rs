//! Conversion of errors of the crates to the Python exceptions of `heart_phantom/errors.py`.

use heart_cohort::CohortError;
use heart_phantom::membrane_newton::{MembraneError, NewtonError};
use heart_phantom::radon::RadonError;
use heart_phantom::revolve_voxel::RevolveError;
use heart_phantom::{PhantomError, chain};
use pyo3::exceptions::{PyFileExistsError, PyOSError, PyRuntimeError};
use pyo3::prelude::*;
use std::error::Error;
use std::io;
use std::path::Path;

/// All failures of a call.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    #[error(transparent)]
    Cohort(CohortError),
    #[error(transparent)]
    Radon(#[from] RadonError),
    #[error(transparent)]
    Revolve(#[from] RevolveError),
    #[error(transparent)]
    Newton(#[from] NewtonError),
    #[error(transparent)]
    Membrane(#[from] MembraneError),
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(transparent)]
    Python(#[from] PyErr),
}

impl Failure {
    /// Creates an internal error.
    pub(crate) fn internal(what: &dyn std::fmt::Display) -> Self {
        PyRuntimeError::new_err(format!(
            "a defect of heart_phantom, please report it: {what}"
        ))
        .into()
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        Python::attach(|py| match failure {
            Failure::Phantom(error) => of_phantom(py, error),
            Failure::Cohort(error) => exception(py, "HeartPhantomError", &error),
            Failure::Radon(error) => match of_operator(&error) {
                Some(raised) => raised.clone_ref(py),
                None => exception(py, "RadonError", &error),
            },
            Failure::Revolve(error) => exception(py, "RevolveError", &error),
            Failure::Newton(error) => exception(py, "MembraneError", &error),
            Failure::Membrane(error) => exception(py, "MembraneError", &error),
            Failure::Io(error) => error.into(),
            Failure::Python(error) => error,
        })
    }
}

/// The exception that an operator of the caller raised.
fn of_operator(error: &RadonError) -> Option<&PyErr> {
    error.source()?.downcast_ref()
}

fn of_phantom(py: Python<'_>, error: PhantomError) -> PyErr {
    let text = chain(&error);
    match &error {
        PhantomError::Scene(error) => {
            let first = error.first();
            scene_error(
                py,
                &text,
                (error.file.as_deref(), first.place),
                [&first.field, &first.given, &first.wanted],
            )
        }
        PhantomError::Rejected {
            file,
            place,
            field,
            source,
        } => {
            let wanted = chain(source.as_ref());
            scene_error(py, &text, (file.as_deref(), *place), [field, "", &wanted])
        }
        PhantomError::Radon(_) => exception(py, "RadonError", &error),
        PhantomError::Solid(_) => exception(py, "RevolveError", &error),
        PhantomError::Balloon(_) | PhantomError::Membrane(_) | PhantomError::Motion(_) => {
            exception(py, "MembraneError", &error)
        }
        PhantomError::Read { source, .. } | PhantomError::File { source, .. } => {
            io::Error::new(source.kind(), text).into()
        }
        PhantomError::Foreign { .. } | PhantomError::Listed { .. } => {
            PyFileExistsError::new_err(text)
        }
        PhantomError::Busy { .. } | PhantomError::Threads { .. } => PyOSError::new_err(text),
        _ => exception(py, "HeartPhantomError", &error),
    }
}

/// Creates an exception of `errors.py` with the messages of an error and of all its sources.
fn exception(py: Python<'_>, class: &str, error: &dyn Error) -> PyErr {
    made(py, class, &chain(error)).map_or_else(|error| error, PyErr::from_value)
}

fn made<'py>(py: Python<'py>, class: &str, text: &str) -> PyResult<Bound<'py, PyAny>> {
    let class = py.import("heart_phantom.errors")?.getattr(class)?;
    class.call1((text,))
}

fn scene_error(
    py: Python<'_>,
    text: &str,
    (file, place): (Option<&Path>, Option<[usize; 2]>),
    [field, given, wanted]: [&str; 3],
) -> PyErr {
    let with_places = || {
        let error = made(py, "SceneError", text)?;
        error.setattr("file", file.map(|file| file.display().to_string()))?;
        error.setattr("line", place.map(|[line, _]| line))?;
        error.setattr("column", place.map(|[_, column]| column))?;
        for (name, text) in [("field", field), ("given", given), ("wanted", wanted)] {
            error.setattr(name, text)?;
        }
        Ok(PyErr::from_value(error))
    };
    with_places().unwrap_or_else(|error| error)
}
