//! Errors of cohorts.

use crate::fault::FileFault;
use heart_phantom::scene::SceneError;
use heart_phantom::{PhantomError, escape};
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

pub(crate) fn escape_path(path: &Path) -> String {
    escape(&path.to_string_lossy())
}
