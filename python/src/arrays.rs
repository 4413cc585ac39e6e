//! Conversion of NumPy arrays.
//!
//! Inputs are copied, so that other threads cannot change them while the interpreter's lock is released. Outputs are transferred without a
//! copy.

use crate::errors::Failure;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{
    Element, IntoPyArray, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods, dtype,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Creates an array for Python, last index fastest.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    samples: Vec<T>,
    shape: &[usize],
) -> Result<Bound<'py, PyArrayDyn<T>>, Failure> {
    let made = ArrayD::from_shape_vec(IxDyn(shape), samples);
    let made = made.map_err(|error| Failure::internal(&error))?;
    Ok(made.into_pyarray(py))
}

/// Samples in their original precision: single for NumPy's `float32`, double for all other real numbers.
#[derive(Debug)]
pub(crate) enum Samples {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

/// An array from Python.
#[derive(Debug)]
pub(crate) struct Given<T> {
    pub(crate) samples: T,
    pub(crate) shape: Vec<usize>,
}

/// Reads real numbers in their precision.
pub(crate) fn samples(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Given<Samples>> {
    let array = real(what, given)?;
    let single = array.dtype().is_equiv_to(&dtype::<f32>(given.py()));
    Ok(Given {
        samples: match single {
            true => Samples::Single(copied(&array)?),
            false => Samples::Double(copied(&array)?),
        },
        shape: array.shape().to_vec(),
    })
}

/// Converts real numbers to a given precision.
pub(crate) fn of<T: Element + Copy>(
    what: &str,
    given: &Bound<'_, PyAny>,
) -> PyResult<Given<Vec<T>>> {
    let array = real(what, given)?;
    Ok(Given {
        samples: copied(&array)?,
        shape: array.shape().to_vec(),
    })
}

/// Reads a list of numbers.
pub(crate) fn numbers(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let Given { samples, shape } = of(what, given)?;
    match shape.len() {
        1 => Ok(samples),
        _ => Err(wrong_shape(what, &shape, "one axis")),
    }
}

/// Reads a list of points of N coordinates.
pub(crate) fn points<const N: usize>(
    what: &str,
    given: &Bound<'_, PyAny>,
) -> PyResult<Vec<[f64; N]>> {
    let Given { samples, shape } = of::<f64>(what, given)?;
    if shape.len() != 2 || shape[1] != N {
        return Err(wrong_shape(what, &shape, &format!("(n, {N})")));
    }
    let (points, _) = samples.as_chunks::<N>();
    Ok(points.to_vec())
}

/// Rejects an array of another shape.
pub(crate) fn check_shape(what: &str, given: &[usize], expected: &[usize]) -> PyResult<()> {
    match given == expected {
        true => Ok(()),
        false => Err(wrong_shape(what, given, &shown(expected))),
    }
}

/// Returns the error for an array of a wrong shape.
pub(crate) fn wrong_shape(what: &str, given: &[usize], expected: &str) -> PyErr {
    let given = shown(given);
    PyValueError::new_err(format!("{what} has the shape {given}, expected {expected}"))
}

/// Formats a shape as Python does.
pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => {
            let sizes: Vec<_> = shape.iter().map(ToString::to_string).collect();
            format!("({})", sizes.join(", "))
        }
    }
}

fn real<'py>(what: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = given.py().import("numpy")?;
    if given.is_instance(&numpy.getattr("ma")?.getattr("MaskedArray")?)? {
        let masked: usize = numpy
            .getattr("ma")?
            .call_method1("count_masked", (given,))?
            .extract()?;
        if masked > 0 {
            let text =
                format!("{what} has {masked} masked entries; fill them, for example with `filled`");
            return Err(PyValueError::new_err(text));
        }
    }
    let array = numpy.call_method1("asarray", (given,))?;
    let array = array.cast_into::<PyUntypedArray>()?;
    match array.dtype().kind() {
        b'i' | b'u' | b'f' => Ok(array),
        _ => {
            let kind = array.dtype();
            let text = format!("{what} must hold real numbers, not {kind}");
            Err(PyTypeError::new_err(text))
        }
    }
}

fn copied<T: Element + Copy>(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<T>> {
    let py = array.py();
    let options = PyDict::new(py);
    options.set_item("order", "C")?;
    options.set_item("copy", false)?;
    let array = array.call_method("astype", (dtype::<T>(py),), Some(&options))?;
    let array = array.cast_into::<PyArrayDyn<T>>()?;
    Ok(array.try_readonly()?.as_slice()?.to_vec())
}
