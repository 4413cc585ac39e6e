//! What can go wrong with a cohort.

use crate::fault::FileFault;
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
    /// A member that the cohort does not have.
    #[error("member {member}: the cohort has {members} members, and the first is 0")]
    NoMember {
        /// The member given.
        member: u64,
        /// Members of the cohort.
        members: u64,
    },
    /// Values that were drawn for a member and make no scene: a member that is refused.
    #[error("member {member} has no scene: {}", shown(what))]
    NoScene {
        /// Index of the member.
        member: u64,
        /// The field and its fault.
        // tidy: allow string: the parser's words
        what: String,
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
    /// Shards that are missing, or files that are not those of a shard.
    #[error(
        "{} has {} faults, the first: {}",
        shown_path(folder),
        faults.len(),
        faults.first().map_or(String::new(), ToString::to_string)
    )]
    Faults {
        /// The folder.
        folder: PathBuf,
        /// All faults that were found.
        faults: Vec<FileFault>,
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
    /// An option of a Slurm script outside its range.
    #[error("{option} is {}; {wanted}", shown(given))]
    Slurm {
        /// The option.
        option: &'static str,
        /// Its value.
        // tidy: allow string: the user's own text
        given: String,
        /// What is allowed.
        wanted: &'static str,
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
