//! Pickling of results: the call that made an object is repeated.

use crate::scene::PyScene;
use heart_phantom::Scene;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The call that made an object. Calls are deterministic, so that their repetition makes an equal object.
#[derive(Debug)]
pub(crate) struct Recipe {
    callable: Py<PyAny>,
    arguments: Py<PyTuple>,
    options: Option<Py<PyDict>>,
}

/// The return value of `__reduce__`.
pub(crate) type Reduced<'py> = PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)>;

impl Recipe {
    pub(crate) fn new<'py, A>(
        py: Python<'py>,
        callable: &Bound<'py, PyAny>,
        arguments: A,
    ) -> PyResult<Self>
    where
        A: IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>>,
        PyErr: From<A::Error>,
    {
        Ok(Self {
            callable: callable.clone().unbind(),
            arguments: arguments.into_pyobject(py)?.unbind(),
            options: None,
        })
    }

    /// Adds arguments by name, which are copied.
    pub(crate) fn with_options(mut self, options: &Bound<'_, PyDict>) -> PyResult<Self> {
        let copy = options.py().import("copy")?.getattr("deepcopy")?;
        self.options = Some(copy.call1((options,))?.cast_into::<PyDict>()?.unbind());
        Ok(self)
    }

    /// A method of the phantom of a scene; `item` selects from its results.
    pub(crate) fn of_phantom<'py>(
        py: Python<'py>,
        scene: &Scene,
        method: &str,
        arguments: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>,
        item: Option<usize>,
    ) -> PyResult<Self> {
        let callable = helper(py, "of_phantom")?;
        let arguments = arguments.into_pyobject(py)?;
        Self::new(
            py,
            &callable,
            (PyScene(scene.clone()), method, arguments, item),
        )
    }

    /// A property of an object.
    pub(crate) fn property<'py>(owner: &Bound<'py, PyAny>, name: &str) -> PyResult<Self> {
        let py = owner.py();
        let getattr = py.import("builtins")?.getattr("getattr")?;
        Self::new(py, &getattr, (owner, name))
    }

    pub(crate) fn reduced<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = self.arguments.bind(py).clone();
        match &self.options {
            None => Ok((self.callable.bind(py).clone(), arguments)),
            Some(options) => {
                let of_call = (self.callable.bind(py), arguments, options.bind(py));
                Ok((helper(py, "call")?, of_call.into_pyobject(py)?))
            }
        }
    }
}

fn helper<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("heart_phantom._recipes")?.getattr(name)
}
