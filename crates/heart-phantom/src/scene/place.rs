//! Where in the text a field stands.

use super::SceneError;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest piece of the user's text that an error repeats.
const MOST_QUOTED: usize = 60;

/// What the parser had to say, with the field in which it said so.
pub(super) fn syntax(text: &str, error: &toml::de::Error) -> SceneError {
    let span = error.span().map(|span| clamped(text, span));
    let place = span.clone().map(|span| line_and_column(text, span.start));
    let field = (span.as_ref())
        .and_then(|span| field_at(text, span.start))
        .unwrap_or_default();
    let quoted = span.map(|span| &text[span]).unwrap_or_default();
    let short = !quoted.contains('\n') && quoted.len() <= MOST_QUOTED;
    SceneError {
        file: None,
        place,
        field,
        given: if short {
            quoted.trim().to_owned()
        } else {
            String::new()
        },
        wanted: error.message().trim().to_owned(),
    }
}

/// Line and column of a field such as `camera.pitch` or `defects.0.s`, or of the innermost table that would hold it; `None` if
/// there is neither.
pub(super) fn of_field(text: &str, field: &str) -> Option<[usize; 2]> {
    let root = DeTable::parse(text).ok()?;
    let mut entries = of_table(root.get_ref());
    let mut found = None;
    for name in field.split('.') {
        let Some(entry) = entries.into_iter().find(|entry| entry.name == name) else {
            break;
        };
        found = Some(line_and_column(
            text,
            clamped(text, entry.value.span()).start,
        ));
        entries = within(entry.value.get_ref());
    }
    found
}

/// The dotted path of what stands at a byte of the text; `None` if the text is no TOML.
fn field_at(text: &str, at: usize) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let mut entries = of_table(root.get_ref());
    let mut path: Vec<String> = Vec::new();
    // A table's header does not span its entries: look into each for one that holds the place.
    while let Some(entry) = entries.into_iter().find(|entry| entry.holds(at)) {
        let is_key = entry.key.contains(&at);
        // Of arrays, only those of tables are fields within fields.
        if matches!(entry.value.get_ref(), DeValue::Array(_) | DeValue::Table(_))
            || entry.key.end > 0
        {
            path.push(entry.name);
        }
        if is_key {
            break;
        }
        entries = within(entry.value.get_ref());
    }
    Some(path.join("."))
}

/// A named entry of a table, or a numbered one of an array (without a key).
struct Entry<'a> {
    name: String,
    key: Range<usize>,
    value: &'a Spanned<DeValue<'a>>,
}

impl Entry<'_> {
    fn holds(&self, at: usize) -> bool {
        self.key.contains(&at)
            || self.value.span().contains(&at)
            || within(self.value.get_ref())
                .iter()
                .any(|entry| entry.holds(at))
    }
}

fn within<'a>(value: &'a DeValue<'a>) -> Vec<Entry<'a>> {
    match value {
        DeValue::Table(table) => of_table(table),
        DeValue::Array(array) => (array.iter().enumerate())
            .map(|(k, value)| Entry {
                name: k.to_string(),
                key: 0..0,
                value,
            })
            .collect(),
        _ => Vec::new(),
    }
}

fn of_table<'a>(table: &'a DeTable<'a>) -> Vec<Entry<'a>> {
    (table.iter())
        .map(|(key, value)| Entry {
            name: key.get_ref().to_string(),
            key: key.span(),
            value,
        })
        .collect()
}

/// A span within the text and on the borders of characters.
fn clamped(text: &str, span: Range<usize>) -> Range<usize> {
    let fit = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let (start, end) = (fit(span.start), fit(span.end));
    start..end.max(start)
}

fn line_and_column(text: &str, at: usize) -> [usize; 2] {
    let before = &text[..at];
    let line = before.matches('\n').count() + 1;
    let column = before
        .rsplit('\n')
        .next()
        .unwrap_or_default()
        .chars()
        .count()
        + 1;
    [line, column]
}
