//! Rule about embedded files of others: the licence is beside the file.

use super::{Finding, find};
use crate::workspace::TextFile;

/// Findings in the sources of all crates: each embedded file of bytes has its licence in the same folder, with the same name up to the
/// first hyphen or dot.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in files {
        let Some(krate) = krate(&file.path) else {
            continue;
        };
        for (line, text) in file.text.lines().enumerate() {
            let Some(name) = embedded(text) else {
                continue;
            };
            let stem = name.split(['-', '.']).next().unwrap_or_default();
            let licence = format!("crates/{krate}/assets/{stem}-LICENSE.txt");
            let there = find(files, &licence).is_some_and(|file| file.text.contains("opyright"));
            if !there {
                let message = format!("embeds {name} without a licence in {licence}");
                findings.push(Finding::new(&file.path, line + 1, message));
            }
        }
    }
    findings
}

/// Returns the crate of a source file.
fn krate(path: &str) -> Option<&str> {
    let (krate, rest) = path.strip_prefix("crates/")?.split_once('/')?;
    (rest.starts_with("src/") && path.ends_with(".rs")).then_some(krate)
}

/// Returns the file of `assets` that a line embeds.
fn embedded(line: &str) -> Option<&str> {
    let (_, rest) = line.split_once("include_bytes!(\"")?;
    let (path, _) = rest.split_once('"')?;
    path.rsplit_once("assets/").map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> TextFile {
        TextFile {
            path: path.into(),
            text: text.into(),
        }
    }

    #[test]
    fn embedded_files_have_their_licence() {
        let source = "static FONT: &[u8] = include_bytes!(\"../../assets/Font-1.2.ttf.gz\");\n";
        let source = file("crates/a/src/b/c.rs", source);
        let licence = file("crates/a/assets/Font-LICENSE.txt", "Copyright (c) somebody");
        let other = file("crates/b/assets/Font-LICENSE.txt", "Copyright (c) somebody");
        let findings = check(&[source, other]);
        assert_eq!((findings.len(), findings[0].line), (1, 1));
        let source = file(
            "crates/a/src/b.rs",
            "include_bytes!(\"../assets/Font.ttf\")",
        );
        assert_eq!(check(&[source, licence]), []);
    }
}
