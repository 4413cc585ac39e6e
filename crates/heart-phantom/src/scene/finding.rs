//! Findings of a validation: field, place and allowed values.

use crate::text::{Number, chain, escape, escape_path};
use std::error::Error;
use std::fmt::{self, Debug, Display};
use std::path::{Path, PathBuf};

/// Formats a place in a file as the prefix of a message.
pub(crate) fn place_in(file: Option<&Path>, place: Option<[usize; 2]>) -> String {
    match (file.map(escape_path), place) {
        (Some(file), Some([line, column])) => format!("{file}:{line}:{column}: "),
        (Some(file), None) => format!("{file}: "),
        (None, Some([line, column])) => format!("line {line}, column {column}: "),
        (None, None) => String::new(),
    }
}

/// A field of a scene or a cohort whose value is not allowed, alone or in combination.
///
/// [`Display`] writes one line, escapes control characters and truncates long values.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Line and column, from 1; `None` if the scene has no text or the text lacks the field.
    pub place: Option<[usize; 2]>,
    /// Path of the field, such as `camera.views`, or `defects.1.s` of the first section `[[defects]]`; empty if the text is not valid TOML.
    // tidy: allow string: the path of a field in the file
    pub field: String,
    /// The value; empty if there is none.
    // tidy: allow string: the user's own text
    pub given: String,
    /// The allowed values.
    // tidy: allow string: ranges, lists and the parser's words
    pub wanted: String,
}

impl Finding {
    /// Creates a finding without a value.
    #[must_use]
    pub fn new(
        place: Option<[usize; 2]>,
        field: impl Into<String>,
        wanted: impl Into<String>,
    ) -> Self {
        let (field, given, wanted) = (field.into(), String::new(), wanted.into());
        Self {
            place,
            field,
            given,
            wanted,
        }
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [field, given, wanted] =
            [&self.field, &self.given, &self.wanted].map(|text| escape(text));
        match (field.as_str(), given.as_str()) {
            ("", "") => write!(f, "{wanted}"),
            ("", given) => write!(f, "`{given}`: {wanted}"),
            (field, "") => write!(f, "{field}: {wanted}"),
            (field, given) => write!(f, "{field} is {given}; {wanted}"),
        }
    }
}

/// All findings of a scene or a cohort, one per line, in the order of the sections. A syntax error, an unknown key and a value of another type
/// end the reading of a text; only the first one is reported, alone.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneError {
    /// The file, if the text was read from one.
    pub file: Option<PathBuf>,
    /// At least one.
    pub findings: Vec<Finding>,
}

impl SceneError {
    /// Returns the first finding.
    #[must_use]
    pub fn first(&self) -> &Finding {
        &self.findings[0]
    }
}

impl Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, finding) in self.findings.iter().enumerate() {
            let end = if k == 0 { "" } else { "\n" };
            let place = place_in(self.file.as_deref(), finding.place);
            write!(f, "{end}{place}{finding}")?;
        }
        Ok(())
    }
}

impl Error for SceneError {}

impl From<Finding> for SceneError {
    fn from(finding: Finding) -> Self {
        Self {
            file: None,
            findings: vec![finding],
        }
    }
}

/// A running validation: path of the current section and findings so far.
#[derive(Debug, Default)]
pub(crate) struct Check {
    path: String,
    findings: Vec<Finding>,
}

impl Check {
    /// Returns an error if there are findings.
    pub(crate) fn finish(self) -> Result<(), SceneError> {
        match self.findings.is_empty() {
            true => Ok(()),
            false => Err(self.into_error()),
        }
    }

    /// Converts to an error; requires at least one finding.
    pub(super) fn into_error(self) -> SceneError {
        SceneError {
            file: None,
            findings: self.findings,
        }
    }

    /// Validates the fields below a name. An empty name means the section itself.
    pub(crate) fn at<T>(&mut self, name: &str, check: impl FnOnce(&mut Self) -> T) -> T {
        let length = self.path.len();
        if length > 0 && !name.is_empty() {
            self.path.push('.');
        }
        self.path.push_str(name);
        let checked = check(self);
        self.path.truncate(length);
        checked
    }

    /// Returns an object, or reports its error.
    pub(super) fn built<T>(&mut self, name: &str, made: Result<T, impl Error>) -> Option<T> {
        made.map_err(|error| self.fault(name, "", chain(&error)))
            .ok()
    }

    /// Validates each item of an array; indices count from 1.
    pub(crate) fn each<T>(&mut self, name: &str, items: &[T], check: impl Fn(&mut Self, &T)) {
        for (k, item) in items.iter().enumerate() {
            self.at(&format!("{name}.{}", k + 1), |c| check(c, item));
        }
    }

    /// Whether none of these sections has a finding. Rules across sections require that each value is allowed by itself.
    pub(super) fn is_clean(&self, sections: &[&str]) -> bool {
        let is_in = |finding: &Finding| {
            (sections.iter()).any(|section| below(section, &finding.field).is_some())
        };
        !self.findings.iter().any(is_in)
    }

    pub(crate) fn fault(&mut self, name: &str, given: impl Display, wanted: impl Into<String>) {
        let (given, wanted) = (given.to_string(), wanted.into());
        self.at(name, |c| {
            c.findings.push(Finding {
                place: None,
                field: c.path.clone(),
                given,
                wanted,
            });
        });
    }

    /// Validates a value against a range; NaN is out of range.
    pub(crate) fn within(&mut self, name: &str, given: f64, [min, max]: [f64; 2]) {
        if !(given >= min && given <= max) {
            let wanted = format!("must be between {} and {}", Number(min), Number(max));
            self.fault(name, Number(given), wanted);
        }
    }

    /// Validates all values of an array; reports the first one out of range.
    pub(crate) fn all_within(&mut self, name: &str, given: &[f64], [min, max]: [f64; 2]) {
        if let Some(bad) = given.iter().find(|x| !(**x >= min && **x <= max)) {
            self.within(name, *bad, [min, max]);
        }
    }

    pub(crate) fn count(&mut self, name: &str, given: usize, [min, max]: [usize; 2]) {
        if !(min..=max).contains(&given) {
            self.fault(name, given, format!("must be between {min} and {max}"));
        }
    }

    /// Validates `[from, to]` with `low <= from < to <= high`.
    pub(crate) fn ascending(&mut self, name: &str, [from, to]: [f64; 2], [low, high]: [f64; 2]) {
        if !(from >= low && from < to && to <= high) {
            let [low, high, from, to] = [low, high, from, to].map(Number);
            let wanted = format!("must be [from, to] with {low} <= from < to <= {high}");
            self.fault(name, format!("[{from}, {to}]"), wanted);
        }
    }
}

/// Returns the rest of a path below another path, such as `pitch.1` for `camera.pitch.1` below `camera`; empty if they are equal.
pub(super) fn below<'a>(outer: &str, path: &'a str) -> Option<&'a str> {
    let rest = path.strip_prefix(outer)?;
    match rest.is_empty() {
        true => Some(rest),
        false => rest.strip_prefix('.'),
    }
}

/// Returns the spelling of a variant in a file: kebab case, without data.
pub(super) fn spelled(choice: impl Debug) -> String {
    let mut name = String::new();
    let debug = format!("{choice:?}");
    for letter in debug.chars().take_while(|c| c.is_alphanumeric()) {
        if letter.is_ascii_uppercase() && !name.is_empty() {
            name.push('-');
        }
        name.push(letter.to_ascii_lowercase());
    }
    name
}

/// Describes an array in an error message.
pub(crate) fn array_of(n: usize) -> String {
    format!("an array of {n} values")
}
