//! Where in the text of a cohort a field stands.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Line and column, from 1, of a field such as `vary.heart.inner.radius` or `cases.1.name`, arrays from 1 on, or of the innermost table
/// that would hold it. A key may be a dotted path in quotes.
pub(crate) fn of_field(text: &str, field: &str) -> Option<[usize; 2]> {
    found(text, field).0
}

/// Whether the field itself is there.
pub(crate) fn has(text: &str, field: &str) -> bool {
    found(text, field).1
}

/// The place, and whether it is that of the field itself.
fn found(text: &str, field: &str) -> (Option<[usize; 2]>, bool) {
    let Ok(root) = DeTable::parse(text) else {
        return (None, false);
    };
    let mut entries = of_table(root.get_ref());
    let (mut rest, mut found) = (field, None);
    while let Some((after, value)) = entries
        .into_iter()
        .find_map(|(name, value)| Some((after(rest, &name)?, value)))
    {
        found = Some(line_and_column(text, value.span().start));
        entries = match value.get_ref() {
            DeValue::Table(table) => of_table(table),
            DeValue::Array(array) => (array.iter().enumerate())
                .map(|(k, value)| ((k + 1).to_string(), value))
                .collect(),
            _ => Vec::new(),
        };
        rest = after;
    }
    (found, rest.is_empty())
}

/// Line and column, from 1, of a byte of the text.
pub(crate) fn line_and_column(text: &str, at: usize) -> [usize; 2] {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    [before.matches('\n').count() + 1, line.chars().count() + 1]
}

fn of_table<'a>(table: &'a DeTable<'a>) -> Vec<(String, &'a Spanned<DeValue<'a>>)> {
    (table.iter())
        .map(|(key, value)| (key.get_ref().to_string(), value))
        .collect()
}

/// What is left of a path after a name that it begins with.
fn after<'a>(path: &'a str, name: &str) -> Option<&'a str> {
    let rest = path.strip_prefix(name).filter(|_| !path.is_empty())?;
    match rest.strip_prefix('.') {
        Some(rest) => Some(rest),
        None => rest.is_empty().then_some(rest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_however_they_are_written() {
        let text = "members = 3\n[vary]\na.b = 1\n\"c.d\" = 2\n[[cases]]\nname = \"x\"\n[[cases]]\n name = \"y\"\n[vary.e]\nf = 3\n";
        for (field, line) in [
            ("members", 1),
            ("vary.a.b", 3),
            ("vary.c.d", 4),
            ("cases.1.name", 6),
            ("cases.2.name", 8),
            ("vary.e.f", 10),
            ("vary.e.g", 9),
        ] {
            assert_eq!(
                of_field(text, field).map(|[line, _]| line),
                Some(line),
                "{field}"
            );
        }
        assert_eq!(of_field(text, "nothing"), None);
        assert_eq!(of_field("= no", "members"), None);
        assert_eq!(line_and_column("\u{e9}\n\u{e9}x", 5), [2, 2]);
    }
}
