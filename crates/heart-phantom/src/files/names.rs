//! File names, and lengths in headers.

use crate::error::PhantomError;
use crate::text::short;
use std::path::Path;

/// Rounded for readability of headers.
pub(super) fn millimetres(cm: f64) -> f64 {
    short(10.0 * cm)
}

/// Checks that the path ends in `.extension` after a name, not only dots, that fits on a header line.
pub(super) fn check_extension(path: &Path, extension: &'static str) -> Result<(), PhantomError> {
    let name = path.file_name().and_then(|name| name.to_str());
    let stem = name.and_then(|name| name.strip_suffix(extension)?.strip_suffix('.'));
    let (path, expected) = (path.to_path_buf(), extension);
    match stem {
        None => Err(PhantomError::Extension { path, expected }),
        Some(stem) if stem.trim_matches('.').is_empty() || stem.contains(char::is_control) => {
            Err(PhantomError::Name { path })
        }
        Some(_) => Ok(()),
    }
}

/// Returns the path of the data file of a header, and its name for the header.
pub(super) fn data_beside(header: &Path, extension: &str) -> (std::path::PathBuf, String) {
    let data = header.with_extension(extension);
    // `check_extension` verified that the name is Unicode.
    let name = data
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    (data, name.unwrap_or_default())
}
