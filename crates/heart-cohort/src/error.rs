//! What can go wrong with a cohort.

use heart_phantom::{PhantomError, shown};
use std::fmt;
use std::path::{Path, PathBuf};

/// Why there is no shard, or no cohort.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CohortError {
    /// A file could not be written; or the base scene could not be read or makes no sense.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// A file could not be read.
    #[error("cannot read {}", shown_path(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The text of a cohort makes no sense.
    #[error(transparent)]
    Text(Box<TextError>),
    /// Constraints that the draws of a member never met together.
    #[error(
        "member {member}: none of {attempts} draws meets all constraints; `{}` fails in {failed} of them",
        shown(constraint)
    )]
    Unmet {
        /// Index of the member.
        member: u64,
        /// Draws that were made.
        attempts: u32,
        /// The constraint that failed most often; of draws that break several the first one counts.
        // tidy: allow string: the user's own text
        constraint: String,
        /// How often.
        failed: u32,
    },
    /// A shard that there is not.
    #[error("shard {shard} of {of}: there are 1 to {most} shards, and the first is 1")]
    NoShard {
        /// The shard given.
        shard: u64,
        /// Shards given.
        of: u64,
        /// Most shards: the members.
        most: u64,
    },
    /// A shard of that name is of another cohort, or by another version of the program.
    #[error(
        "{} is of another cohort, or by another version of the program; choose another folder",
        shown_path(path)
    )]
    OtherCohort {
        /// Its record.
        path: PathBuf,
    },
    /// Shards that are not there, or not whole.
    #[error(
        "{missing} of {of} shards are missing in {} or not whole, the first is {first}",
        shown_path(folder)
    )]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// How many.
        missing: u64,
        /// Shards that there should be.
        of: u64,
        /// The first of them.
        first: u64,
    },
    /// A folder without shards, or with those of several cuts.
    #[error(
        "{} has shards of {cuts} cohorts or cuts, where there should be those of one",
        shown_path(folder)
    )]
    Cuts {
        /// The folder.
        folder: PathBuf,
        /// How many.
        cuts: usize,
    },
    /// A member that comes out with other bytes than those of its shard.
    #[error(
        "member {member} has other bytes in {} than it has now",
        shown_path(path)
    )]
    Differs {
        /// Index of the member.
        member: u64,
        /// The shard.
        path: PathBuf,
    },
    /// Threads could not be started.
    #[error("cannot start a thread")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// What is wrong with the text of a cohort, and where.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TextError {
    /// The file, if it came from one.
    pub file: Option<PathBuf>,
    /// Line and column, from 1.
    pub place: Option<[usize; 2]>,
    /// The field of the cohort, such as `vary.heart.inner.radius`; empty where the text is no TOML.
    // tidy: allow string: the path of a field in the file
    pub field: String,
    /// What is wrong.
    // tidy: allow string: the parser's words, or those of a scene's error
    pub what: String,
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", shown_path(file))?;
        }
        match (&self.file, self.place) {
            (Some(_), Some([line, column])) => write!(f, "{line}:{column}: ")?,
            (Some(_), None) => f.write_str(" ")?,
            (None, Some([line, column])) => write!(f, "line {line}, column {column}: ")?,
            (None, None) => {}
        }
        if !self.field.is_empty() {
            write!(f, "{}: ", shown(&self.field))?;
        }
        f.write_str(&shown(&self.what))
    }
}

impl std::error::Error for TextError {}

impl From<TextError> for CohortError {
    fn from(error: TextError) -> Self {
        Self::Text(Box::new(error))
    }
}

pub(crate) fn shown_path(path: &Path) -> String {
    shown(&path.to_string_lossy())
}
