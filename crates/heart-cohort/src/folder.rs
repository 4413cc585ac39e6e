//! The shards of a folder, as their records have them.

use crate::cut::Shard;
use crate::error::CohortError;
use crate::record::Record;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The shards of a folder that hold all of a cohort, from the first to the last.
///
/// # Errors
/// [`CohortError::Cuts`] if there are none, or those of several cuts; [`CohortError::Missing`] if one has no record, or no archive of the
/// length that the record says.
pub(crate) fn shards_of(folder: &Path) -> Result<Vec<Shard>, CohortError> {
    let unread = |source| CohortError::Read {
        path: folder.to_path_buf(),
        source,
    };
    let mut cuts = BTreeSet::new();
    for entry in fs::read_dir(folder).map_err(unread)? {
        let name = entry.map_err(unread)?.file_name();
        cuts.extend(name.to_str().and_then(cut_of));
    }
    let one: Vec<u64> = cuts.into_iter().collect();
    let &[of] = &one[..] else {
        return Err(CohortError::Cuts {
            folder: folder.to_path_buf(),
            cuts: one.len(),
        });
    };
    let shards: Vec<Shard> = (1..=of).map(|shard| Shard { shard, of }).collect();
    let mut missing = Vec::new();
    for shard in &shards {
        let archive = folder.join(shard.file_name());
        // Names are looked at here, records when they are needed: of a million members they are large.
        if !archive.is_file() || !archive.with_extension("json").is_file() {
            missing.push(shard.shard);
        }
    }
    match missing.first() {
        None => Ok(shards),
        Some(&first) => Err(missing_of(folder, missing.len() as u64, of, first)),
    }
}

/// The record of a shard, whose archive has the length that it says.
pub(crate) fn record_of(folder: &Path, shard: Shard) -> Result<Record, CohortError> {
    let archive = folder.join(shard.file_name());
    let length = fs::metadata(&archive).map_or(0, |found| found.len());
    match Record::read(&archive.with_extension("json"))? {
        Some(record) if record.bytes == length && record.shard == shard => Ok(record),
        _ => Err(missing_of(folder, 1, shard.of, shard.shard)),
    }
}

pub(crate) fn missing_of(folder: &Path, missing: u64, of: u64, first: u64) -> CohortError {
    CohortError::Missing {
        folder: folder.to_path_buf(),
        missing,
        of,
        first,
    }
}

/// How many shards there are, by the name of one of their records.
fn cut_of(name: &str) -> Option<u64> {
    let (shard, of) = name
        .strip_prefix("shard-")?
        .strip_suffix(".json")?
        .split_once("-of-")?;
    shard.parse::<u64>().ok()?;
    of.parse().ok()
}
