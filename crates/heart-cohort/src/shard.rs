//! A shard: some members in a row, computed and written as one archive with its record.

use crate::cohort::Cohort;
use crate::compute::{Computed, Spare, compute};
use crate::cut::Shard;
use crate::draw::Member;
use crate::error::CohortError;
use crate::piece::END;
use crate::record::{Found, Record, Row, numbers_of};
use crate::workers;
use heart_phantom::Heart;
use heart_phantom::files::{self, PROGRAM};
use rayon::ThreadPool;
use serde_json::Map;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What became of a shard.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ShardReport {
    /// The archive.
    pub path: PathBuf,
    /// Whether it was whole already, and nothing was computed.
    pub skipped: bool,
    /// A row for each of its members.
    pub rows: Vec<Row>,
    /// Length of the archive.
    pub bytes: u64,
}

impl ShardReport {
    /// How many members were refused.
    pub fn refused(&self) -> usize {
        self.rows.iter().filter(|row| row.refused.is_some()).count()
    }
}

/// How a shard is computed; nothing of it changes a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RunOptions {
    /// Members that are computed side by side, each on one thread.
    pub threads: usize,
    /// Bytes for shapes of the heart, of all threads together ([`Heart::with_memory`]).
    pub memory: usize,
}

impl RunOptions {
    /// So many members side by side.
    pub fn new(threads: usize) -> Self {
        Self {
            threads,
            memory: Heart::DEFAULT_MEMORY,
        }
    }

    /// The same with other bytes for shapes.
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.memory = bytes;
        self
    }

    pub(crate) fn memory_of_each(&self) -> usize {
        self.memory / self.threads.max(1)
    }
}

