//! Files written whole or not at all.

use crate::error::PhantomError;
use crate::files::samples::PIECE;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The temporary files that are there. Held locked while one of them comes, goes or takes its name.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// Names tried for a temporary file.
const MOST_NAMES: usize = 1000;

/// Writes a file atomically: `fill` writes to a temporary file in the same folder, which then
/// takes the name `path`. On any failure (no such folder, no permission, disk full) the temporary
/// file is removed and an older file at `path` stays as it was. The temporary file is always a new one, and a link at `path` is
/// replaced, not followed.
///
/// A program that is ended from outside leaves no half file under any name if it calls [`remove_unfinished`] first, as the
/// command line does; otherwise, or where it is killed outright, at most a temporary one with the ending `.tmp`. Nothing waits for
/// the disk: what a program can compute again is not worth a flush of every file, so a loss of power within the seconds that the
/// system takes to write back may leave files short or empty.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PhantomError> {
    Pending::write(path, |out| fill(out))?.commit()
}

/// Makes the folder `path` with its parents if need be and makes sure that files can be written to
/// it, so that a long computation does not end with nowhere to put its result.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn create_writable_folder(path: &Path) -> Result<(), PhantomError> {
    fs::create_dir_all(path).map_err(|source| failed(path, source))?;
    let probe = Pending::write(&path.join("probe"), |_| Ok(())).map_err(|error| match error {
        PhantomError::File { source, .. } => failed(path, source),
        error => error,
    })?;
    // Its drop would keep a failure to itself.
    remove_if_there(&probe.temporary)
}

/// Removes the temporary files of all writes that this process has under way. For a program that is about to end: from then on
/// no write of this module begins or ends, each waits, until the value returned is dropped; those that were cut short then fail
/// with [`PhantomError::File`], and the files that were to be replaced stay as they were.
///
/// Files that belong together (a header and its data) take their names together or not at all.
///
/// The library takes none of the process's signals; a program does that, if it wants to, in a thread of its own: this function
/// waits for a lock, which the handler of a signal may not do. The thread that holds the value returned must not write itself.
///
/// ```
/// use heart_phantom::files;
/// // In the thread that waits for signals:
/// let held = files::remove_unfinished();
/// // std::process::exit(130);
/// # drop(held);
/// ```
pub fn remove_unfinished() -> HeldWrites {
    let mut unfinished = unfinished();
    for temporary in std::mem::take(&mut *unfinished) {
        // One that cannot be removed is no reason to keep the others.
        let _ = fs::remove_file(temporary);
    }
    HeldWrites {
        _unfinished: unfinished,
    }
}

/// While this is there no write begins or ends; see [`remove_unfinished`].
#[must_use = "writes go on as soon as it is dropped"]
#[derive(Debug)]
pub struct HeldWrites {
    _unfinished: MutexGuard<'static, BTreeSet<PathBuf>>,
}

/// Removes a file, or does nothing if there is none.
pub(crate) fn remove_if_there(path: &Path) -> Result<(), PhantomError> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(failed(path, source)),
        _ => Ok(()),
    }
}

/// Writes a header and the data it points to. Both are complete before either takes its name; the data take theirs first, and
/// no older header is there while the data change.
pub(super) fn write_with_header(
    header: &Path,
    header_text: &[u8],
    data: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), PhantomError> {
    let new_data = Pending::write(data, |out| fill(out))?;
    let new_header = Pending::write(header, |out| out.write_all(header_text))?;
    for path in [header, data] {
        // Nothing can be renamed onto a folder: find out while the older files are untouched.
        if path.is_dir() {
            return Err(failed(path, io::ErrorKind::IsADirectory.into()));
        }
    }
    let mut unfinished = unfinished();
    // Gone if `remove_unfinished` was faster.
    for pending in [&new_data, &new_header] {
        fs::metadata(&pending.temporary).map_err(|source| failed(&pending.path, source))?;
    }
    remove_if_there(header)?;
    new_data.take_name(&mut unfinished)?;
    new_header.take_name(&mut unfinished)
}

