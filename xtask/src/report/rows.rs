//! The rows that benches print, and the file that keeps them.

use serde::{Deserialize, Serialize};

/// One point of a study: the time a method took and the error it left.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Row {
    pub(super) study: String,
    pub(super) method: String,
    pub(super) case: String,
    pub(super) size: usize,
    pub(super) threads: usize,
    pub(super) seconds: f64,
    pub(super) error: f64,
    pub(super) error_kind: String,
}

/// The rows among the lines of `printed`: those that begin with `row `.
pub(super) fn parse(printed: &str) -> Result<Vec<Row>, String> {
    let lines = printed.lines().filter_map(|line| line.strip_prefix("row "));
    lines
        .map(|line| {
            let row: Row =
                serde_json::from_str(line).map_err(|error| format!("row {line}: {error}"))?;
            let valid = row.seconds > 0.0 && row.seconds.is_finite() && row.error >= 0.0;
            if valid && row.error.is_finite() {
                Ok(row)
            } else {
                Err(format!("row {line}: no such time or error"))
            }
        })
        .collect()
}

/// All rows with the commit they were measured at.
pub(super) fn json(rows: &[Row], commit: &str) -> Result<String, String> {
    #[derive(Serialize)]
    struct Dated<'a> {
        #[serde(flatten)]
        row: &'a Row,
        commit: &'a str,
    }
    let dated: Vec<Dated<'_>> = rows.iter().map(|row| Dated { row, commit }).collect();
    let text = serde_json::to_string_pretty(&dated).map_err(|error| error.to_string())?;
    Ok(text + "\n")
}