/// Makes a shard of a cohort in a folder, unless it is whole there. The archive and its record take their names when they are
/// complete, the record last; what an earlier process that was killed has left half written goes.
///
/// The bytes depend on the cohort, the version of the program and the shard, not on threads or on who else works in the folder: two
/// that make the same shard do no harm. `progress` is told the number of members done.
///
/// ```
/// use heart_cohort::{Cohort, RunOptions, Shard, run_shard};
/// let cohort = Cohort::from_toml(r#"
/// members = 4
/// [scene]
/// heart.discretisation = { differences = { nodes = 51 } }
/// camera = { views = 4, bins = 8, rows = 8, pitch = [2.0, 2.0] }
/// output.write = ["projections"]
/// [vary]
/// cycle.volume.gain = { uniform = [0.3, 0.6] }
/// "#)?;
/// let folder = tempfile::tempdir()?; // or any other
/// let shard = Shard { shard: 1, of: 2 };
/// let report = run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &|_| ())?;
/// assert!(report.rows.len() == 2 && report.refused() == 0 && !report.skipped);
/// assert!(run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &|_| ())?.skipped);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Before any work [`CohortError::NoShard`], [`CohortError::Unmet`] for constraints that a member of the shard cannot meet,
/// [`CohortError::OtherCohort`] for a shard of that name of another cohort, [`CohortError::Phantom`] for a folder that cannot be written
/// to; later that for a disk that is full.
pub fn run_shard(
    cohort: &Cohort,
    folder: &Path,
    shard: Shard,
    options: &RunOptions,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<ShardReport, CohortError> {
    let range = shard.members(cohort)?;
    // All draws first: they take microseconds, and one that cannot be made is found before anything is written.
    range
        .clone()
        .try_for_each(|index| cohort.member(index).map(drop))?;
    let pools = workers::pools(options.threads)?;
    files::create_writable_folder(folder)?;
    let path = folder.join(shard.file_name());
    let record = match found(cohort, shard, &path)? {
        Found::Whole(record) => {
            remove_left(folder, shard);
            return Ok(report(path, true, record));
        }
        Found::Broken => write(cohort, shard, &path, &pools, options, progress),
    };
    let skipped = match record {
        Ok(record) => {
            remove_left(folder, shard);
            return Ok(report(path, false, record));
        }
        Err(error) => (error, found(cohort, shard, &path)?),
    };
    match skipped {
        // Another process was faster, and has removed what was begun here.
        (_, Found::Whole(record)) => Ok(report(path, true, record)),
        (error, Found::Broken) => Err(error),
    }
}

/// Computes and writes the archive, then its record.
fn write(
    cohort: &Cohort,
    shard: Shard,
    path: &Path,
    pools: &[ThreadPool],
    options: &RunOptions,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Record, CohortError> {
    let range = shard.members(cohort)?;
    let (mut rows, mut bytes, mut undrawn) = (Vec::new(), 0, None);
    let spare = Spare::default();
    let work = |index| {
        let member = cohort.member(index)?;
        let made = compute(&member, options.memory_of_each(), &spare);
        Ok((member, made))
    };
    let written = files::write_atomically(path, |out| {
        workers::in_order(range, pools, work, |done: Result<_, CohortError>| {
            let (member, made) = done.map_err(|error| {
                undrawn = Some(error);
                io::Error::other("a member cannot be drawn")
            })?;
            let piece = made.as_ref().map_or(&[][..], |made| &made.bytes[..]);
            out.write_all(piece)?;
            rows.push(row_of(&member, made.as_ref(), bytes));
            bytes += piece.len() as u64;
            made.into_iter().for_each(|made| spare.give_back(made));
            progress(rows.len() as u64);
            Ok::<(), io::Error>(())
        })?;
        bytes += END.len() as u64;
        out.write_all(&END)
    });
    if let Some(error) = undrawn {
        return Err(error);
    }
    written?;
    let record = Record {
        program: PROGRAM.to_owned(),
        cohort: cohort.digest().to_owned(),
        shard,
        bytes,
        rows,
    };
    files::write_atomically(&path.with_extension("json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &record)?;
        out.write_all(b"\n")
    })?;
    Ok(record)
}

fn report(path: PathBuf, skipped: bool, record: Record) -> ShardReport {
    ShardReport {
        path,
        skipped,
        rows: record.rows,
        bytes: record.bytes,
    }
}

/// What is there of a shard.
pub(crate) fn found(cohort: &Cohort, shard: Shard, path: &Path) -> Result<Found, CohortError> {
    let record_path = path.with_extension("json");
    let Some(record) = Record::read(&record_path)? else {
        return Ok(Found::Broken);
    };
    let is_ours = record.cohort == cohort.digest() && record.program == PROGRAM;
    if !is_ours || record.shard != shard {
        return Err(CohortError::OtherCohort { path: record_path });
    }
    Ok(match record.is_kept_by(path) {
        true => Found::Whole(record),
        false => Found::Broken,
    })
}

/// Removes what processes that were killed have left of a shard that is whole now. Another one that still makes the same shard loses
/// nothing but its own copy.
pub(crate) fn remove_left(folder: &Path, shard: Shard) {
    let name = shard.file_name();
    let stem = name.trim_end_matches("tar");
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let is_left = name
            .to_str()
            .is_some_and(|name| name.starts_with(stem) && name.ends_with(".tmp"));
        if is_left {
            // Whoever is left over goes next time.
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn row_of(member: &Member, made: Result<&Computed, &String>, offset: u64) -> Row {
    Row {
        key: member.key.clone(),
        member: member.index,
        case: member.case.clone(),
        attempts: member.attempts,
        refused: made.err().cloned(),
        offset,
        bytes: made.map_or(0, |made| made.bytes.len() as u64),
        blake3: made.map_or(String::new(), |made| made.blake3.clone()),
        values: member.values.iter().cloned().collect(),
        numbers: made.map_or_else(|_| Map::new(), |made| numbers_of(&made.numbers)),
        warnings: made.map_or(Vec::new(), |made| made.warnings.clone()),
    }
}
