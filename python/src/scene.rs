//! Scenes: the description of a study as data.

use crate::errors::Failure;
use crate::values::{Whole, entries, to_python, to_table, to_toml};
use heart_phantom::{PhantomError, Scene};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyMapping, PyString};
use std::path::PathBuf;
use toml::map::Entry;
use toml::{Table, Value};

/// The complete description of a study, as in a scene file. Absent fields have the defaults of the study of Rohmer et al. 2006.
///
/// Lengths are in cm, times in seconds, angles in degrees (radians everywhere else), volumes in mL. A scene is immutable; `replace` returns
/// a changed copy. `Scene.template()` has a comment on every field.
///
/// Parameters
/// ----------
/// changes : dict, optional
///     Sections, or fields by their dotted names.
/// **sections : dict
///     Sections by their names.
///
/// Raises
/// ------
/// SceneError
///     If a field is unknown or a value is invalid.
///
/// Examples
/// --------
/// >>> from heart_phantom import Scene
/// >>> scene = Scene(camera={"views": 60, "bins": 64, "rows": 64, "pitch": [0.25, 0.25]})
/// >>> scene["camera.views"]
/// 60
/// >>> blurred = scene.replace(blur={"fwhm": 0.8})
/// >>> blurred.replace({"camera.views": 30})["blur.fwhm"]
/// 0.8
/// >>> Scene(camera={"views": -3})
/// Traceback (most recent call last):
///     ...
/// heart_phantom.errors.SceneError: camera.views is -3; ...
#[pyclass(name = "Scene", module = "heart_phantom", frozen, eq)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PyScene(pub(crate) Scene);

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (changes = None, **sections))]
    fn new(
        changes: Option<&Bound<'_, PyMapping>>,
        sections: Option<&Bound<'_, PyMapping>>,
    ) -> Result<Self, Failure> {
        Self(Scene::default()).replace(changes, sections)
    }

    /// Reads a scene from TOML text.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     The content of a scene file.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     If the text is invalid, with line, column and field.
    ///
    /// Examples
    /// --------
    /// >>> Scene.from_toml("[camera]\nviews = 60\n")["camera.views"]
    /// 60
    /// >>> try:
    /// ...     Scene.from_toml("[camera]\nviews = -3\n")
    /// ... except SceneError as error:
    /// ...     print(error.line, error.column, error.field)
    /// 2 9 camera.views
    #[staticmethod]
    fn from_toml(text: &str) -> Result<Self, Failure> {
        Ok(Self(Scene::from_toml(text)?))
    }

    /// Reads a scene file.
    ///
    /// Parameters
    /// ----------
    /// path : path_like
    ///     The file.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If the file cannot be read.
    /// SceneError
    ///     If its text is invalid, with file, line, column and field.
    #[staticmethod]
    fn load(path: PathBuf) -> Result<Self, Failure> {
        Ok(Self(Scene::load(&path)?))
    }

    /// Returns a scene file with a comment on every field, as `heart-phantom init` writes it.
    ///
    /// Returns
    /// -------
    /// str
    ///
    /// Examples
    /// --------
    /// >>> Scene.from_toml(Scene.template()) == Scene()
    /// True
    #[staticmethod]
    fn template() -> String {
        Scene::default().to_toml()
    }

    /// Returns the scene as TOML text with a comment on every field.
    ///
    /// Returns
    /// -------
    /// str
    ///     `from_toml` of it is the same scene.
    fn to_toml(&self) -> String {
        self.0.to_toml()
    }

    /// Returns the scene as dictionaries, lists, strings and numbers, with defaults.
    ///
    /// Returns
    /// -------
    /// dict
    ///     `Scene(...)` of it is the same scene.
    fn to_dict<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        to_python(py, &self.0)
    }

    /// Returns a scene with changed fields.
    ///
    /// Parameters
    /// ----------
    /// changes : dict, optional
    ///     Values by section or by dotted name, which addresses nested fields; `None` resets a section or field to its default.
    /// **sections : dict
    ///     Fields of sections. The named fields are replaced as a whole.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     If a field is unknown or a value is invalid.
    ///
    /// Examples
    /// --------
    /// >>> scene = Scene().replace(heart={"inner": {"radius": 1.6}}, blur={"fwhm": 0.8})
    /// >>> scene.replace({"heart.inner.radius": 1.7, "blur": None})["heart.inner"]["radius"]
    /// 1.7
    #[pyo3(signature = (changes = None, **sections))]
    fn replace(
        &self,
        changes: Option<&Bound<'_, PyMapping>>,
        sections: Option<&Bound<'_, PyMapping>>,
    ) -> Result<Self, Failure> {
        let mut table = Table::try_from(&self.0).map_err(|error| Failure::internal(&error))?;
        for mapping in [changes, sections].into_iter().flatten() {
            for (name, value) in entries(mapping)? {
                change(&mut table, &name, &value)?;
            }
        }
        let text = toml::to_string(&table).map_err(|error| Failure::internal(&error))?;
        Ok(Self(Scene::from_toml(&text).map_err(without_place)?))
    }

    /// Returns the scene at another resolution in the same field of view.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     Number of bins, rows and pixels per side.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the size is 0, or too large.
    ///
    /// Examples
    /// --------
    /// >>> Scene().with_size(32)["camera.pitch"]
    /// [0.5, 0.5]
    fn with_size(&self, n: Whole) -> Result<Self, Failure> {
        if n.0 == 0 {
            return Err(PyValueError::new_err("the size is 0, must be at least 1").into());
        }
        let scene = self.0.clone().with_size(n.0);
        scene.check().map_err(PhantomError::from)?;
        Ok(Self(scene))
    }

    /// Returns a section or field by its dotted name.
    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        name: &Bound<'py, PyString>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let mut found = self.to_dict(py)?;
        for part in name.to_string().split('.') {
            let next = found.cast::<PyMapping>().ok().map(|m| m.get_item(part));
            found = match next {
                Some(Ok(next)) => next,
                _ => return Err(PyKeyError::new_err(name.to_string()).into()),
            };
        }
        Ok(found)
    }

    /// Returns the names of the sections.
    ///
    /// Returns
    /// -------
    /// dict_keys
    fn keys<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        Ok(self.to_dict(py)?.call_method0("keys")?)
    }

    /// Returns the sections.
    ///
    /// Returns
    /// -------
    /// dict_values
    fn values<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        Ok(self.to_dict(py)?.call_method0("values")?)
    }

    /// Returns pairs of the name of a section and the section.
    ///
    /// Returns
    /// -------
    /// dict_items
    fn items<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        Ok(self.to_dict(py)?.call_method0("items")?)
    }

    /// Returns a section or field.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Dotted name.
    /// default : optional
    ///     The value if there is no such field.
    ///
    /// Returns
    /// -------
    /// dict, list, str, float, int or bool
    ///     The section or field, or `default`.
    #[pyo3(signature = (name, default = None))]
    fn get<'py>(
        &self,
        name: &Bound<'py, PyString>,
        default: Option<Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let py = name.py();
        match self.__getitem__(py, name) {
            Err(Failure::Python(error)) if error.is_instance_of::<PyKeyError>(py) => {
                Ok(default.unwrap_or_else(|| py.None().into_bound(py)))
            }
            found => found,
        }
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        let name = name.cast::<PyString>();
        name.is_ok_and(|name| self.__getitem__(name.py(), name).is_ok())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyIterator>, Failure> {
        Ok(self.to_dict(py)?.try_iter()?)
    }

    fn __len__(&self, py: Python<'_>) -> Result<usize, Failure> {
        Ok(self.to_dict(py)?.len()?)
    }

    fn _repr_html_(&self) -> String {
        folded(&self.__repr__(), &self.0)
    }

    fn __repr__(&self) -> String {
        let camera = &self.0.camera;
        let mode = toml::Value::try_from(self.0.acquisition.mode);
        let mode = mode.map_or_else(|_| String::new(), |mode| brief(&mode));
        let (views, bins, rows) = (camera.views, camera.bins, camera.rows);
        format!("<Scene: {mode}, {views} views of {rows} x {bins} samples>")
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>,), Failure> {
        Ok((self.to_dict(py)?,))
    }
}

