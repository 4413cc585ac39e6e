//! Locates fields in the text of a scene.

use super::finding::{Finding, below};
use super::{material, template};
use crate::text::{MOST, cut};
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::str::Utf8Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest length of the user's text in an error message, in bytes.
const MOST_QUOTED: usize = 60;
/// Longest message of the parser, in characters.
const MOST_MESSAGE: usize = 500;

/// Messages of the parser about a value of the wrong type; the allowed values of the template replace them.
const KINDS: [&str; 8] = [
    "unit variant",
    "newtype variant",
    "struct variant",
    "expected struct ",
    "expected table",
    "wanted string or table",
    "found 0 elements",
    material::EXPECTED,
];

/// Reads a value from TOML.
///
/// # Errors
/// [`Finding`] with line, column, field, value and allowed values.
pub fn read_toml<T: DeserializeOwned>(text: &str) -> Result<T, Finding> {
    toml::from_str(text).map_err(|error| syntax(text, &error))
}

/// Converts an error of the parser to a finding with a field.
fn syntax(text: &str, error: &toml::de::Error) -> Finding {
    let span = error.span().map(|span| clamped(text, span));
    let place = span.clone().map(|span| line_and_column(text, span.start));
    let (field, is_value) = (span.as_ref())
        .and_then(|span| field_at(text, span.start))
        .unwrap_or((String::new(), true));
    let quoted = span.map(|span| text[span].trim()).unwrap_or_default();
    let short = !quoted.contains(char::is_control) && quoted.len() <= MOST_QUOTED;
    let message = error.message().trim();
    let wanted = match KINDS.iter().any(|kind| message.contains(kind)) {
        true => template::advice(&field, quoted),
        false => None,
    };
    Finding {
        place,
        field: cut(&field, MOST),
        given: if short && is_value { quoted } else { "" }.to_owned(),
        wanted: wanted.unwrap_or_else(|| plain(&short_of(message))),
    }
}

/// Returns the finding for a file that is not UTF-8, at its first invalid byte.
pub(super) fn not_text(bytes: &[u8], error: Utf8Error) -> Finding {
    let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
    let place = line_and_column(&before, before.len());
    Finding::new(
        Some(place),
        "",
        "is not UTF-8; save the file in that encoding",
    )
}

/// Returns the parser's message with the user's text cut to [`MOST`] characters.
fn short_of(message: &str) -> String {
    for (open, close) in [("`", "`, expected"), ("\"", "\", expected")] {
        if let (Some(from), Some(to)) = (message.find(open), message.rfind(close))
            && from < to
        {
            let from = from + open.len();
            let (before, given, after) = (&message[..from], &message[from..to], &message[to..]);
            return format!("{before}{}{after}", cut(given, MOST));
        }
    }
    cut(message, MOST_MESSAGE)
}

/// Replaces names of Rust types in the parser's message by names of TOML types.
fn plain(message: &str) -> String {
    let mut message = message.replace(" as i128", "");
    for (rust, name) in [
        ("unknown variant", "unknown name"),
        ("invalid type: map", "invalid type: a table"),
        ("invalid type: sequence", "invalid type: an array"),
    ] {
        if let Some(rest) = message.strip_prefix(rust) {
            message = format!("{name}{rest}");
        }
    }
    for (rust, name) in [
        ("usize", "a non-negative integer"),
        ("u64", "a non-negative integer"),
        ("u32", "a non-negative integer"),
        ("f64", "a number"),
        ("a sequence", "an array"),
        (
            "wanted exactly 1 element, more than 1 element",
            "only one of these can be chosen",
        ),
    ] {
        if let Some(rest) = message.strip_suffix(rust) {
            message = format!("{rest}{name}");
        }
    }
    if message.ends_with("an integer") || message.ends_with("a non-negative integer") {
        message = message.replacen("invalid type: integer", "out of range: integer", 1);
    }
    message
}

/// Returns line and column of a field, or of the innermost table that would contain it.
pub(crate) fn of_field(text: &str, field: &str) -> Option<[usize; 2]> {
    Some(locate(text, field)?.0)
}

/// Returns line and column (from 1) of a field of a TOML text such as `camera.pitch` or `defects.1.s`, and whether the field exists. If
/// not, the place is that of the innermost table that would contain it. Array indices count from 1; a key may be a quoted dotted path.
/// `None` if no such table exists or the text is not valid TOML.
#[must_use]
pub fn locate(text: &str, field: &str) -> Option<([usize; 2], bool)> {
    let root = DeTable::parse(text).ok()?;
    let mut entries = of_table(root.get_ref());
    let (mut rest, mut found) = (field, None);
    while !rest.is_empty()
        && let Some((after, entry)) =
            (entries.into_iter()).find_map(|entry| Some((below(&entry.name, rest)?, entry)))
    {
        let start = clamped(text, entry.value.span()).start;
        found = Some(line_and_column(text, start));
        entries = within(entry.value.get_ref());
        rest = after;
    }
    found.map(|place| (place, rest.is_empty()))
}

/// Returns the dotted path at a byte of the text, and whether that byte is in a value, not a name; `None` if the text is not valid TOML.
fn field_at(text: &str, at: usize) -> Option<(String, bool)> {
    let root = DeTable::parse(text).ok()?;
    let mut entries = of_table(root.get_ref());
    let mut path: Vec<String> = Vec::new();
    let mut is_value = false;
    // The span of a table header excludes the entries: search the entries of each table.
    while let Some(entry) = entries.into_iter().find(|entry| entry.holds(at)) {
        let is_key = entry.key.contains(&at);
        // Elements of arrays are fields only if they are tables.
        if matches!(entry.value.get_ref(), DeValue::Array(_) | DeValue::Table(_))
            || entry.key.end > 0
        {
            path.push(entry.name);
        }
        is_value = !is_key && !matches!(entry.value.get_ref(), DeValue::Table(_));
        if is_key {
            break;
        }
        entries = within(entry.value.get_ref());
    }
    Some((path.join("."), is_value))
}

/// A named entry of a table, or an indexed entry of an array (without a key).
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
                name: (k + 1).to_string(),
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

/// Clamps a span to the text and to character boundaries.
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

/// Returns line and column (from 1) of a byte of a text.
fn line_and_column(text: &str, at: usize) -> [usize; 2] {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    [before.matches('\n').count() + 1, line.chars().count() + 1]
}
