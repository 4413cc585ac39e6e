//! Cohorts, and the command line program.

use crate::errors::Failure;
use crate::scene::PyScene;
use crate::values::{Whole, to_python};
use heart_cohort::{Cohort, CohortError};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::ffi::OsString;
use std::path::PathBuf;

/// A set of studies: a scene and distributions of its fields. Member i is a function of the text and i.
///
/// Parameters
/// ----------
/// text : str
///     A cohort in TOML; `Cohort.template()` has a comment on every field.
///
/// Raises
/// ------
/// SceneError
///     If the text is invalid, with line, column and field.
///
/// Examples
/// --------
/// >>> from heart_phantom import Cohort
/// >>> cohort = Cohort("""
/// ... members = 100
/// ... constraints = ["heart.outer.radius > heart.inner.radius + 0.8"]
/// ... [vary]
/// ... heart.inner.radius = { uniform = [1.5, 2.0] }
/// ... heart.outer.radius = { normal = { mean = 2.75, sd = 0.3, bounds = [2.2, 3.3] } }
/// ... """)
/// >>> len(cohort)
/// 100
/// >>> scene = cohort.member(17)
/// >>> scene["heart.outer"]["radius"] > scene["heart.inner"]["radius"] + 0.8
/// True
#[pyclass(name = "Cohort", module = "heart_phantom", frozen)]
#[derive(Debug)]
pub(crate) struct PyCohort {
    cohort: Cohort,
    source: Source,
}

/// The origin of a cohort, for pickling.
#[derive(Debug)]
enum Source {
    Text(String),
    /// The path of a base scene is relative to the file.
    File(PathBuf),
}

#[pymethods]
impl PyCohort {
    #[new]
    fn new(text: String) -> Result<Self, Failure> {
        Ok(Self {
            cohort: Cohort::from_toml(&text)?,
            source: Source::Text(text),
        })
    }

    /// Reads a cohort file.
    ///
    /// Parameters
    /// ----------
    /// path : path_like
    ///     The file; the path of a base scene is relative to it.
    ///
    /// Returns
    /// -------
    /// Cohort
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If the file cannot be read.
    /// SceneError
    ///     If its text is invalid.
    #[staticmethod]
    fn load(path: PathBuf) -> Result<Self, Failure> {
        Ok(Self {
            cohort: Cohort::load(&path)?,
            source: Source::File(std::path::absolute(path)?),
        })
    }

    /// Returns a cohort text with a comment on every field.
    ///
    /// Returns
    /// -------
    /// str
    #[staticmethod]
    fn template() -> &'static str {
        Cohort::TEMPLATE
    }

    /// The scene of a member.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     From 0.
    ///
    /// Returns
    /// -------
    /// Scene
    ///     With the drawn values.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     If there is no such member.
    /// HeartPhantomError
    ///     If no draw meets the constraints, or the drawn values are not a valid scene: a rejected member.
    fn member(&self, index: Whole) -> Result<PyScene, Failure> {
        Ok(PyScene(self.cohort.member(index.0 as u64)?.scene()?))
    }

    /// The drawn values of a member.
    ///
    /// Parameters
    /// ----------
    /// index : int
    ///     From 0.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `key`, the name in shards; `case` and `case_index`; `split`, `"train"`, `"validation"`, `"test"` or `None`; `attempts`, the number
    ///     of draws; `values`, by the dotted names of the varied fields.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     If there is no such member.
    fn draw<'py>(&self, py: Python<'py>, index: Whole) -> Result<Bound<'py, PyDict>, Failure> {
        let member = self.cohort.member(index.0 as u64)?;
        let values = PyDict::new(py);
        for (path, value) in &member.values {
            values.set_item(path, to_python(py, value)?)?;
        }
        let made = PyDict::new(py);
        made.set_item("key", member.key)?;
        made.set_item("case", member.case)?;
        made.set_item("case_index", member.case_index)?;
        made.set_item("split", to_python(py, &member.split)?)?;
        made.set_item("attempts", member.attempts)?;
        made.set_item("values", values)?;
        Ok(made)
    }

    /// Dotted names of the varied fields.
    #[getter]
    fn varied(&self) -> Vec<&str> {
        self.cohort.varied().collect()
    }

    /// Names of the cases; one empty name without cases.
    #[getter]
    fn cases(&self) -> Vec<&str> {
        self.cohort.cases().collect()
    }

    /// Hash of the parsed text; comments and layout do not change it.
    #[getter]
    fn digest(&self) -> &str {
        self.cohort.digest()
    }

    fn __len__(&self) -> usize {
        usize::try_from(self.cohort.members()).unwrap_or(usize::MAX)
    }

    /// As `member`; a negative index counts from the end.
    fn __getitem__(&self, index: isize) -> Result<PyScene, Failure> {
        let from_end = || self.__len__().checked_sub(index.unsigned_abs());
        let found = usize::try_from(index).ok().or_else(from_end);
        self.member(Whole(found.unwrap_or(usize::MAX)))
    }

    fn __repr__(&self) -> String {
        let (members, varied) = (self.cohort.members(), self.cohort.varied().count());
        format!("<Cohort: {members} members, {varied} varied fields>")
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let class = py.get_type::<Self>();
        Ok(match &self.source {
            Source::Text(text) => (class.into_any(), (text,).into_pyobject(py)?),
            Source::File(path) => (class.getattr("load")?, (path,).into_pyobject(py)?),
        })
    }
}

impl From<CohortError> for Failure {
    fn from(error: CohortError) -> Self {
        match error {
            CohortError::Phantom(error) => error.into(),
            CohortError::NoMember { .. } => PyIndexError::new_err(error.to_string()).into(),
            error => Self::Cohort(error),
        }
    }
}

/// Runs the program `heart-phantom`. Signals end the process.
///
/// Parameters
/// ----------
/// arguments : sequence of str
///     The name of the program and its arguments.
///
/// Returns
/// -------
/// int
///     The exit code.
#[pyfunction]
pub(crate) fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| heart_study::command_line(arguments))
}
