//! What is wrong with a scene.

use crate::text::{shown, shown_path};
use std::fmt;
use std::path::{Path, PathBuf};

/// Where in which file, before a message.
pub(crate) fn place_in(file: Option<&Path>, place: Option<[usize; 2]>) -> String {
    match (file.map(shown_path), place) {
        (Some(file), Some([line, column])) => format!("{file}:{line}:{column}: "),
        (Some(file), None) => format!("{file}: "),
        (None, Some([line, column])) => format!("line {line}, column {column}: "),
        (None, None) => String::new(),
    }
}

/// What is wrong with a scene, and where. Shown on one line, with escapes for what a terminal would not show; what stands in the
/// file is cut where it is long.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SceneError {
    /// The file, if it came from one.
    pub file: Option<PathBuf>,
    /// Line and column, from 1; `None` for a scene without a text, or a field that its text leaves out.
    pub place: Option<[usize; 2]>,
    /// The field, such as `camera.views`, or `defects.1.s` of the first section `[[defects]]` (they count from 1, as their labels do);
    /// empty where the text is no TOML.
    // tidy: allow string: the path of a field in the file
    pub field: String,
    /// What stands there; empty where nothing does, or a name that means nothing.
    // tidy: allow string: the user's own text
    pub given: String,
    /// What would be right.
    // tidy: allow string: ranges, lists and the parser's words
    pub wanted: String,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&place_in(self.file.as_deref(), self.place))?;
        let [field, given, wanted] =
            [&self.field, &self.given, &self.wanted].map(|text| shown(text));
        match (field.as_str(), given.as_str()) {
            ("", "") => write!(f, "{wanted}"),
            ("", given) => write!(f, "`{given}`: {wanted}"),
            (field, "") => write!(f, "{field}: {wanted}"),
            (field, given) => write!(f, "{field} is {given}; {wanted}"),
        }
    }
}

impl std::error::Error for SceneError {}
