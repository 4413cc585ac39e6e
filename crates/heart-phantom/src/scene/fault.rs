//! What is wrong with a field.

use super::error::SceneError;
use crate::text::Number;
use serde::Serialize;
use std::fmt::Display;

pub(super) type Checked = Result<(), SceneError>;

pub(super) fn fault(field: &str, given: impl Display, wanted: impl Into<String>) -> SceneError {
    SceneError {
        file: None,
        place: None,
        field: field.to_owned(),
        given: given.to_string(),
        wanted: wanted.into(),
    }
}

/// A choice as it stands in the file.
pub(super) fn spelled(choice: impl Serialize) -> String {
    let value = serde_json::to_value(choice).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

/// A section, whose fields have its name before theirs.
pub(super) struct Section<S>(pub(super) S);

impl<S: Display> Section<S> {
    pub(super) fn field(&self, name: &str) -> String {
        format!("{}.{name}", self.0)
    }

    pub(super) fn within(&self, name: &str, given: f64, range: [f64; 2]) -> Checked {
        within(&self.field(name), given, range)
    }

    pub(super) fn count(&self, name: &str, given: usize, range: [usize; 2]) -> Checked {
        count(&self.field(name), given, range)
    }
}

/// All of them.
pub(super) fn all_within(field: &str, given: &[f64], range: [f64; 2]) -> Checked {
    (given.iter()).try_for_each(|given| within(field, *given, range))
}

/// A NaN is in no range.
pub(super) fn within(field: &str, given: f64, [min, max]: [f64; 2]) -> Checked {
    if given >= min && given <= max {
        Ok(())
    } else {
        let wanted = format!("must be between {} and {}", Number(min), Number(max));
        Err(fault(field, Number(given), wanted))
    }
}

pub(super) fn count(field: &str, given: usize, [min, max]: [usize; 2]) -> Checked {
    if (min..=max).contains(&given) {
        Ok(())
    } else {
        let wanted = format!("must be between {min} and {max}");
        Err(fault(field, given, wanted))
    }
}
