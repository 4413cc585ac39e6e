//! Reading of files of limited size.

use crate::error::PhantomError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest size of a file of a scene; an endless device is not read to its end.
const MOST_BYTES: u64 = 1 << 24;

/// Reads a file of a scene.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, PhantomError> {
    let read = |path| {
        let mut bytes = Vec::new();
        let file = File::open(path)?;
        file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        Ok(bytes)
    };
    read(path).map_err(|source| PhantomError::Read {
        path: path.to_path_buf(),
        source,
    })
}
