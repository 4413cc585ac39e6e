//! The record beside a shard: what the manifest says of each of its members, and the checksums by which it is known to be whole.

use crate::cut::Shard;
use crate::error::CohortError;
use crate::piece::END;
use heart_phantom::Numbers;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

/// What is known of one member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Row {
    /// Its name in the shard, eight digits.
    pub key: String,
    /// Its place in the cohort, from 0.
    pub member: u64,
    /// Name of its case; empty where the cohort has none.
    pub case: String,
    /// Draws that it took to meet the constraints.
    pub attempts: u32,
    /// Why there is no such heart; `None` if it is in the shard.
    pub refused: Option<String>,
    /// Where its piece of the shard begins, in bytes.
    pub offset: u64,
    /// How long that is; 0 for a member that was refused.
    pub bytes: u64,
    /// The checksum of that piece, BLAKE3 in hexadecimal, as `b3sum` prints it; empty for a member that was refused.
    pub blake3: String,
    /// What was drawn, by the dotted paths of the fields.
    pub values: Map<String, Value>,
    /// Volumes in mL, ejection fraction, wall ([`Numbers`]), by name.
    pub numbers: Map<String, Value>,
    /// What may surprise.
    pub warnings: Vec<String>,
}

/// What is written beside a shard, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    /// The program and its version.
    pub(crate) program: String,
    /// Digest of the cohort.
    pub(crate) cohort: String,
    pub(crate) shard: Shard,
    /// Length of the shard.
    pub(crate) bytes: u64,
    pub(crate) rows: Vec<Row>,
}

/// Whether a shard has to be made.
#[derive(Debug, PartialEq)]
pub(crate) enum Found {
    Whole(Record),
    /// It is not there, or not as its record says.
    Broken,
}

impl Record {
    /// Reads a record; `None` if there is none that can be understood.
    pub(crate) fn read(path: &Path) -> Result<Option<Self>, CohortError> {
        match File::open(path) {
            Ok(file) => Ok(serde_json::from_reader(BufReader::new(file)).ok()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(CohortError::Read {
                path: path.to_path_buf(),
                source,
            }),
        }
    }

    /// Whether the archive holds all that the record says, byte by byte.
    pub(crate) fn is_kept_by(&self, archive: &Path) -> bool {
        let kept = || -> io::Result<bool> {
            let file = File::open(archive)?;
            if file.metadata()?.len() != self.bytes {
                return Ok(false);
            }
            let (mut file, mut at) = (BufReader::with_capacity(1 << 20, file), 0);
            for row in self.rows.iter().filter(|row| row.refused.is_none()) {
                if row.offset != at || checksum(&mut (&mut file).take(row.bytes))? != row.blake3 {
                    return Ok(false);
                }
                at += row.bytes;
            }
            let mut end = Vec::new();
            file.read_to_end(&mut end)?;
            Ok(end == END)
        };
        kept().unwrap_or(false)
    }
}

fn checksum(from: &mut impl Read) -> io::Result<String> {
    let mut sum = blake3::Hasher::new();
    sum.update_reader(from)?;
    Ok(sum.finalize().to_string())
}

/// The numbers of a heart by name, with those within others as `within.name`.
pub(crate) fn numbers_of(numbers: &Numbers) -> Map<String, Value> {
    let mut flat = Map::new();
    if let Ok(Value::Object(table)) = serde_json::to_value(numbers) {
        for (name, value) in table {
            match value {
                Value::Object(inner) => {
                    flat.extend(inner.into_iter().map(|(k, v)| (format!("{name}.{k}"), v)));
                }
                value => drop(flat.insert(name, value)),
            }
        }
    }
    flat
}
