//! The manifest as a table: its columns, and the cells of a member.

use crate::record::{Record, Row};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io;

/// A cell of the table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    Nothing,
    Text(String),
    Whole(u64),
    Number(f64),
}

/// What stands in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Text,
    Whole,
    Number,
}

/// Columns that every manifest begins with.
const FIRST: [(&str, Kind); 11] = [
    ("key", Kind::Text),
    ("member", Kind::Whole),
    ("shard", Kind::Text),
    ("offset", Kind::Whole),
    ("bytes", Kind::Whole),
    ("blake3", Kind::Text),
    ("status", Kind::Text),
    ("reason", Kind::Text),
    ("case", Kind::Text),
    ("attempts", Kind::Whole),
    ("warnings", Kind::Text),
];

/// The columns: [`FIRST`], then what was drawn, then the numbers of the hearts, each in the order of their names.
#[derive(Default)]
pub(crate) struct Columns {
    drawn: BTreeMap<String, Kind>,
    numbers: BTreeMap<String, Kind>,
}

impl Columns {
    /// Name and kind of each column.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&str, Kind)> {
        let others = self.drawn.iter().chain(&self.numbers);
        FIRST
            .into_iter()
            .chain(others.map(|(name, kind)| (name.as_str(), *kind)))
    }

    /// The cells of a member.
    pub(crate) fn cells(&self, row: &Row, archive: &str) -> Vec<Cell> {
        let text = |text: &str| match text {
            "" => Cell::Nothing,
            text => Cell::Text(text.to_owned()),
        };
        let is_there = row.refused.is_none();
        let mut cells = vec![
            text(&row.key),
            Cell::Whole(row.member),
            text(archive),
            if is_there {
                Cell::Whole(row.offset)
            } else {
                Cell::Nothing
            },
            Cell::Whole(row.bytes),
            text(&row.blake3),
            text(if is_there { "ok" } else { "refused" }),
            text(row.refused.as_deref().unwrap_or_default()),
            text(&row.case),
            Cell::Whole(row.attempts.into()),
            text(&row.warnings.join("; ")),
        ];
        for (columns, values) in [(&self.drawn, &row.values), (&self.numbers, &row.numbers)] {
            cells.extend(
                columns
                    .iter()
                    .map(|(name, kind)| cell(values.get(name), *kind)),
            );
        }
        cells
    }

    /// Takes in what the rows of a record have.
    pub(crate) fn add(&mut self, record: &Record) {
        for row in &record.rows {
            for (columns, values) in [
                (&mut self.drawn, &row.values),
                (&mut self.numbers, &row.numbers),
            ] {
                for (name, value) in values {
                    let kind = columns.entry(name.clone()).or_insert(Kind::Number);
                    if !value.is_number() {
                        *kind = Kind::Text;
                    }
                }
            }
        }
    }
}

fn cell(value: Option<&Value>, kind: Kind) -> Cell {
    match (value, kind) {
        (None | Some(Value::Null), _) => Cell::Nothing,
        (Some(value), Kind::Number) => value.as_f64().map_or(Cell::Nothing, Cell::Number),
        (Some(Value::String(text)), _) => Cell::Text(text.clone()),
        (Some(value), _) => Cell::Text(value.to_string()),
    }
}

/// Hands the cells of all members over, in their order.
pub(crate) type ForEach<'a> =
    &'a dyn Fn(&mut dyn FnMut(Vec<Cell>) -> io::Result<()>) -> io::Result<()>;
