//! Errors of the studies and of their pages.

use heart_phantom::PhantomError;
use std::io;
use std::path::Path;

/// An error of a study, of a figure or of a page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An option, a number or a length of an input, a membrane that is not the meridian of a solid, the phantom, or a file that cannot be
    /// written; an older file of that name is unchanged.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// A point of a curve is NaN or infinite.
    #[error("point {index} of a curve is not finite")]
    NotFinite {
        /// Position of the first such point.
        index: usize,
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
