//! Computes a shard: consecutive members in one archive, with its record.

use crate::cohort::Cohort;
use crate::compute::{RunOptions, Spare, compute};
use crate::error::{CohortError, Fault, FileFault};
use crate::folder::Shard;
use crate::piece::END;
use crate::record::{Record, Row};
use crate::workers;
use heart_phantom::{Observer, PhantomError, files};
use rayon::ThreadPool;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The result of a shard.
#[derive(Debug, Clone, PartialEq)]
#[must_use = "members may be rejected"]
#[non_exhaustive]
pub struct ShardReport {
    /// The archive.
    pub path: PathBuf,
    /// Whether it was complete before, so that nothing was computed.
    pub skipped: bool,
    /// One row per member.
    pub rows: Vec<Row>,
    /// Number of rejected members.
    pub rejected: u64,
    /// Number of members with warnings.
    pub warned: u64,
    /// Length of the archive in bytes.
    pub bytes: u64,
}

/// Computes a shard of a cohort in a directory unless it is complete. The archive and its record appear under their names when they
/// are complete, the record last. Partial files of killed processes are removed. A member that cannot be computed is a row with its
/// reason, not an error ([`ShardReport::rejected`]).
///
/// An interrupted shard is computed again from its first member. Choose the number of shards so that one takes minutes rather than hours;
/// [`survey`](crate::survey()) measures members per second.
///
/// The bytes are a function of the cohort, the version of the program and the shard. Two processes may compute the same shard in
/// the same directory. `progress` receives the number of completed members.
///
/// ```
/// use heart_cohort::{Cohort, RunOptions, Shard, heart_phantom::no_observer, run_shard};
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
/// let report = run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &no_observer)?;
/// assert!(report.rows.len() == 2 && report.rejected == 0 && !report.skipped);
/// assert!(run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &no_observer)?.skipped);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Before any work: [`PhantomError::Count`] for the number of threads, [`CohortError::NoShard`], [`CohortError::Unmet`] for constraints that
/// a member of the shard cannot meet,
/// [`CohortError::OtherDivision`] for a directory with shards of another number, [`CohortError::OtherCohort`] for one with shards of another
/// cohort, [`CohortError::Faults`] for a pipe or a directory of that name,
/// [`CohortError::Phantom`] for a directory that is not writable. Later: [`CohortError::Phantom`] for a full disk and, if
/// `progress` stops the shard, with [`PhantomError::Stopped`].
pub fn run_shard(
    cohort: &Cohort,
    folder: &Path,
    shard: Shard,
    options: &RunOptions,
    progress: Observer<'_, u64>,
) -> Result<ShardReport, CohortError> {
    options.check()?;
    // Draws all members first: it takes microseconds and detects unmet constraints before writing.
    (shard.members(cohort)?).try_for_each(|index| cohort.member(index).map(drop))?;
    let pools = workers::pools(options.threads)?;
    files::create_writable_folder(folder)?;
    check_others(cohort, folder, shard)?;
    let path = folder.join(shard.file_name());
    let left = shard.file_name();
    let left = left.trim_end_matches("tar");
    if let Some(record) = whole(cohort, folder, shard)? {
        remove_left(folder, left);
        return Ok(report(path, true, record));
    }
    match write(cohort, shard, &path, &pools, options, progress) {
        Ok(record) => {
            remove_left(folder, left);
            Ok(report(path, false, record))
        }
        Err(error @ CohortError::Phantom(PhantomError::Stopped)) => Err(error),
        // Another process may have completed the shard and removed the temporary file.
        Err(error) => match whole(cohort, folder, shard)? {
            Some(record) => Ok(report(path, true, record)),
            None => Err(error),
        },
    }
}

