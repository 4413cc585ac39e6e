//! One writer a folder: two runs into one would leave files of both under the report of one.

use super::atomic::{failed, unfinished};
use crate::error::PhantomError;
use crate::text::{MOST, cut};
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// The file that is locked.
const NAME: &str = ".heart-phantom.lock";
/// Bytes of it that are read to say who holds it.
const MOST_READ: u64 = 512;
/// How often a lock that others take and give back at the same time is tried for.
const MOST_TRIES: usize = 100;

/// The right to write into a folder, until it is dropped; see [`lock_folder`].
#[must_use = "the folder is free again as soon as it is dropped"]
#[derive(Debug)]
pub struct FolderLock {
    path: PathBuf,
    /// Locked as long as it is open.
    file: File,
}

/// Makes the folder with its parents if need be and takes the right to write into it, so that a long computation does not end with
/// nowhere to put its result, or among another's.
///
/// The lock is a file in the folder that the system keeps locked ([`File::try_lock`]) and that says which process of which
/// computer holds it. It goes when the value is dropped, or with [`remove_unfinished`](super::remove_unfinished). A process that was
/// killed leaves the file, but not the lock: the next one takes it over. Where the file system has no locks, none keeps others out.
///
/// ```
/// use heart_phantom::files::lock_folder;
/// # let out = tempfile::tempdir()?;
/// # let out = out.path();
/// let held = lock_folder(out)?;
/// let error = lock_folder(out).unwrap_err();
/// assert!(error.to_string().contains(&format!("process {}", std::process::id())));
/// drop(held);
/// assert!(lock_folder(out).is_ok());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`PhantomError::Busy`] with the one who holds the folder; [`PhantomError::File`] if it cannot be written to.
pub fn lock_folder(folder: &Path) -> Result<FolderLock, PhantomError> {
    fs::create_dir_all(folder).map_err(|source| failed(folder, source))?;
    let path = folder.join(NAME);
    let mut holder = "another process".to_owned();
    for _ in 0..MOST_TRIES {
        match try_once(&path).map_err(|source| failed(folder, source))? {
            Tried::Locked(lock) => return Ok(lock),
            Tried::Held(by) => {
                holder = by;
                break;
            }
            Tried::Changed => {}
        }
    }
    Err(PhantomError::Busy {
        path: folder.to_path_buf(),
        holder,
    })
}

enum Tried {
    Locked(FolderLock),
    /// By whom.
    Held(String),
    /// Others were here at the same time.
    Changed,
}

fn try_once(path: &Path) -> io::Result<Tried> {
    let mut unfinished = unfinished();
    let (file, is_new) = match File::create_new(path) {
        Ok(file) => (file, true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => match older(path)? {
            Some(file) => (file, false),
            None => return Ok(Tried::Changed),
        },
        Err(error) => return Err(error),
    };
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        return Ok(match is_new {
            // Somebody else has taken it for one that was left.
            true => Tried::Changed,
            false => Tried::Held(read(&file)),
        });
    }
    // The name belongs to whoever has the lock of the file that bears it; nobody else removes it.
    if !is_at(&file, path) {
        return Ok(Tried::Changed);
    }
    if !is_new {
        // Left by a process that has ended: the system has released it. Nothing is written into a file that was there before.
        fs::remove_file(path)?;
        return Ok(Tried::Changed);
    }
    unfinished.insert(path.to_path_buf());
    drop(unfinished);
    let path = path.to_path_buf();
    let lock = FolderLock { path, file };
    writeln!(
        &lock.file,
        "process {} on {}",
        std::process::id(),
        computer()
    )?;
    Ok(Tried::Locked(lock))
}

/// The file that is there; none if it has gone meanwhile.
fn older(path: &Path) -> io::Result<Option<File>> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        // A link may lead anywhere, a pipe would be waited for.
        Ok(found) if !found.is_file() => {
            let message = format!("{NAME} is there and no file");
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
        }
        found => found?,
    };
    // Network file systems lock only what is open for writing.
    match File::options().read(true).write(true).open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        opened => opened.map(Some),
    }
}

/// Whether the open file is still the one of that name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(open), Ok(named)) => (open.dev(), open.ino()) == (named.dev(), named.ino()),
        _ => false,
    }
}

/// Whether there is still a file of that name: elsewhere the standard library does not tell which.
#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.is_file()
}

/// Who holds it, as far as the file tells.
fn read(file: &File) -> String {
    let mut bytes = Vec::new();
    // What cannot be read tells nothing; that it is held is known.
    let _ = file.take(MOST_READ).read_to_end(&mut bytes);
    match String::from_utf8_lossy(&bytes).trim() {
        "" => "another process".to_owned(),
        holder => cut(holder, MOST),
    }
}

/// The computer's name, for people.
fn computer() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname")
        .or_else(|_| fs::read_to_string("/etc/hostname"))
        .ok()
        .or_else(|| std::env::var("HOSTNAME").ok())
        .or_else(|| std::env::var("COMPUTERNAME").ok())
        .unwrap_or_default();
    match name.trim() {
        "" => "a computer without a name".to_owned(),
        name => name.to_owned(),
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Gone already if the process is about to end.
        if unfinished().remove(&self.path) {
            let _ = fs::remove_file(&self.path);
        }
    }
}
