//! The workspace on disk: root, packages and text files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folders of the published crates under `crates/`; a crate follows its dependencies.
pub(crate) const PUBLISHED: &[&str] = &[
    "simd-set",
    "membrane-forces",
    "membrane-newton",
    "membrane-implicit",
    "photon-scatter",
    "revolve-voxel",
    "radon",
    "heart-phantom",
    "heart-cohort",
    "heart-study",
];

/// Returns the published name of the crate in `folder`.
pub(crate) fn package_name(folder: &str) -> &str {
    if folder == "radon" {
        "radon-fbp"
    } else {
        folder
    }
}

/// Returns the folder of the workspace's `Cargo.toml`.
pub(crate) fn root() -> PathBuf {
    let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().unwrap_or(xtask).to_path_buf()
}

/// Returns the folder of cargo's output.
pub(crate) fn target_folder() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR");
    root().join(target.map_or("target".into(), PathBuf::from))
}

/// A text file, by its path from the root (with `/` on every system).
pub(crate) struct TextFile {
    pub(crate) path: String,
    pub(crate) text: String,
}

/// Folders of sources; others (build output, results of runs) are ignored.
const FOLDERS: &[&str] = &[
    ".cargo", ".ci", ".github", "benches", "crates", "docs", "python", "tests", "xtask",
];

/// Returns all text files of the workspace, sorted by path. Files that are not UTF-8 (images, data) are omitted.
pub(crate) fn text_files(root: &Path) -> std::io::Result<Vec<TextFile>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(root)? {
        let path = entry?.path();
        // A linked git worktree has a file `.git` with a local path.
        if path.is_file() && path.file_name().is_some_and(|name| name != ".git") {
            found.push(path);
        }
    }
    for folder in FOLDERS {
        let folder = root.join(folder);
        if folder.is_dir() {
            walk(&folder, &mut found)?;
        }
    }
    found.sort();
    let mut files = Vec::new();
    for path in found {
        if let Ok(text) = String::from_utf8(fs::read(&path)?) {
            let relative = path.strip_prefix(root).unwrap_or(&path);
            let path = relative.to_string_lossy().replace('\\', "/");
            files.push(TextFile { path, text });
        }
    }
    Ok(files)
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        // Build output, environments and caches of Python.
        let is_made = path
            .file_name()
            .is_some_and(|name| name == "target" || name.as_encoded_bytes().starts_with(b"."));
        if path.is_dir() && !is_made {
            walk(&path, found)?;
        } else if path.is_file() {
            found.push(path);
        }
    }
    Ok(())
}

/// Runs a command with visible output; returns an error if it fails.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    let status = command
        .status()
        .map_err(|error| format!("{command:?}: {error}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{command:?} failed"))
    }
}
