//! `cargo xtask tidy`, also a test: rules of the workspace that the compiler does not check.
//!
//! Each rule is a pure function from text to findings, tested by a snippet that breaks it and one that meets it.

mod assets;
mod circles;
mod conventions;
mod floors;
mod manifests;
mod pages;
mod source_rules;
mod test_modules;
mod text_rules;

use std::fmt;
use std::path::Path;

use crate::workspace::{self, TextFile};

/// A broken rule. Line 0 means the whole file.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Finding {
    pub(crate) path: String,
    pub(crate) line: usize,
    pub(crate) message: String,
}

impl Finding {
    pub(crate) fn new(path: &str, line: usize, message: impl Into<String>) -> Self {
        Self {
            path: path.to_owned(),
            line,
            message: message.into(),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.path, self.message),
            line => write!(f, "{}:{line}: {}", self.path, self.message),
        }
    }
}

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let root = workspace::root();
    match arguments {
        [] => {}
        [flag] if flag == "--bless" => conventions::bless(&root)?,
        _ => return Err("usage: cargo xtask tidy [--bless]".into()),
    }
    let findings = check(&root)?;
    if findings.is_empty() {
        println!("tidy");
        return Ok(());
    }
    let list: Vec<String> = findings.iter().map(Finding::to_string).collect();
    Err(format!("{}\n{} findings", list.join("\n"), list.len()))
}

/// Checks the workspace at `root`.
fn check(root: &Path) -> Result<Vec<Finding>, String> {
    let files =
        workspace::text_files(root).map_err(|error| format!("reading the workspace: {error}"))?;
    let mut findings = Vec::new();
    for TextFile { path, text } in &files {
        findings.extend(text_rules::check(path, text));
        if path.ends_with(".rs") {
            findings.extend(source_rules::check(path, text));
        }
    }
    findings.extend(crate::accuracy::check(&files));
    findings.extend(assets::check(&files));
    findings.extend(circles::check(&files));
    findings.extend(floors::check(&files));
    findings.extend(manifests::check(&files));
    findings.extend(conventions::check(&files));
    findings.extend(test_modules::check(&files));
    findings.extend(pages::check(&files, |path| root.join(path).exists()));
    Ok(findings)
}

/// Returns the file at `path`, if it exists.
pub(crate) fn find<'a>(files: &'a [TextFile], path: &str) -> Option<&'a TextFile> {
    files.iter().find(|file| file.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_workspace_obeys_its_rules() {
        let findings = check(&workspace::root()).expect("the workspace can be read");
        let list: Vec<String> = findings.iter().map(Finding::to_string).collect();
        assert!(
            findings.is_empty(),
            "cargo xtask tidy finds:\n{}",
            list.join("\n")
        );
    }
}
