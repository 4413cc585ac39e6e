//! Fields of a scene by their dotted paths: `heart.inner.radius`, `pose.shift.1`, `defects.2.activity`. Arrays count from 1, as in
//! errors of a scene. Values of fields: numbers, names or tables.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
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

/// Returns the value at a path.
pub(crate) fn get<'a>(scene: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(scene, |at, name| match at {
        Value::Object(table) => table.get(name),
        Value::Array(array) => array.get(index(name)?),
        _ => None,
    })
}

/// Sets a value at a path and creates its tables; returns false if the path crosses another value.
pub(crate) fn set(scene: &mut Value, path: &str, value: Value) -> bool {
    let mut at = scene;
    for name in path.split('.') {
        if at.is_null() {
            *at = Value::Object(Map::new());
        }
        at = match at {
            Value::Object(table) => table.entry(name).or_insert(Value::Null),
            Value::Array(array) => match index(name).and_then(|k| array.get_mut(k)) {
                Some(entry) => entry,
                None => return false,
            },
            _ => return false,
        };
    }
    *at = value;
    true
}

/// Merges a table into another: tables entry by entry, other values are replaced. A table with one entry of another name replaces a
/// choice, such as `{ gain = 0.6 }` by `{ ejection_fraction = 0.4 }`.
pub(crate) fn lay_over(below: &mut Value, above: &Value) {
    let (Value::Object(old), Value::Object(new)) = (&mut *below, above) else {
        *below = above.clone();
        return;
    };
    let chosen_anew = old.len() == 1 && new.len() == 1 && !old.keys().eq(new.keys());
    if chosen_anew {
        *below = above.clone();
        return;
    }
    for (name, value) in new {
        lay_over(old.entry(name).or_insert(Value::Null), value);
    }
}

/// Returns the paths of all values in a table, which is at `path`, that are not tables.
pub(crate) fn leaves(value: &Value, path: &str) -> Vec<String> {
    let Value::Object(table) = value else {
        return vec![path.to_owned()];
    };
    let below = |name: &String| match path {
        "" => name.clone(),
        path => format!("{path}.{name}"),
    };
    let all = table.iter();
    all.flat_map(|(name, value)| leaves(value, &below(name)))
        .collect()
}

/// Whether a path is equal to another one or within it.
pub(crate) fn is_within(path: &str, other: &str) -> bool {
    path.strip_prefix(other)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Whether two paths are equal or one is within the other.
pub(crate) fn overlap(path: &str, other: &str) -> bool {
    is_within(path, other) || is_within(other, path)
}

fn index(name: &str) -> Option<usize> {
    name.parse::<usize>().ok()?.checked_sub(1)
}
