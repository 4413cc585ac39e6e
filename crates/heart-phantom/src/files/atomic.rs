//! Files: written whole or not at all.

use crate::error::PhantomError;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a file atomically: `fill` writes to a temporary file in the same folder, which then
/// takes the name `path`. On any failure (no such folder, no permission, disk full) the temporary
/// file is removed and an older file at `path` stays as it was.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), PhantomError> {
    let failed = |source| PhantomError::File {
        path: path.to_path_buf(),
        source,
    };
    let name = path
        .file_name()
        .ok_or_else(|| failed(std::io::ErrorKind::InvalidInput.into()))?;
    // The process id keeps two runs that write the same file from sharing a temporary one.
    let mut temporary = name.to_os_string();
    temporary.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(temporary);
    let written = File::create(&temporary).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 20, file);
        fill(&mut out)?;
        out.flush()
    });
    written
        .and_then(|()| fs::rename(&temporary, path))
        .map_err(|error| {
            // Best effort: the write's own error is the one worth reporting.
            let _ = fs::remove_file(&temporary);
            failed(error)
        })
}

/// Makes the folder `path` with its parents if need be and makes sure that files can be written to
/// it, so that a long computation does not end with nowhere to put its result.
///
/// # Errors
/// [`PhantomError::File`] with the path and the cause.
pub fn create_writable_folder(path: &Path) -> Result<(), PhantomError> {
    fs::create_dir_all(path).map_err(|source| PhantomError::File {
        path: path.to_path_buf(),
        source,
    })?;
    let probe = path.join(format!(".{}.probe", std::process::id()));
    write_atomically(&probe, |_| Ok(()))?;
    fs::remove_file(&probe).map_err(|source| PhantomError::File {
        path: probe,
        source,
    })
}

/// Writes `values` as a NumPy `.npy` file of little-endian `f32` in C order.
///
/// `shape` lists the axes from slowest to fastest; the product of its entries is `values.len()`.
///
/// # Errors
/// [`PhantomError::Length`] if `shape` and `values` disagree; [`PhantomError::File`] if the file
/// cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f32]) -> Result<(), PhantomError> {
    let expected = shape.iter().product();
    if values.len() != expected {
        return Err(PhantomError::Length {
            what: "npy values",
            given: values.len(),
            expected,
        });
    }
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    write_atomically(path, |out| {
        use npyz::WriterBuilder;
        let mut npy = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&shape)
            .writer(out)
            .begin_nd()?;
        npy.extend(values.iter().copied())?;
        npy.finish()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn npy_comes_back_as_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let values: Vec<f32> = (0..24).map(|k| k as f32 * 0.5).collect();
        write_npy(&path, &[2, 3, 4], &values).unwrap();
        let npy = npyz::NpyFile::new(std::fs::File::open(&path).unwrap()).unwrap();
        assert_eq!(npy.shape(), &[2, 3, 4]);
        assert_eq!(npy.into_vec::<f32>().unwrap(), values);
        // Nothing else is left in the folder.
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn failure_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let result = write_atomically(&path, |out| {
            out.write_all(b"half of it")?;
            Err(std::io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(result, Err(PhantomError::File { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn wrong_length_and_missing_folder_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/folder.npy");
        assert!(matches!(
            write_npy(&path, &[2, 2], &[0.0; 3]),
            Err(PhantomError::Length {
                given: 3,
                expected: 4,
                ..
            })
        ));
        assert!(matches!(
            write_npy(&path, &[2, 2], &[0.0; 4]),
            Err(PhantomError::File { .. })
        ));
    }
}
