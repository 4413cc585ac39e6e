//! Reading, validating and writing scenes.

use super::bytes::read_bytes;
use super::finding::{Finding, SceneError};
use super::study::Scene;
use super::{check, json, place, template};
use crate::error::PhantomError;
use serde::Serialize;
use std::path::Path;
use toml::Table;

/// Reads the text of a scene or a cohort.
///
/// # Errors
/// [`PhantomError::Read`] if the file cannot be read or exceeds 16 MiB; [`PhantomError::Scene`] unless it is UTF-8.
pub fn read_text(path: &Path) -> Result<String, PhantomError> {
    let bytes = read_bytes(path)?;
    String::from_utf8(bytes).map_err(|error| {
        let finding = place::not_text(error.as_bytes(), error.utf8_error());
        in_file(path, finding.into()).into()
    })
}

impl Scene {
    /// Reads and validates a scene; absent fields take their defaults.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] with line, column, field, value and allowed values.
    pub fn from_toml(text: &str) -> Result<Self, PhantomError> {
        Ok(Self::parse(text, Path::new(""))?)
    }

    /// Reads and validates a scene file.
    ///
    /// # Errors
    /// [`PhantomError::Read`] if the file cannot be read or exceeds 16 MiB; [`PhantomError::Scene`], with the file, for an invalid scene.
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        Ok(Self::read(path)?.0)
    }

    /// Reads a scene and its text.
    pub(crate) fn read(path: &Path) -> Result<(Self, String), PhantomError> {
        let text = read_text(path)?;
        match Self::parse(&text, path.parent().unwrap_or(path)) {
            Ok(scene) => Ok((scene, text)),
            Err(error) => Err(in_file(path, error).into()),
        }
    }

    /// Writes the scene as TOML with a comment on each field; [`Scene::from_toml`] restores the same scene.
    #[must_use]
    pub fn to_toml(&self) -> String {
        template::write(self)
    }

    /// Reads the JSON of [`Scene::to_json`]; omitted fields have their defaults. Values are not validated: [`Scene::check`] does that. Relative paths
    /// are relative to the working directory.
    ///
    /// ```
    /// use heart_phantom::Scene;
    /// let scene = Scene::from_json(r#"{"camera": {"views": 30}}"#)?;
    /// assert_eq!(scene.camera.views, 30);
    /// assert_eq!(Scene::from_json(&scene.to_json())?, scene);
    /// let error = Scene::from_json(r#"{"camera": {"views": -3}}"#).unwrap_err();
    /// assert_eq!(error.first().field, "camera.views");
    /// # Ok::<(), heart_phantom::scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] if the text is not JSON or repeats a key, or with the field of an unknown name or a value of another type. `null` is read as
    /// NaN, which [`Scene::check`] rejects: omit the field instead.
    pub fn from_json(text: &str) -> Result<Self, SceneError> {
        // Read as TOML: a second deserialiser of all sections would be large.
        let json = json::toml_of(text);
        let json = json.map_err(|error| Finding::new(None, "", error.to_string()))?;
        let text = json.as_table().map(Table::to_string);
        let text = text.ok_or_else(|| Finding::new(None, "", "a scene is an object"))?;
        let read = place::read_toml(&text);
        read.map_err(|finding| {
            Finding {
                place: None,
                ..finding
            }
            .into()
        })
    }

    /// Writes all fields as JSON, as in the report of a run; [`Scene::from_json`] restores the same scene.
    #[must_use]
    pub fn to_json(&self) -> String {
        json_text(self).unwrap_or_default() // text and numbers only
    }

    fn parse(text: &str, directory: &Path) -> Result<Self, SceneError> {
        let mut scene: Self = place::read_toml(text)?;
        scene.camera.relative_to(directory);
        match check::parts(scene, None) {
            Ok(parts) => Ok(parts.scene),
            Err(mut error) => {
                for finding in &mut error.findings {
                    finding.place = place::of_field(text, &finding.field);
                }
                Err(error)
            }
        }
    }
}

fn in_file(path: &Path, error: SceneError) -> SceneError {
    SceneError {
        file: Some(path.to_path_buf()),
        ..error
    }
}

/// Indented JSON; numbers that are not finite are null. Scenes and reports share one serialiser, because its code is large. An error for a path
/// that is not Unicode.
pub(super) fn json_text(value: &impl Serialize) -> serde_json::Result<String> {
    serde_json::to_string_pretty(value)
}