/// A complete file that does not have its name yet; dropped before it takes it, it goes.
pub(super) struct Pending {
    temporary: PathBuf,
    path: PathBuf,
}

impl Pending {
    pub(super) fn write(
        path: &Path,
        fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<Self, PhantomError> {
        let (pending, file) = Self::begin(path).map_err(|source| failed(path, source))?;
        let mut out = BufWriter::with_capacity(PIECE, file);
        fill(&mut out)
            .and_then(|()| out.flush())
            .map_err(|source| failed(path, source))?;
        Ok(pending)
    }

    /// A new file beside `path`. One that is there already, or a link that somebody has put there, is never opened: the next name is
    /// tried.
    fn begin(path: &Path) -> io::Result<(Self, File)> {
        // The process id keeps two runs from trying each other's names, the counter two threads.
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

    pub(super) fn commit(self) -> Result<(), PhantomError> {
        let mut unfinished = unfinished();
        self.take_name(&mut unfinished)
    }

    fn take_name(&self, unfinished: &mut BTreeSet<PathBuf>) -> Result<(), PhantomError> {
        fs::rename(&self.temporary, &self.path).map_err(|source| failed(&self.path, source))?;
        unfinished.remove(&self.temporary);
        Ok(())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // One that has its name is no longer among them. After a failure its own error is the one worth reporting.
        if unfinished().remove(&self.temporary) {
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// The set is whole at any moment, so that a panic elsewhere takes nothing from it.
pub(super) fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn failed(path: &Path, source: io::Error) -> PhantomError {
    PhantomError::File {
        path: path.to_path_buf(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failure_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let result = write_atomically(&path, |out| {
            out.write_all(b"half of it")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(result, Err(PhantomError::File { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// Links to a file that is none of ours, under every name that a temporary file will have for a while, and under the last one.
    #[cfg(unix)]
    #[test]
    fn no_link_is_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let [path, other] = ["a.txt", "other"].map(|name| folder.path().join(name));
        fs::write(&other, "not ours").unwrap();
        let link = |name: &str| std::os::unix::fs::symlink(&other, folder.path().join(name));
        link("a.txt").unwrap();
        for count in 0..MOST_NAMES / 2 {
            link(&format!("a.txt.{}-{count}.tmp", std::process::id())).unwrap();
        }
        write_atomically(&path, |out| out.write_all(b"ours")).unwrap();
        assert_eq!(fs::read_to_string(&other).unwrap(), "not ours");
        assert_eq!(fs::read_to_string(&path).unwrap(), "ours");
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
    }

    #[test]
    fn a_pair_is_replaced_together_or_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [header, data] = ["a.h", "a.d"].map(|name| folder.path().join(name));
        write_with_header(&header, b"old", &data, |out| out.write_all(b"old")).unwrap();
        let full = write_with_header(&header, b"new", &data, |out| {
            out.write_all(b"half of it")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(full, Err(PhantomError::File { path, .. }) if path == data));
        for path in [&header, &data] {
            assert_eq!(fs::read_to_string(path).unwrap(), "old");
        }
        write_with_header(&header, b"new", &data, |out| out.write_all(b"new")).unwrap();
        for path in [&header, &data] {
            assert_eq!(fs::read_to_string(path).unwrap(), "new");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_folder_in_the_way_of_the_data_leaves_the_header() {
        let folder = tempfile::tempdir().unwrap();
        let [header, data] = ["a.h", "a.d"].map(|name| folder.path().join(name));
        fs::write(&header, "old").unwrap();
        fs::create_dir(&data).unwrap();
        let refused = write_with_header(&header, b"new", &data, |_| Ok(()));
        assert!(matches!(refused, Err(PhantomError::File { path, .. }) if path == data));
        assert_eq!(fs::read_to_string(&header).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
