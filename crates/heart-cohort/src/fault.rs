//! Faults of the files of a cohort.

use heart_phantom::escape;
use serde::Serialize;
use std::fmt;

/// A fault of a shard: a difference between its files and those that [`run_shard`](crate::run_shard) writes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Fault {
    /// The file does not exist, nor do those of following shards.
    #[error("is missing{}", if *following > 0 { format!(", and the next {following}") } else { String::new() })]
    Missing {
        /// Number of following shards that are missing too.
        following: u64,
    },
    /// A directory, a pipe or a device.
    #[error("is not a regular file")]
    NotAFile,
    /// The file cannot be read.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// The message of the operating system.
        // tidy: allow string: the words of the operating system
        reason: String,
    },
    /// A name that resembles that of a shard, such as `shard-0-of-0.json`, or that has another number of shards than most files.
    #[error("is not the name of a shard of this cohort")]
    Name,
    /// A record that does not match its checksum.
    #[error("does not match its own checksum")]
    Checksum,
    /// A record of another cohort text or another version of the program.
    #[error("belongs to another cohort or another version of the program")]
    OtherCohort,
    /// A record that does not list the members of its shard, each once and in order, with adjacent parts of the archive.
    #[error("does not list the members of its shard")]
    Members,
    /// A row with another case, number of draws or values than the text gives.
    #[error("has values of member {member} that differ from those drawn for it")]
    Drawn {
        /// Index of the member.
        member: u64,
    },
    /// An archive that does not match the checksums of its record.
    #[error("differs from its record in {}", member.map_or("its length or its end".to_owned(), |member| format!("member {member}")))]
    Archive {
        /// Index of the first member that differs; `None` for the length or the end of the archive.
        member: Option<u64>,
    },
    /// A row that differs from the recomputed one: numbers, warnings, reason or checksum.
    #[error("has a row of member {member} that differs from the recomputed one")]
    Recomputed {
        /// Index of the member.
        member: u64,
    },
}

/// A file and its fault.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct FileFault {
    /// Name of the file in its directory.
    // tidy: allow string: a name as it was found
    pub file: String,
    /// Its fault.
    pub fault: Fault,
}

impl FileFault {
    pub(crate) fn new(file: impl Into<String>, fault: Fault) -> Self {
        let file = file.into();
        Self { file, fault }
    }
}

impl fmt::Display for FileFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} {}",
            escape(&self.file),
            escape(&self.fault.to_string())
        )
    }
}
