//! Where in the text a field stands.

use super::SceneError;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Longest piece of the user's text that an error repeats.
const MOST_QUOTED: usize = 60;

/// What the parser had to say, with the field in which it said so.
pub(super) fn syntax(text: &str, error: &toml::de::Error) -> SceneError {
    let span = error.span().map(|span| clamped(text, span));
    let place = span.clone().map(|span| line_and_column(text, span.start));
    let field = span
        .clone()
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

/// Line and column of a field such as `camera.pitch`, or of the innermost table that would hold it; `None` if there is neither.
pub(super) fn of_field(text: &str, field: &str) -> Option<[usize; 2]> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut found = None;
    for name in field.split('.') {
        let Some((_, value)) = table.iter().find(|(key, _)| key.get_ref() == name) else {
            break;
        };
        found = Some(line_and_column(text, clamped(text, value.span()).start));
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found
}

/// The dotted path of what stands at a byte of the text; `None` if the text is no TOML.
fn field_at(text: &str, at: usize) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut path: Vec<&str> = Vec::new();
    loop {
        // The last entry that begins at or before the place: a table's header does not span its entries.
        let entry = table
            .iter()
            .filter(|(key, value)| {
                key.span().contains(&at) || value.span().contains(&at) || holds(value.get_ref(), at)
            })
            .max_by_key(|(key, _)| key.span().start);
        let Some((key, value)) = entry else {
            break;
        };
        path.push(key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) if !key.span().contains(&at) => table = inner,
            _ => break,
        }
    }
    Some(path.join("."))
}

/// Whether any entry of a table, or of one within it, spans the place.
fn holds(value: &DeValue<'_>, at: usize) -> bool {
    match value {
        DeValue::Table(table) => table.iter().any(|(key, value)| {
            key.span().contains(&at) || value.span().contains(&at) || holds(value.get_ref(), at)
        }),
        _ => false,
    }
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
