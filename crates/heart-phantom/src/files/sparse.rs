//! Sparse files: pages of zeros are skipped.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// Unit of a file's storage in bytes; a file system with larger units stores some of the zeros.
const PAGE: usize = 4096;

/// A new file that is written without its pages of zeros.
pub(super) struct SparseFile {
    file: File,
    /// Position of the next byte.
    at: u64,
    /// Number of bytes written or skipped.
    len: u64,
}

impl SparseFile {
    /// `file` is empty.
    pub(super) fn new(file: File) -> Self {
        Self {
            file,
            at: 0,
            len: 0,
        }
    }

    /// Sets the length of the file, whose last pages may have been skipped.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.set_len(self.len)
    }
}

impl Write for SparseFile {
    /// Skips pages of zeros at the end of the file, or writes the bytes before the next page of zeros.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let before = bytes.len().min((PAGE - self.at as usize % PAGE) % PAGE);
        let pages = match self.at == self.len {
            true => bytes[before..].as_chunks::<PAGE>().0,
            // Bytes that replace others are written.
            false => &[],
        };
        let is_zero = |page: &[u8; PAGE]| *page == [0; PAGE];
        let zeros = PAGE * pages.iter().take_while(|page| is_zero(page)).count();
        let done = if before == 0 && zeros > 0 {
            self.file.seek(SeekFrom::Current(zeros as i64))?;
            zeros
        } else {
            let data = pages.iter().position(is_zero);
            let end = data.map_or(bytes.len(), |n| before + n * PAGE);
            self.file.write(&bytes[..end])?
        };
        self.at += done as u64;
        self.len = self.len.max(self.at);
        Ok(done)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for SparseFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        // The end of the file may have been skipped.
        let to = match to {
            SeekFrom::End(by) => SeekFrom::Start(self.len.saturating_add_signed(by)),
            to => to,
        };
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}
