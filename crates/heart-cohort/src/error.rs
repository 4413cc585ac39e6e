//! Errors of cohorts, and faults of their files.

use heart_phantom::scene::SceneError;
use heart_phantom::{PhantomError, escape};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

/// An error of a cohort or a shard.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CohortError {
    /// A file could not be read or written, a thread could not be started, or the text of the cohort or its base scene is invalid
    /// ([`PhantomError::Scene`]).
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// No draw of a member met all constraints.
    #[error(
        "member {member}: none of {attempts} draws meets all constraints; `{}` fails in {failed} of them",
        escape(constraint)
    )]
    Unmet {
        /// Index of the member.
        member: u64,
        /// Number of draws.
        attempts: u32,
        /// The constraint that failed most often; a draw counts for the first constraint that it violates.
        // tidy: allow string: the user's own text
        constraint: String,
        /// Number of its failures.
        failed: u32,
    },
    /// An index beyond the members of the cohort.
    #[error("member is {member}; must be below {members}")]
    NoMember {
        /// The index given.
        member: u64,
        /// Number of members.
        members: u64,
    },
    /// A rejected member: its drawn values are not a valid scene, or a shard contains no files of it.
    #[error("member {member} is rejected: {}", escape(what))]
    NoScene {
        /// Index of the member.
        member: u64,
        /// The reason.
        // tidy: allow string: the parser's words, the reason of the row
        what: String,
    },
    /// A shard that does not exist.
    #[error(
        "shard is {shard} of {of}; the number of shards must be between 1 and {most}, the number of members, and the shard between 1 and the number of shards"
    )]
    NoShard {
        /// The shard given.
        shard: u64,
        /// The number of shards given.
        of: u64,
        /// Largest number of shards: the number of members.
        most: u64,
    },
    /// The directory contains a shard of another number of shards.
    #[error(
        "{} is one of {found} shards, not of {given}; choose another directory or compute shards of {found}",
        escape_path(path)
    )]
    OtherDivision {
        /// The existing file.
        path: PathBuf,
        /// Its number of shards.
        found: u64,
        /// The number of shards given.
        given: u64,
    },
    /// The directory contains a shard of another cohort or another version of the program.
    #[error(
        "{} belongs to another cohort or another version of the program; choose another directory",
        escape_path(path)
    )]
    OtherCohort {
        /// Its record.
        path: PathBuf,
    },
    /// Missing shards, or files that do not match their shards.
    #[error(
        "{} has {}: {}",
        escape_path(folder),
        if faults.len() == 1 { "one fault".to_owned() } else { format!("{} faults, the first", faults.len()) },
        faults.first().map_or(String::new(), ToString::to_string)
    )]
    Faults {
        /// The directory.
        folder: PathBuf,
        /// All faults.
        faults: Vec<FileFault>,
    },
    /// A directory without shards.
    #[error("{} contains no shard", escape_path(folder))]
    NoShards {
        /// The directory.
        folder: PathBuf,
    },
}

impl CohortError {
    /// The error of one faulty file.
    pub(crate) fn fault(folder: &Path, fault: FileFault) -> Self {
        let (folder, faults) = (folder.to_path_buf(), vec![fault]);
        Self::Faults { folder, faults }
    }
}

impl From<SceneError> for CohortError {
    fn from(error: SceneError) -> Self {
        Self::Phantom(error.into())
    }
}

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

pub(crate) fn escape_path(path: &Path) -> String {
    escape(&path.to_string_lossy())
}