/// The scene file below a line that unfolds it.
pub(crate) fn folded(line: &str, scene: &Scene) -> String {
    let escaped = |text: &str| {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        text.replace('>', "&gt;")
    };
    let (line, text) = (escaped(line), escaped(&scene.to_toml()));
    format!("<details><summary><code>{line}</code></summary><pre>{text}</pre></details>")
}

/// Changes a section, or the field of a dotted name.
fn change(table: &mut Table, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if let Some((section, rest)) = name.split_once('.') {
        let inner = match table.entry(section) {
            Entry::Vacant(entry) => entry.insert(Value::Table(Table::new())),
            Entry::Occupied(entry) => entry.into_mut(),
        };
        let Value::Table(inner) = inner else {
            let text = format!("{section} has no fields; replace it as a whole");
            return Err(PyValueError::new_err(text));
        };
        return match rest.contains('.') {
            true => change(inner, rest, value),
            false => put(inner, rest, value),
        };
    }
    match (table.get_mut(name), value.cast::<PyMapping>()) {
        (Some(Value::Table(section)), Ok(fields)) => {
            (entries(fields)?.iter()).try_for_each(|(field, value)| put(section, field, value))
        }
        (_, Ok(fields)) => {
            table.insert(name.to_owned(), Value::Table(to_table(fields)?));
            Ok(())
        }
        (_, Err(_)) => put(table, name, value),
    }
}

fn put(table: &mut Table, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    match value.is_none() {
        true => table.remove(name),
        false => table.insert(name.to_owned(), to_toml(value)?),
    };
    Ok(())
}

/// Removes line numbers of a text that the user has not written.
fn without_place(mut error: PhantomError) -> PhantomError {
    if let PhantomError::Scene(error) = &mut error {
        for finding in &mut error.findings {
            finding.place = None;
        }
    }
    error
}

/// A mode on one line: `whole-cycle`, `gated (gates 16)`.
fn brief(mode: &Value) -> String {
    match mode {
        Value::String(name) => name.clone(),
        Value::Table(table) => {
            let parts: Vec<_> = (table.iter())
                .map(|(name, value)| match value {
                    Value::Table(fields) => {
                        let fields: Vec<_> = (fields.iter())
                            .map(|(field, value)| format!("{field} {value}"))
                            .collect();
                        format!("{name} ({})", fields.join(", "))
                    }
                    value => format!("{name} {value}"),
                })
                .collect();
            parts.join(", ")
        }
        other => other.to_string(),
    }
}

/// Converts the argument of a phantom: a scene, a dictionary, or nothing for the study.
pub(crate) fn scene_of(given: Option<&Bound<'_, PyAny>>) -> Result<Scene, Failure> {
    let Some(given) = given else {
        return Ok(Scene::default());
    };
    if let Ok(scene) = given.cast::<PyScene>() {
        return Ok(scene.get().0.clone());
    }
    if let Ok(mapping) = given.cast::<PyMapping>() {
        return Ok(PyScene::new(Some(mapping), None)?.0);
    }
    let name = given.get_type();
    let text = format!(
        "a Scene or a dictionary is needed, got {name}; of a text there is Scene.from_toml, of a file Scene.load"
    );
    Err(pyo3::exceptions::PyTypeError::new_err(text).into())
}
