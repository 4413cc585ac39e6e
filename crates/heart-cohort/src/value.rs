//! Values of fields, as numbers, names or tables.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;

/// The value of a field: drawn for a member, or listed in a `choice`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum FieldValue {
    /// True or false.
    Truth(bool),
    /// An integer.
    Whole(i64),
    /// A floating-point number.
    Number(f64),
    /// A name.
    Text(String),
    /// An array.
    List(Vec<FieldValue>),
    /// A table of fields.
    Table(BTreeMap<String, FieldValue>),
}

impl FieldValue {
    /// Returns the value as a number.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(whole) => Some(*whole as f64),
            Self::Number(number) => Some(*number),
            Self::Truth(_) | Self::Text(_) | Self::List(_) | Self::Table(_) => None,
        }
    }

    /// Returns the path of the first NaN or infinity in this value, empty for the value itself. JSON supports neither.
    pub(crate) fn not_finite(&self) -> Option<String> {
        let below = |name: String, value: &Self| match value.not_finite()?.as_str() {
            "" => Some(name),
            path => Some(format!("{name}.{path}")),
        };
        match self {
            Self::Number(number) => (!number.is_finite()).then(String::new),
            Self::List(list) => {
                (list.iter().enumerate()).find_map(|(k, value)| below((k + 1).to_string(), value))
            }
            Self::Table(table) => {
                (table.iter()).find_map(|(name, value)| below(name.clone(), value))
            }
            Self::Truth(_) | Self::Whole(_) | Self::Text(_) => None,
        }
    }

    pub(crate) fn json(&self) -> Value {
        // Keys are strings, so every value has a form in JSON; NaN and infinity were rejected with the text.
        serde_json::to_value(self).unwrap_or_default()
    }
}

/// As JSON, on one line.
impl fmt::Display for FieldValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.json().fmt(f)
    }
}
