//! Rule about test programs of several files: each file is a module of its program. Cargo runs a file directly under `tests` as a program;
//! a file in a folder below runs only if a `mod` names it, which nothing else checks.

use super::{Finding, find};
use crate::workspace::TextFile;

/// Checks all files below the `tests` folders of packages.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let is_named = |path: &str| {
        let Some((folder, name)) = place(path) else {
            return true;
        };
        let above = ["/main.rs", "/mod.rs", ".rs"].map(|end| format!("{folder}{end}"));
        let declared = format!("mod {name};"); // possibly after `pub(crate)`
        above
            .iter()
            .filter_map(|path| find(files, path))
            .any(|file| {
                file.text
                    .lines()
                    .any(|line| line.trim().ends_with(&declared))
            })
    };
    files
        .iter()
        .filter(|file| !is_named(&file.path))
        .map(|file| {
            Finding::new(
                &file.path,
                0,
                "no test program has this file as a module: its tests never run",
            )
        })
        .collect()
}

/// Returns the folder below `tests` whose program or module must name this file, and its name; `None` if cargo finds it.
fn place(path: &str) -> Option<(&str, &str)> {
    let module = path.strip_suffix(".rs")?.trim_end_matches("/mod");
    let (folder, name) = module.rsplit_once('/')?;
    // A package's folder `tests`: of a crate, or of the package `tests`.
    let (_, below) = folder.split_once("/tests/")?;
    let is_ours = !below.is_empty() && !folder.contains("/src/");
    (is_ours && name != "main").then_some((folder, name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let file = |(path, text): &(&str, &str)| TextFile {
            path: (*path).into(),
            text: (*text).into(),
        };
        let files: Vec<TextFile> = files.iter().map(file).collect();
        check(&files)
            .into_iter()
            .map(|finding| finding.path)
            .collect()
    }

    #[test]
    fn a_file_without_a_program_is_reported() {
        let main = (
            "crates/a/tests/suite/main.rs",
            "//! x\nmod one;\nmod deep;\n",
        );
        let one = ("crates/a/tests/suite/one.rs", "");
        let two = ("crates/a/tests/suite/two.rs", "");
        let deep = ("crates/a/tests/suite/deep/mod.rs", "    mod three;\n");
        let three = ("crates/a/tests/suite/deep/three.rs", "");
        assert_eq!(found(&[main, one, deep, three]), [""; 0]);
        assert_eq!(found(&[main, one, two]), [two.0]);
        assert_eq!(
            found(&[main, one, deep, ("tests/tests/b/three.rs", "")]),
            ["tests/tests/b/three.rs"]
        );
        // Alternatively a program beside its folder.
        let beside = (
            "crates/a/tests/files.rs",
            "#[path = \"files/npy.rs\"]\nmod npy;\n",
        );
        assert_eq!(
            found(&[beside, ("crates/a/tests/files/npy.rs", "")]),
            [""; 0]
        );
        // Cargo or the compiler finds programs, shared files and sources.
        for path in [
            "crates/a/tests/x.rs",
            "crates/a/tests/common/mod.rs",
            "crates/a/src/b/c.rs",
            "docs/tests/a.md",
        ] {
            assert_eq!(found(&[(path, "")]), [""; 0], "{path}");
        }
    }
}
