//! Scenes from and to text, checked.

use super::finding::SceneError;
use super::study::Scene;
use super::{check, place, template};
use crate::error::PhantomError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// No scene is longer; a device may be.
const MOST_BYTES: u64 = 1 << 24;

impl Scene {
    /// Reads a scene and checks it; what is left out is the default.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] with line, column and field, what was given and what would be right.
    pub fn from_toml(text: &str) -> Result<Self, PhantomError> {
        Self::parse(text).map_err(|error| PhantomError::Scene(Box::new(error)))
    }

    /// Reads a scene from a file.
    ///
    /// # Errors
    /// [`PhantomError::Read`] if the file cannot be read or has more than 16 MiB; [`PhantomError::Scene`] that names the file besides.
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        Ok(Self::read(path)?.0)
    }

    /// A scene and the text that it was read from.
    pub(crate) fn read(path: &Path) -> Result<(Self, String), PhantomError> {
        let read = |path| {
            let mut bytes = Vec::new();
            let file = File::open(path)?;
            file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
            if bytes.len() as u64 > MOST_BYTES {
                return Err(io::ErrorKind::FileTooLarge.into());
            }
            Ok(bytes)
        };
        let bytes = read(path).map_err(|source| PhantomError::Read {
            path: path.to_path_buf(),
            source,
        })?;
        let parsed = match String::from_utf8(bytes) {
            Ok(text) => Self::parse(&text).map(|scene| (scene, text)),
            Err(error) => Err(place::not_text(error.as_bytes(), error.utf8_error()).into()),
        };
        parsed.map_err(|mut error| {
            error.file = Some(path.to_path_buf());
            PhantomError::Scene(Box::new(error))
        })
    }

    /// The scene as a file with a comment on each field; [`Scene::from_toml`] gives the same scene back.
    pub fn to_toml(&self) -> String {
        template::write(self)
    }

    fn parse(text: &str) -> Result<Self, SceneError> {
        let scene: Self = toml::from_str(text).map_err(|error| place::syntax(text, &error))?;
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
