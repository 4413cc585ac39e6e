//! Output directories: one writer at a time, and removal of the files of the previous run.

use super::REPORT;
use super::atomic::{create_folder, failed, unfinished};
use super::format::is_output;
use crate::error::PhantomError;
use crate::text::{MOST, cut};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Name of the locked file.
const NAME: &str = ".heart-phantom.lock";
/// Longest name of a holder that is read, in bytes.
const MOST_READ: u64 = 512;
/// Longest list of files that is read, in bytes.
const MOST_LISTED: u64 = 1 << 30;
/// Attempts while other processes take and release the lock at the same time.
const MOST_TRIES: usize = 100;

/// Exclusive access to an output directory, until it is dropped.
///
/// A run announces its files and ends with [`Folder::finish`]. A folder that is dropped between the two, and
/// [`remove_unfinished`](super::remove_unfinished), remove the announced files, so that no file remains that no report lists. On drop a directory
/// that was created and is empty is removed, too.
///
/// The lock is a file in the directory that the operating system keeps locked ([`File::try_lock`]) and that names process and computer.
/// It is removed on drop and by [`remove_unfinished`](super::remove_unfinished). A killed process leaves the file but not the lock: the
/// next process takes it over, and removes the files that the killed process announced there. On a file system without locks nothing
/// is excluded.
///
/// ```
/// use heart_phantom::files::Folder;
/// # let out = tempfile::tempdir()?;
/// # let out = out.path();
/// let folder = Folder::lock(out)?;
/// let error = Folder::lock(out).unwrap_err();
/// assert!(error.to_string().contains(&format!("process {}", std::process::id())));
/// drop(folder);
/// assert!(Folder::lock(out).is_ok());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "the directory is unlocked on drop"]
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Whether it is removed on drop if it is empty.
    is_new: bool,
    /// Locked while it is open.
    lock: File,
    /// Paths of the announced files.
    announced: Vec<PathBuf>,
}

impl Folder {
    /// Creates the directory with its parents and locks it, so that an unusable directory is reported before a long computation.
    ///
    /// # Errors
    /// [`PhantomError::Busy`] with the holder of the lock; [`PhantomError::File`] if the directory cannot be written to.
    pub fn lock(path: &Path) -> Result<Self, PhantomError> {
        if path.as_os_str().is_empty() {
            let source = io::Error::new(io::ErrorKind::InvalidInput, "the path is empty");
            return Err(failed(path, source));
        }
        let create = || -> io::Result<Result<File, String>> {
            for _ in 0..MOST_TRIES {
                create_folder(path)?;
                match try_lock(&path.join(NAME)) {
                    Ok(Some(locked)) => return Ok(locked),
                    Ok(None) => {}
                    // Another process has removed the directory that it created.
                    Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                    Err(error) => return Err(error),
                }
            }
            Ok(Err(holder("")))
        };
        let (path, is_new) = (path.to_path_buf(), !path.exists());
        match create().map_err(|source| failed(&path, source))? {
            Ok(lock) => Ok(Self {
                path,
                is_new,
                lock,
                announced: Vec::new(),
            }),
            Err(holder) => Err(PhantomError::Busy { path, holder }),
        }
    }

    /// The directory.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Announces checked names of files that will be written. The lock contains them for the next process, in case this one is killed.
    pub(super) fn announce(&mut self, names: &[PathBuf]) -> Result<(), PhantomError> {
        for name in names.iter().filter_map(|name| name.to_str()) {
            writeln!(&self.lock, "{name}").map_err(|source| failed(&self.path, source))?;
        }
        let paths = names.iter().map(|name| self.path.join(name));
        self.announced.extend(paths);
        unfinished().extend(self.announced.iter().cloned());
        Ok(())
    }

    /// Keeps the announced files, and unlocks the directory. The caller has written the report that lists them.
    pub fn finish(mut self) {
        let mut unfinished = unfinished();
        for file in self.announced.drain(..) {
            unfinished.remove(&file);
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        // The lock last: until then no other process writes here.
        let lock = self.path.join(NAME);
        for file in self.announced.drain(..).chain([lock]) {
            // Removed already if the process is about to end.
            if unfinished.remove(&file) {
                let _ = fs::remove_file(file);
            }
        }
        if self.is_new {
            // Fails if there are files.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Checks that each path is the name of a file of its own: one component of printable text, not that of the lock.
pub(super) fn check_names(names: &[PathBuf]) -> Result<(), PhantomError> {
    let mut known = BTreeSet::from([NAME]);
    for path in names {
        let name = path.file_name().filter(|name| *name == path.as_os_str());
        let name = name
            .and_then(OsStr::to_str)
            .filter(|name| !name.contains(char::is_control));
        if !name.is_some_and(|name| known.insert(name)) {
            return Err(PhantomError::Name { path: path.clone() });
        }
    }
    Ok(())
}

/// The locked file, or its holder; `None` if another process changed it at the same time.
fn try_lock(path: &Path) -> io::Result<Option<Result<File, String>>> {
    let mut unfinished = unfinished();
    let (file, is_new) = match File::create_new(path) {
        Ok(file) => (file, true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            // A link is not followed, and a pipe would block.
            if fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
                let message = format!("{NAME} exists and is not a file");
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
            }
            // Network file systems lock only files that are open for writing.
            match File::options().read(true).write(true).open(path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
                opened => (opened?, false),
            }
        }
        Err(error) => return Err(error),
    };
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        let mut bytes = Vec::new();
        // A holder that cannot be read has no name.
        let _ = (&file).take(MOST_READ).read_to_end(&mut bytes);
        let holder = holder(&String::from_utf8_lossy(&bytes));
        return Ok((!is_new).then_some(Err(holder)));
    }
    // Only the process whose lock is that of the named file removes it.
    if !is_at(&file, path) {
        return Ok(None);
    }
    if !is_new {
        // Left by a process that has ended. An existing file is never written to.
        let mut text = String::new();
        // A list that cannot be read has no files.
        let _ = (&file).take(MOST_LISTED).read_to_string(&mut text);
        // If there is a report, the files that it lists are complete.
        let has_report = path.with_file_name(REPORT).exists();
        for name in text.lines().skip(1).map(Path::new) {
            let file = path.with_file_name(name);
            if !has_report
                && is_output(name)
                && fs::symlink_metadata(&file).is_ok_and(|found| found.is_file())
            {
                fs::remove_file(file)?;
            }
        }
        fs::remove_file(path)?;
        return Ok(None);
    }
    unfinished.insert(path.to_path_buf());
    let process = std::process::id();
    writeln!(&file, "process {process} on {}", computer())?;
    Ok(Some(Ok(file)))
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

/// Whether there is a file of that name: the standard library does not identify files on other systems.
#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.is_file()
}

fn holder(text: &str) -> String {
    match text.lines().next().unwrap_or_default().trim() {
        "" => "another process".to_owned(),
        holder => cut(holder, MOST),
    }
}

/// Name of the computer, for messages.
fn computer() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname")
        .or_else(|_| fs::read_to_string("/etc/hostname"))
        .ok()
        .or_else(|| std::env::var("HOSTNAME").ok())
        .or_else(|| std::env::var("COMPUTERNAME").ok());
    match name.as_deref().map_or("", str::trim) {
        "" => "a computer without a name".to_owned(),
        name => name.to_owned(),
    }
}
