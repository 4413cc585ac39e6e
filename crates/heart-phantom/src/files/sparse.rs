//! Sparse files: pages of zeros are skipped.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// Unit of a file's storage in bytes; a file system with larger units stores some of the zeros.
const PAGE: usize = 4096;

/// A new file that is written from its beginning, without its pages of zeros.
pub(super) struct SparseFile {
    file: File,
    /// Number of bytes written or skipped.
    at: u64,
    /// Whether the last bytes were skipped.
    skipped: bool,
}

impl SparseFile {
    /// `file` is empty.
    pub(super) fn new(file: File) -> Self {
        Self {
            file,
            at: 0,
            skipped: false,
        }
    }

    /// Sets the length of a file whose last pages were skipped.
    pub(super) fn finish(self) -> io::Result<()> {
        match self.skipped {
            true => self.file.set_len(self.at),
            false => Ok(()),
        }
    }
}

impl Write for SparseFile {
    /// Skips the pages of zeros at the beginning of `bytes`, or writes the bytes before the next page of zeros.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let before = bytes.len().min((PAGE - self.at as usize % PAGE) % PAGE);
        let pages = bytes[before..].as_chunks::<PAGE>().0;
        let is_zero = |page: &[u8; PAGE]| *page == [0; PAGE];
        let zeros = match before {
            0 => pages.iter().take_while(|page| is_zero(page)).count() * PAGE,
            _ => 0,
        };
        if zeros > 0 {
            self.file.seek(SeekFrom::Current(zeros as i64))?;
            self.skipped = true;
            self.at += zeros as u64;
            return Ok(zeros);
        }
        let data = pages.iter().position(is_zero);
        let end = data.map_or(bytes.len(), |n| before + n * PAGE);
        let written = self.file.write(&bytes[..end])?;
        self.skipped &= written == 0;
        self.at += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
