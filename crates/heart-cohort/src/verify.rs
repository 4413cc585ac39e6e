//! Compares all shards of a directory with the cohort and recomputes some members.

use crate::cohort::Cohort;
use crate::compute::{RunOptions, Spare, compute};
use crate::error::{CohortError, Fault, FileFault};
use crate::folder::Listing;
use crate::record::{Record, Row};
use crate::workers;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::path::Path;

/// The result of a verification. Without faults the directory contains the cohort.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use = "faults are not errors"]
#[non_exhaustive]
pub struct VerifyReport {
    /// Number of shards that match the cohort and their checksums.
    pub complete: u64,
    /// Number of shards.
    pub shards: u64,
    /// All faults: at most one per shard, then those of recomputed members.
    pub faults: Vec<FileFault>,
    /// Members whose recomputed rows, including checksums, are identical.
    pub recomputed: Vec<u64>,
    /// Number of these that were rejected again for the same reason.
    pub rejected: u64,
    /// Number of members of complete shards with warnings.
    pub warned: u64,
}

/// Verifies a directory.
///
/// For every shard it compares the record with its checksum, the rows with the members of the shard, the drawn values with the
/// text, and the archive with the checksums of the record. It then recomputes `count` members of complete shards, selected by
/// `seed`, and compares their rows: numbers, warnings, reason and checksum. Numbers of other members are not verified. No shard is
/// kept in memory; the cost is `count` times that of a member. `count` may be 0.
///
/// # Errors
/// [`CohortError::NoShards`], [`CohortError::Phantom`] for the number of threads, if the directory cannot be listed or if a thread cannot be
/// started. A fault is not an error.
pub fn verify(
    cohort: &Cohort,
    folder: &Path,
    count: u64,
    seed: u64,
    options: &RunOptions,
) -> Result<VerifyReport, CohortError> {
    options.check()?;
    let listing = Listing::of(folder)?;
    let chosen = chosen(cohort.members(), count, seed);
    let (mut rows, mut complete): (Vec<(Row, String)>, u64) = (Vec::new(), 0);
    let (mut faults, mut warned) = (Vec::new(), 0);
    for shard in listing.shards() {
        let name = shard.record_name();
        let checked = Record::read(folder, shard)
            .map_err(|fault| FileFault::new(&name, fault))
            .and_then(|record| record.check(cohort, folder).map(|()| record));
        match checked {
            Ok(record) => {
                complete += 1;
                warned += record.warned();
                let wanted = (record.rows.into_iter()).filter(|row| chosen.contains(&row.member));
                rows.extend(wanted.map(|row| (row, name.clone())));
            }
            Err(fault) => faults.push(fault),
        }
    }
    faults.splice(0..0, listing.faults);
    let pools = workers::pools(options.threads)?;
    let spare = Spare::default();
    let work = |k: u64| -> Result<_, CohortError> {
        let (row, _) = &rows[k as usize];
        let member = cohort.member(row.member)?;
        let made = compute(cohort, &member, options, &spare);
        let is_same = Row::new(&member, made.as_ref(), row.offset) == *row;
        made.into_iter().for_each(|made| spare.give_back(made));
        Ok((k, is_same))
    };
    let (mut recomputed, mut rejected) = (Vec::new(), 0);
    workers::in_order(0..rows.len() as u64, &pools, work, |done| {
        let (k, is_same) = done?;
        let (row, name) = &rows[k as usize];
        let member = row.member;
        if is_same {
            recomputed.push(member);
            rejected += u64::from(row.rejected.is_some());
        } else {
            faults.push(FileFault::new(name, Fault::Recomputed { member }));
        }
        Ok::<(), CohortError>(())
    })?;
    Ok(VerifyReport {
        complete,
        shards: listing.of,
        faults,
        recomputed,
        rejected,
        warned,
    })
}

/// Selects a number of distinct members, or all.
fn chosen(members: u64, count: u64, seed: u64) -> BTreeSet<u64> {
    if count >= members {
        return (0..members).collect();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut chosen = BTreeSet::new();
    while (chosen.len() as u64) < count {
        chosen.insert(((u128::from(random.next_u64()) * u128::from(members)) >> 64) as u64);
    }
    chosen
}
