//! The rows that benches print, and their file.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::machine::Machine;

/// A point of a study: time and error of a method.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Row {
    pub(super) study: String,
    pub(super) method: String,
    pub(super) case: String,
    pub(super) size: usize,
    pub(super) threads: usize,
    /// Median of the repeats.
    pub(super) seconds: f64,
    /// Minimum of the repeats.
    pub(super) least: f64,
    pub(super) repeats: usize,
    pub(super) error: f64,
    pub(super) error_kind: String,
}

/// Largest spread of a time that is published without a mark.
const STEADY: f64 = 0.1;

impl Row {
    /// Returns the spread of its time: the difference of median and minimum in units of the minimum.
    pub(super) fn spread(&self) -> f64 {
        self.seconds / self.least - 1.0
    }

    /// Whether the spread is at most 10 %.
    pub(super) fn is_steady(&self) -> bool {
        self.spread() <= STEADY
    }
}

/// Parses the rows among the lines of `printed`: those that begin with `row `.
pub(super) fn parse(printed: &str) -> Result<Vec<Row>, String> {
    let lines = printed.lines().filter_map(|line| line.strip_prefix("row "));
    lines
        .map(|line| {
            let row: Row =
                serde_json::from_str(line).map_err(|error| format!("row {line}: {error}"))?;
            let times = 0.0 < row.least && row.least <= row.seconds && row.repeats > 0;
            let valid = times && row.seconds.is_finite() && row.error >= 0.0;
            if valid && row.error.is_finite() {
                Ok(row)
            } else {
                Err(format!("row {line}: no such time or error"))
            }
        })
        .collect()
}

/// The content of `docs/performance.json`.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Measured {
    pub(super) machine: Machine,
    pub(super) rows: Vec<Row>,
}

impl Measured {
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = fs::read_to_string(path).map_err(|error| failed(&error))?;
        serde_json::from_str(&text).map_err(|error| failed(&error))
    }

    pub(super) fn json(&self) -> Result<String, String> {
        let text = serde_json::to_string_pretty(self).map_err(|error| error.to_string())?;
        Ok(text + "\n")
    }
}
