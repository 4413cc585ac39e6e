//! What `docs/guide-physicists.md` shows is what the program takes and says.

use heart_phantom::scene::Scene;

const GUIDE: &str = include_str!("../../docs/guide-physicists.md");

#[test]
fn its_scenes_are_scenes() {
    let scenes: Vec<&str> = (GUIDE.split("```toml\n").skip(1))
        .map(|rest| rest.split("```").next().unwrap())
        .collect();
    assert!(!scenes.is_empty());
    for text in scenes {
        Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    }
}

#[test]
fn its_error_is_said_in_these_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    // Line 12, column 9, as in the guide.
    std::fs::write(&path, format!("[camera]\n{}views = 0\n", "\n".repeat(10))).unwrap();
    let error = Scene::load(&path).unwrap_err().to_string();
    let shown = error.replace(path.to_str().unwrap(), "scene.toml");
    assert!(GUIDE.contains(&format!("error: {shown}\n")), "{shown}");
}

/// The table names every section and field; rows that share a section name the later fields by their last part.
#[test]
fn its_table_has_every_field() {
    let fields = toml_fields(&Scene::default().to_toml());
    assert!(fields.len() > 40, "{fields:?}");
    let table = GUIDE.split("## Every field").nth(1).unwrap();
    let table = table.split("\n## ").next().unwrap();
    for [section, field] in &fields {
        // The outer balloon has the fields of the inner one.
        let section = section.replace("heart.outer", "heart.inner");
        let row = table.lines().find(|line| {
            let names = line.split('|').nth(1).unwrap_or_default();
            names.contains(&format!("`{section}."))
                && (names.contains(&format!(".{field}`")) || names.contains(&format!("`{field}`")))
        });
        assert!(row.is_some(), "{section}.{field} is not in the table");
    }
}

/// Sections and fields of a commented scene, those that are commented out too.
fn toml_fields(text: &str) -> Vec<[String; 2]> {
    let mut section = String::new();
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.strip_prefix("# ").unwrap_or(line);
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']).to_owned();
        } else if let Some((name, _)) = line.split_once(" = ") {
            let is_name = |c: char| c.is_ascii_lowercase() || c == '_';
            if name.chars().all(is_name) {
                fields.push([section.clone(), name.to_owned()]);
            }
        }
    }
    fields
}
