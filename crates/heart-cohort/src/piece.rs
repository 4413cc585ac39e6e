//! The part of an archive that contains a member: files `KEY.name` in the layout of WebDataset, with headers that do not depend on
//! user, machine or time.

use serde_json::Value;
use std::io::{self, Write};
use tar::Header;

/// Length of a header; files are padded to a multiple of it.
const BLOCK: usize = 512;
/// The end of an archive.
pub(crate) const END: [u8; 2 * BLOCK] = [0; 2 * BLOCK];

pub(crate) struct Piece {
    key: String,
    bytes: Vec<u8>,
}

impl Piece {
    /// An empty piece in the memory of an earlier one.
    pub(crate) fn new(key: &str, mut bytes: Vec<u8>) -> Self {
        bytes.clear();
        Self {
            key: key.to_owned(),
            bytes,
        }
    }

    pub(crate) fn add_json(&mut self, name: &str, value: &Value) -> io::Result<()> {
        self.add(name, |out| writeln!(out, "{value:#}"))
    }

    /// Adds a file with mode 644, user and group 0, 1 January 1970.
    pub(crate) fn add(
        &mut self,
        name: &str,
        fill: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
    ) -> io::Result<()> {
        let at = self.bytes.len();
        self.bytes.resize(at + BLOCK, 0);
        fill(&mut self.bytes)?;
        let size = self.bytes.len() - at - BLOCK;
        let mut header = Header::new_ustar();
        header.set_entry_type(tar::EntryType::Regular);
        header.set_path(format!("{}.{name}", self.key))?;
        header.set_size(size as u64);
        header.set_mode(0o644);
        header.set_uid(0);
        header.set_gid(0);
        header.set_mtime(0);
        header.set_cksum();
        self.bytes[at..at + BLOCK].copy_from_slice(header.as_bytes());
        let filled_up = self.bytes.len().next_multiple_of(BLOCK);
        self.bytes.resize(filled_up, 0);
        Ok(())
    }

    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}
