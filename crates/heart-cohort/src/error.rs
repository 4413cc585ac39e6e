//! Errors of cohorts.

use crate::fault::FileFault;
use heart_phantom::{PhantomError, escape};
use std::fmt;
use std::path::{Path, PathBuf};

/// An error of a cohort or a shard.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CohortError {
    /// A file could not be written, or the base scene could not be read or is invalid.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// A file could not be read.
    #[error("cannot read {}", escape_path(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The text of the cohort is invalid.
    #[error(transparent)]
    Text(Box<TextError>),
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
    /// The drawn values of a member are not a valid scene: a rejected member.
    #[error("the scene of member {member} is invalid: {}", escape(what))]
    NoScene {
        /// Index of the member.
        member: u64,
        /// The field and the error.
        // tidy: allow string: the parser's words
        what: String,
    },
    /// A shard that does not exist.
    #[error("shard is {shard} of {of}; must be between 1 of 1 and {most} of {most}")]
    NoShard {
        /// The shard given.
        shard: u64,
        /// The number of shards given.
        of: u64,
        /// Largest number of shards: the number of members.
        most: u64,
    },
    /// A shard of that name belongs to another cohort or another version of the program.
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
        "{} has {} faults, the first: {}",
        escape_path(folder),
        faults.len(),
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
    /// An option of a Slurm script outside its range.
    #[error("{option} is {}; {wanted}", escape(given))]
    Slurm {
        /// The option.
        option: &'static str,
        /// Its value.
        // tidy: allow string: the user's own text
        given: String,
        /// The allowed values.
        wanted: &'static str,
    },
    /// Threads could not be started.
    #[error("cannot start a thread")]
    Threads {
        /// The cause, such as the error of the operating system.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

/// An error in the text of a cohort, with its position.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TextError {
    /// The file, if it came from one.
    pub file: Option<PathBuf>,
    /// Line and column, from 1.
    pub place: Option<[usize; 2]>,
    /// The field, such as `vary.heart.inner.radius`; empty if the text is not TOML.
    // tidy: allow string: the path of a field in the file
    pub field: String,
    /// The error.
    // tidy: allow string: the parser's words, or those of a scene's error
    pub what: String,
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", escape_path(file))?;
        }
        match (&self.file, self.place) {
            (Some(_), Some([line, column])) => write!(f, "{line}:{column}: ")?,
            (Some(_), None) => f.write_str(" ")?,
            (None, Some([line, column])) => write!(f, "line {line}, column {column}: ")?,
            (None, None) => {}
        }
        if !self.field.is_empty() {
            write!(f, "{}: ", escape(&self.field))?;
        }
        f.write_str(&escape(&self.what))
    }
}

impl std::error::Error for TextError {}

impl CohortError {
    /// The error of one faulty file.
    pub(crate) fn fault(folder: &Path, fault: FileFault) -> Self {
        let (folder, faults) = (folder.to_path_buf(), vec![fault]);
        Self::Faults { folder, faults }
    }
}

impl From<TextError> for CohortError {
    fn from(error: TextError) -> Self {
        Self::Text(Box::new(error))
    }
}

pub(crate) fn escape_path(path: &Path) -> String {
    escape(&path.to_string_lossy())
}
