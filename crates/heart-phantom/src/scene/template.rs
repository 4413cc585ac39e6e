//! Writes a scene as a commented TOML file: `template.toml` with the values of the scene.

use super::check_output::formats;
use super::finding::below;
use super::json::toml_of;
use super::study::Scene;
use std::fmt::Write;
use std::sync::LazyLock;
use toml::{Table, Value};

/// A scene with every section and field, one field with its comment per line.
static TEMPLATE: LazyLock<String> = LazyLock::new(|| {
    include_str!("template.toml")
        .replace("{volumes}", &formats(|_| true))
        .replace("{projections}", &formats(|info| info.projections.is_some()))
        .replace("{gates}", &formats(|info| info.gates))
});

/// Returns the text of the file.
pub(super) fn write(scene: &Scene) -> String {
    let values = toml_of(&scene.to_json()).unwrap_or(Value::Table(Table::new()));
    let mut text = String::new();
    for block in TEMPLATE.split_inclusive("\n\n") {
        match header(block) {
            None => text.push_str(block),
            Some(path) => match at(Some(&values), path) {
                Some(Value::Table(section)) => write_block(block, Some(section), &mut text),
                Some(Value::Array(sections)) => {
                    for section in sections {
                        write_block(block, section.as_table(), &mut text);
                    }
                }
                _ => write_block(block, None, &mut text),
            },
        }
    }
    text
}

/// Writes a section with its values; comments it out if there are none.
fn write_block(block: &str, values: Option<&Table>, text: &mut String) {
    for line in block.lines() {
        // Writing to a String never fails.
        let _ = match (field(line), values) {
            (Some([name, _, comment]), Some(values)) if values.contains_key(name) => {
                writeln!(text, "{name} = {}  # {comment}", values[name])
            }
            (None, Some(_)) => writeln!(text, "{line}"),
            _ if line.is_empty() || line.starts_with('#') => writeln!(text, "{line}"),
            _ => writeln!(text, "# {line}"),
        };
    }
}

/// Returns the path of the section of a block.
fn header(block: &str) -> Option<&str> {
    let line = block.lines().find(|line| line.starts_with('['))?;
    Some(line.trim_matches(['[', ']']))
}

/// Splits a line into name, value and comment.
fn field(line: &str) -> Option<[&str; 3]> {
    let (name, rest) = line.split_once(" = ").filter(|_| !line.starts_with('#'))?;
    let (value, comment) = rest.split_once("  # ")?;
    Some([name, value, comment])
}

fn at<'a>(values: Option<&'a Value>, path: &str) -> Option<&'a Value> {
    (path.split('.')).fold(values, |table, name| table?.get(name))
}

/// Returns the comment on each field by path.
fn comments() -> Vec<(String, &'static str)> {
    let mut section = "";
    let mut known = Vec::new();
    for line in TEMPLATE.lines() {
        section = header(line).unwrap_or(section);
        if let Some([name, _, comment]) = field(line) {
            known.push((format!("{section}.{name}"), comment));
        }
    }
    known
}

/// Returns the allowed values of a field (or of the field that contains it), or the fields of a section. `given` is the text in the file.
pub(super) fn advice(path: &str, given: &str) -> Option<String> {
    let is_name = |name: &&str| name.parse::<usize>().is_err();
    let names: Vec<&str> = path.split('.').filter(is_name).collect();
    let path = names.join(".");
    let known = comments();
    if let Some((field, comment)) = known
        .iter()
        .find(|(field, _)| below(field, &path).is_some())
    {
        let chosen = match path == *field {
            true => given.trim_matches(['"', '\'']),
            false => names.last().copied().unwrap_or_default(),
        };
        let name = field.rsplit('.').next().unwrap_or_default();
        return Some(match choice(comment, chosen) {
            Some(example) => format!("`{chosen}` needs a value: {name} = {example}"),
            None => format!("must be {comment}"),
        });
    }
    let mut fields: Vec<&str> = (known.iter())
        .filter_map(|(field, _)| below(&path, field)?.split('.').next())
        .collect();
    fields.dedup();
    let section = match path.as_str() {
        "defects" | "organs" | "points" => format!("[[{path}]]"),
        _ => format!("[{path}]"),
    };
    (!fields.is_empty()).then(|| format!("must be a section {section} with {}", fields.join(", ")))
}

/// Returns the example of one choice in a comment, if it is a table: `{ gated = { gates = 16 } }`.
fn choice<'a>(comment: &'a str, name: &str) -> Option<&'a str> {
    let from = &comment[comment.find(&format!("{{ {name} = "))?..];
    let mut depth = 0;
    let end = from.find(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0
    })?;
    Some(&from[..=end])
}
