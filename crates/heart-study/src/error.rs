//! Errors of the study and its figures: invalid input, detected before any work, and files that cannot be written.

use heart_phantom::PhantomError;
use std::io;
use std::path::Path;

/// An error of the study, of a figure or of a page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An option, a number or a length of an input, a membrane that is not the meridian of a solid, the phantom, or a file that cannot be
    /// written; an older file of that name is unchanged.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// An input with too few entries.
    #[error("{what}: {given} entries, at least {least} needed")]
    TooFew {
        /// Name of the input.
        what: &'static str,
        /// Number of entries given.
        given: usize,
        /// Smallest number of entries.
        least: usize,
    },
    /// An entry is NaN or infinite.
    #[error("{what}: entry {index} is not finite")]
    NotFinite {
        /// Name of the input.
        what: &'static str,
        /// Position of the first such entry.
        index: usize,
    },
    /// An interval of grey values or coordinates that is empty, reversed or not finite.
    #[error("{what}: from {low:?} to {high:?} is not an interval")]
    Interval {
        /// Name of the input.
        what: &'static str,
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// An error of the plotting library, which draws in memory.
    #[error("drawing failed")]
    Drawing(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Rejects an empty path, which would be the working directory.
pub(crate) fn check_folder(path: &Path) -> Result<(), PhantomError> {
    match path.as_os_str().is_empty() {
        false => Ok(()),
        true => Err(PhantomError::File {
            path: path.to_path_buf(),
            source: io::Error::new(io::ErrorKind::InvalidInput, "the path is empty"),
        }),
    }
}
