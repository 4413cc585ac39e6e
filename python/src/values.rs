//! Conversion between Python values and values of scene files; names and counts in arguments.

use crate::errors::Failure;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// A count or an index: a non-negative integer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Whole(pub(crate) usize);

impl<'py> FromPyObject<'_, 'py> for Whole {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let whole = given.call_method0("__index__").map_err(|_| {
            let name = given.get_type();
            PyTypeError::new_err(format!("expected an integer, got {name}"))
        })?;
        let refused = |_| PyValueError::new_err(format!("{whole} is not a non-negative integer"));
        whole.extract().map(Self).map_err(refused)
    }
}

/// Converts to a value of a scene file. NumPy scalars and arrays count as numbers and lists.
pub(crate) fn to_toml(given: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(text) = given.cast::<PyString>() {
        return Ok(Value::String(text.to_string()));
    }
    if given.is_instance_of::<PyBool>() {
        return given.extract().map(Value::Boolean);
    }
    if given.is_instance_of::<PyInt>() {
        let refused = |_| PyValueError::new_err(format!("{given} has too many digits"));
        return given.extract().map(Value::Integer).map_err(refused);
    }
    if given.is_instance_of::<PyFloat>() {
        return given.extract().map(Value::Float);
    }
    if let Ok(mapping) = given.cast::<PyMapping>() {
        return to_table(mapping).map(Value::Table);
    }
    if given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        let items = given.try_iter()?.map(|item| to_toml(&item?));
        return items.collect::<PyResult<_>>().map(Value::Array);
    }
    if given.hasattr("tolist")? {
        return to_toml(&given.call_method0("tolist")?);
    }
    let name = given.get_type();
    Err(PyTypeError::new_err(format!(
        "a scene has texts, numbers, lists and dictionaries, no {name}"
    )))
}

/// Converts a dictionary; entries that are `None` are omitted.
pub(crate) fn to_table(mapping: &Bound<'_, PyMapping>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in entries(mapping)? {
        if !value.is_none() {
            table.insert(key, to_toml(&value)?);
        }
    }
    Ok(table)
}

/// Returns the entries of a dictionary, whose keys must be strings.
pub(crate) fn entries<'py>(
    mapping: &Bound<'py, PyMapping>,
) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let pairs = mapping.items()?;
    (pairs.iter())
        .map(|pair| {
            let (key, value): (Bound<'_, PyAny>, Bound<'py, PyAny>) = pair.extract()?;
            let refused = |_| PyTypeError::new_err(format!("the key {key} is no text"));
            Ok((key.extract().map_err(refused)?, value))
        })
        .collect()
}

/// Reads a value with the names of scene files: `"hann"`, `{"butterworth": {"order": 4}}`.
pub(crate) fn named<T: DeserializeOwned>(what: &str, given: &Bound<'_, PyAny>) -> PyResult<T> {
    to_toml(given)?
        .try_into()
        .map_err(|error: toml::de::Error| {
            let message = error.message().replace("unknown variant", "unknown name");
            PyValueError::new_err(format!("{what}: {message}"))
        })
}

/// Reads one of a few names.
pub(crate) fn choice<T: Clone>(what: &str, given: &str, among: &[(&str, T)]) -> PyResult<T> {
    let found = among.iter().find(|(name, _)| *name == given);
    found.map(|(_, value)| value.clone()).ok_or_else(|| {
        let names: Vec<_> = among.iter().map(|(name, _)| *name).collect();
        let names = names.join(", ");
        PyValueError::new_err(format!("{what} is {given:?}, must be one of {names}"))
    })
}

/// Converts a report to dictionaries, lists, strings and numbers.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    value: &impl Serialize,
) -> Result<Bound<'py, PyAny>, Failure> {
    let text = serde_json::to_string(value).map_err(|error| Failure::internal(&error))?;
    Ok(py.import("json")?.call_method1("loads", (text,))?)
}
