//! What an earlier run has left in a folder.

use super::REPORT;
use super::atomic::{failed, remove_if_there};
use crate::error::PhantomError;
use serde::Deserialize;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// No report is longer.
const MOST_BYTES: u64 = 1 << 26;

/// What is read of an older report.
#[derive(Default, Deserialize)]
struct Listed {
    #[serde(default)]
    files: Vec<PathBuf>,
}

/// Removes the report of an earlier run, and then the files that it lists and that are not to be written again.
///
/// Whoever has written the report, only what is a file, by a name without a way to it, in the folder itself is removed: no folder, no
/// link, nothing elsewhere.
///
/// # Errors
/// [`PhantomError::File`] for one that cannot be removed.
pub fn remove_older(folder: &Path, kept: &[PathBuf]) -> Result<(), PhantomError> {
    let report = folder.join(REPORT);
    let older = listed(&report);
    // First of all: where it is, all that it lists is.
    remove_if_there(&report)?;
    for name in older.files.iter().filter_map(|name| plain(name)) {
        let path = folder.join(name);
        let is_file = fs::symlink_metadata(&path).is_ok_and(|found| found.is_file());
        if is_file && !kept.iter().any(|kept| kept == name) {
            remove_if_there(&path)?;
        }
    }
    Ok(())
}

/// Nothing can be renamed onto a folder: it is found out before there is something to rename.
pub(crate) fn check_no_folder(folder: &Path, names: &[PathBuf]) -> Result<(), PhantomError> {
    for name in names {
        let path = folder.join(name);
        if fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir()) {
            return Err(failed(&path, std::io::ErrorKind::IsADirectory.into()));
        }
    }
    Ok(())
}

/// What a report lists; nothing if there is none, or something else of that name.
fn listed(report: &Path) -> Listed {
    let is_file = fs::symlink_metadata(report).is_ok_and(|found| found.is_file());
    let mut bytes = Vec::new();
    let read = match File::open(report) {
        Ok(file) if is_file => file.take(MOST_BYTES).read_to_end(&mut bytes),
        _ => return Listed::default(),
    };
    match read {
        Ok(_) => serde_json::from_slice(&bytes).unwrap_or_default(),
        Err(_) => Listed::default(),
    }
}

/// A name that is nothing but a name.
fn plain(name: &Path) -> Option<&OsStr> {
    let mut parts = name.components();
    match (parts.next(), parts.next()) {
        (Some(Component::Normal(only)), None) => Some(only),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// A report that somebody has changed, to have other files removed.
    #[test]
    fn a_tampered_report_removes_nothing_elsewhere() {
        let outside = tempfile::tempdir().unwrap();
        let folder = outside.path().join("out");
        fs::create_dir_all(folder.join("sub")).unwrap();
        let others = ["../other", "sub/other", "not-listed", "kept"];
        for name in others {
            fs::write(folder.join(name), "x").unwrap();
        }
        fs::write(folder.join("listed"), "x").unwrap();
        let far = outside.path().join("other");
        #[cfg(unix)]
        std::os::unix::fs::symlink(&far, folder.join("link")).unwrap();
        let files = json!([
            "listed",
            "kept",
            "link",
            "../other",
            "sub/other",
            "sub",
            "sub/../../other",
            far,
            "..",
            ".",
            "",
            "/",
            "gone",
            "./sub/other",
            "listed\0",
            "report.json",
        ]);
        let report = json!({ "files": files, "else": [1, 2] });
        fs::write(folder.join(REPORT), report.to_string()).unwrap();
        remove_older(&folder, &["kept".into()]).unwrap();
        for name in others {
            assert!(folder.join(name).exists(), "{name}");
        }
        #[cfg(unix)]
        assert!(folder.join("link").is_symlink());
        assert!(!folder.join("listed").exists() && !folder.join(REPORT).exists());
    }

    /// What is no report lists nothing, and goes.
    #[test]
    fn something_else_of_that_name_lists_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let (report, file) = (folder.path().join(REPORT), folder.path().join("file"));
        fs::write(&file, "x").unwrap();
        let deep = "[".repeat(100_000);
        for text in [
            "",
            "{",
            "[\"file\"]",
            "{\"files\": \"file\"}",
            "{\"files\": [1]}",
            &deep,
        ] {
            fs::write(&report, text).unwrap();
            remove_older(folder.path(), &[]).unwrap();
            assert!(file.exists() && !report.exists());
        }
        // A link to a report elsewhere is not read.
        #[cfg(unix)]
        {
            let elsewhere = folder.path().join("elsewhere");
            fs::write(&elsewhere, "{\"files\": [\"file\"]}").unwrap();
            std::os::unix::fs::symlink(&elsewhere, &report).unwrap();
            remove_older(folder.path(), &[]).unwrap();
            assert!(file.exists() && elsewhere.exists() && !report.exists());
        }
    }
}
