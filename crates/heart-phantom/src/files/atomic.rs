//! Atomic files: written under a temporary name, then renamed.

use crate::error::PhantomError;
use crate::files::samples::PIECE;
use crate::files::sparse::SparseFile;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary files, announced files and locks of this process. Locked while one of them is created, removed or renamed.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// Names tried for a temporary file.
const MOST_NAMES: usize = 1000;

/// Writes a file atomically: `fill` writes to a new temporary file in the same directory, which is then renamed to `path`. After a
/// failure (no such directory, no permission, disk full) the temporary file is removed and an older file at `path` is unchanged. A link
/// at `path` is replaced, not followed.
///
/// Pages of zeros are not written: the file is sparse, as most of the voxels and bins around a heart are zero. Its bytes and its length are
/// those that `fill` wrote; the disk stores fewer.
///
/// A process that is interrupted removes its temporary files by [`remove_unfinished`]; a process that is killed may leave files that
/// end in `.tmp`. Data are not flushed to the disk: after a loss of power files of the last seconds may be short or empty.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PhantomError> {
    write_file(path, |out| fill(out))
}

/// As [`write_atomically`], for a writer that seeks.
pub(super) fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<SparseFile>) -> io::Result<()>,
) -> Result<(), PhantomError> {
    commit(&[Pending::write(path, fill)?])
}

/// Writes a header and the data file that it names. Both are complete before either is renamed; an older header is removed before its
/// data change.
pub(super) fn write_with_header(
    header: &Path,
    header_text: &[u8],
    data: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PhantomError> {
    let data = Pending::write(data, |out| fill(out))?;
    let header = Pending::write(header, |out| out.write_all(header_text))?;
    commit(&[data, header])
}

/// Creates the directory `path` with its parents and tests that files can be written to it.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn create_writable_folder(path: &Path) -> Result<(), PhantomError> {
    create_folder(path)
        .and_then(|()| Pending::begin(&path.join("probe")).map(drop))
        .map_err(|source| failed(path, source))
}

/// Creates the directory `path` with its parents.
pub(super) fn create_folder(path: &Path) -> io::Result<()> {
    match fs::create_dir_all(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(io::Error::new(
            io::ErrorKind::NotADirectory,
            "it exists and must be a directory",
        )),
        created => created,
    }
}

/// Removes the temporary files, the announced files ([`Folder`](super::Folder)) and the directory locks of this process, for a program
/// that is about to end. Until the returned value is dropped every write waits before it begins or ends; a write that was cut short
/// then fails with [`PhantomError::File`], and the file that it was to replace is unchanged unless it was announced.
///
/// The library installs no signal handler. A program calls this function in a thread of its own: it waits for a lock, which a signal
/// handler must not do. That thread must not write.
///
/// ```
/// use heart_phantom::files;
/// // In the thread that waits for signals:
/// let held = files::remove_unfinished();
/// // std::process::exit(130);
/// # drop(held);
/// ```
#[must_use = "writes continue as soon as the value is dropped"]
pub fn remove_unfinished() -> impl Sized {
    let mut unfinished = unfinished();
    for file in std::mem::take(&mut *unfinished) {
        // A file that cannot be removed is no reason to keep the others.
        let _ = fs::remove_file(file);
    }
    unfinished
}

/// Removes a file; no error if there is none.
pub(super) fn remove_if_there(path: &Path) -> Result<(), PhantomError> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(failed(path, source)),
        _ => Ok(()),
    }
}

/// Renames complete files to their names, in their order, or none of them. Of several the last is the header.
fn commit(files: &[Pending]) -> Result<(), PhantomError> {
    let mut unfinished = unfinished();
    for file in files {
        // Found while the older files are unchanged: a directory cannot be replaced, and `remove_unfinished` may have been faster.
        let found = match file.path.is_dir() {
            true => Err(io::ErrorKind::IsADirectory.into()),
            false => fs::metadata(&file.temporary).map(drop),
        };
        found.map_err(|source| failed(&file.path, source))?;
    }
    if let [_, .., header] = files {
        remove_if_there(&header.path)?;
    }
    for file in files {
        fs::rename(&file.temporary, &file.path).map_err(|source| failed(&file.path, source))?;
        unfinished.remove(&file.temporary);
    }
    Ok(())
}

/// A file under its temporary name, which is removed on drop.
struct Pending {
    temporary: PathBuf,
    path: PathBuf,
}

impl Pending {
    fn write(
        path: &Path,
        fill: impl FnOnce(&mut BufWriter<SparseFile>) -> io::Result<()>,
    ) -> Result<Self, PhantomError> {
        let (pending, file) = Self::begin(path).map_err(|source| failed(path, source))?;
        let mut out = BufWriter::with_capacity(PIECE, SparseFile::new(file));
        fill(&mut out)
            .and_then(|()| out.into_inner().map_err(io::Error::from))
            .and_then(SparseFile::finish)
            .map_err(|source| failed(path, source))?;
        Ok(pending)
    }

    /// Creates a new file beside `path`. An existing file or link is never opened: the next name is tried.
    fn begin(path: &Path) -> io::Result<(Self, File)> {
        // The process id separates processes, the counter threads.
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let mut unfinished = unfinished();
        for _ in 0..MOST_NAMES {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut temporary = name.to_os_string();
            temporary.push(format!(".{}-{count}.tmp", std::process::id()));
            let temporary = path.with_file_name(temporary);
            match File::create_new(&temporary) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(file) => {
                    unfinished.insert(temporary.clone());
                    let path = path.to_path_buf();
                    return Ok((Self { temporary, path }, file));
                }
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // A renamed file is no longer in the set. The error of the write is the one to report.
        if unfinished().remove(&self.temporary) {
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// The set is consistent at any moment, so a poisoned lock is usable.
pub(super) fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn failed(path: &Path, source: io::Error) -> PhantomError {
    PhantomError::File {
        path: path.to_path_buf(),
        source,
    }
}