/// Rejects a directory of another number of shards or with the shards of another cohort, which could not be merged: compares all names and
/// the first record that matches its checksum.
fn check_others(cohort: &Cohort, folder: &Path, shard: Shard) -> Result<(), CohortError> {
    let mut known = None;
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(found) = name.to_str().and_then(Shard::of_file_name) else {
            continue;
        };
        if found.of != shard.of {
            return Err(CohortError::OtherDivision {
                path: entry.path(),
                found: found.of,
                given: shard.of,
            });
        }
        if known.is_none() && name == *found.record_name() {
            known = Record::read(folder, found).ok();
        }
    }
    match known.filter(|record| !record.is_of(cohort)) {
        None => Ok(()),
        Some(record) => Err(CohortError::OtherCohort {
            path: folder.join(record.shard.record_name()),
        }),
    }
}

/// Computes and writes the archive, then its record.
fn write(
    cohort: &Cohort,
    shard: Shard,
    path: &Path,
    pools: &[ThreadPool],
    options: &RunOptions,
    progress: Observer<'_, u64>,
) -> Result<Record, CohortError> {
    let range = shard.members(cohort)?;
    let (mut rows, mut bytes, mut ended) = (Vec::new(), 0, None);
    let spare = Spare::default();
    let work = |index| {
        let member = cohort.member(index)?;
        let made = compute(cohort, &member, options, &spare);
        Ok((member, made))
    };
    let written = files::write_atomically(path, |out| {
        workers::in_order(range, pools, work, |done: Result<_, CohortError>| {
            let (member, made) = done.map_err(|error| {
                ended = Some(error);
                io::Error::other("a member cannot be drawn")
            })?;
            let piece = made.as_ref().map_or(&[][..], |made| &made.bytes[..]);
            out.write_all(piece)?;
            rows.push(Row::new(&member, made.as_ref(), bytes));
            bytes += piece.len() as u64;
            made.into_iter().for_each(|made| spare.give_back(made));
            if progress(rows.len() as u64).is_break() {
                ended = Some(PhantomError::Stopped.into());
                return Err(io::Error::other("stopped"));
            }
            Ok::<(), io::Error>(())
        })?;
        bytes += END.len() as u64;
        out.write_all(&END)
    });
    if let Some(error) = ended {
        return Err(error);
    }
    written?;
    let record = Record::new(cohort, shard, bytes, rows);
    record.write(&path.with_extension("json"))?;
    Ok(record)
}

fn report(path: PathBuf, skipped: bool, record: Record) -> ShardReport {
    ShardReport {
        path,
        skipped,
        rejected: record.rejected(),
        warned: record.warned(),
        rows: record.rows,
        bytes: record.bytes,
    }
}

/// Returns the record of a complete shard; `None` if it must be computed.
///
/// # Errors
/// [`CohortError::OtherCohort`]; [`CohortError::Faults`] if a name is not a regular file.
fn whole(cohort: &Cohort, folder: &Path, shard: Shard) -> Result<Option<Record>, CohortError> {
    let record = match Record::read(folder, shard) {
        Ok(record) => record,
        Err(fault @ (Fault::NotAFile | Fault::Unreadable { .. })) => {
            let found = FileFault::new(shard.record_name(), fault);
            return Err(CohortError::fault(folder, found));
        }
        Err(_) => return Ok(None),
    };
    if !record.is_of(cohort) {
        let path = folder.join(shard.record_name());
        return Err(CohortError::OtherCohort { path });
    }
    match record.check(cohort, folder) {
        Ok(()) => Ok(Some(record)),
        Err(found) if found.fault == Fault::NotAFile => Err(CohortError::fault(folder, found)),
        Err(_) => Ok(None),
    }
}

/// Removes temporary files with a prefix, left by killed processes. A process that still computes the same shard loses only its
/// copy.
pub(crate) fn remove_left(folder: &Path, beginning: &str) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let is_left = name
            .to_str()
            .is_some_and(|name| name.starts_with(beginning) && name.ends_with(".tmp"));
        if is_left {
            // A file that cannot be removed now is removed by the next run.
            let _ = fs::remove_file(entry.path());
        }
    }
}
