//! The previous run of an output directory: its report and the files that the report lists.

use super::atomic::{failed, remove_if_there};
use super::folder::check_names;
use super::format::is_output;
use super::{Folder, PROGRAM, REPORT};
use crate::error::PhantomError;
use serde::Deserialize;
use std::fs::{self, File};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// Longest report that is read, in bytes.
const MOST_BYTES: u64 = 1 << 30;

/// The part of a report that is read.
#[derive(Deserialize)]
struct Listed {
    program: String,
    files: Vec<PathBuf>,
}

impl Folder {
    /// Announces the files `names`, which are removed unless [`Folder::finish`] keeps them. Removes the report of the previous run, and then
    /// the files that it lists and that are not among `names`.
    ///
    /// Whatever the report lists, only regular files in the directory itself with an extension of the formats are removed: no
    /// directory, no link, no lock, nothing elsewhere.
    ///
    /// # Errors
    /// [`PhantomError::Name`] for a path that is not the name of a file of its own; [`PhantomError::File`] for a directory of the name of a
    /// file to be written, [`PhantomError::Foreign`] for a `report.json` of another program and for the first of `names` that exists and that
    /// the report of the previous run does not list, all with nothing removed (a link of that name is replaced, not followed);
    /// [`PhantomError::File`] for a file that cannot be removed or a lock that cannot be written.
    pub fn clear(&mut self, names: &[PathBuf]) -> Result<(), PhantomError> {
        check_names(names)?;
        for name in names {
            let path = self.path().join(name);
            if fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir()) {
                return Err(failed(&path, io::ErrorKind::IsADirectory.into()));
            }
        }
        let report = self.path().join(REPORT);
        let files = listed(&report)?.unwrap_or_default();
        let folder = self.path().to_path_buf();
        let is_file = |name: &Path| {
            let found = fs::symlink_metadata(folder.join(name));
            found.is_ok_and(|found| found.is_file())
        };
        let is_listed = |name: &PathBuf| name.as_path() == REPORT || files.contains(name);
        if let Some(name) = (names.iter()).find(|name| !is_listed(name) && is_file(name)) {
            return Err(PhantomError::Foreign {
                path: folder.join(name),
            });
        }
        self.announce(names)?;
        // First: a directory with a report has all files that it lists.
        remove_if_there(&report)?;
        for name in files.iter().filter(|name| !names.contains(name)) {
            if is_file(name) && is_output(name) {
                remove_if_there(&folder.join(name))?;
            }
        }
        Ok(())
    }
}

/// Tests that the report in a directory, if there is one, lists none of these names, for single files beside those of a run.
///
/// # Errors
/// [`PhantomError::Listed`] with the first name that it lists; [`PhantomError::File`] if the report cannot be read.
pub fn check_unlisted(folder: &Path, names: &[PathBuf]) -> Result<(), PhantomError> {
    let files = match listed(&folder.join(REPORT)) {
        Err(PhantomError::Foreign { .. }) | Ok(None) => return Ok(()),
        files => files?.unwrap_or_default(),
    };
    match names.iter().find(|name| files.contains(name)) {
        None => Ok(()),
        Some(name) => Err(PhantomError::Listed {
            path: folder.join(name),
        }),
    }
}

/// The files that a report lists; `None` if there is no report.
fn listed(report: &Path) -> Result<Option<Vec<PathBuf>>, PhantomError> {
    let foreign = || PhantomError::Foreign {
        path: report.to_path_buf(),
    };
    let failed = |source| failed(report, source);
    // Before it is opened: a link may lead anywhere, a pipe would block.
    match fs::symlink_metadata(report) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
        Ok(found) if found.is_symlink() => return Ok(Some(Vec::new())),
        Ok(found) if !found.is_file() => return Err(foreign()),
        Ok(_) => {}
    }
    let file = File::open(report).map_err(failed)?;
    let read: Result<Listed, _> = serde_json::from_reader(BufReader::new(file.take(MOST_BYTES)));
    let name = |program: &str| program.split(' ').next().map(str::to_owned);
    match read {
        // Of any version.
        Ok(read) if name(&read.program) == name(PROGRAM) => Ok(Some(read.files)),
        _ => Err(foreign()),
    }
}
