//! All shards of a folder compared with the cohort, some members recomputed.

use crate::cohort::Cohort;
use crate::compute::{Spare, compute};
use crate::error::CohortError;
use crate::fault::{Fault, FileFault};
use crate::folder::Listing;
use crate::record::{Record, Row};
use crate::shard::RunOptions;
use crate::workers;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::path::Path;

/// The result of a verification. The folder contains the cohort if there are no faults.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifyReport {
    /// Shards whose records and archives match the cohort and their checksums.
    pub whole: u64,
    /// Shards of the cut.
    pub shards: u64,
    /// All faults: one of each shard at most, then those of recomputed members.
    pub faults: Vec<FileFault>,
    /// Members that were computed again and whose rows, and with them the bytes, are equal.
    pub recomputed: Vec<u64>,
    /// How many of them were refused again, for the same reason.
    pub refused: u64,
}

/// Verifies a folder.
///
/// Of every shard it compares the record with its own checksum, its rows with the members of the shard, what was drawn for them with
/// the text, and the archive with the checksums of the record. `count` members of whole shards, chosen by `seed`, are then computed
/// again and their whole rows compared: numbers, warnings, reason and checksum. Numbers of members that were not recomputed are as
/// the record has them. It needs no shard in memory, and `count` times the time of a member; a `count` of 0 is allowed.
///
/// # Errors
/// [`CohortError::Cuts`] if the folder has no shards or those of several cuts, [`CohortError::Read`] if it cannot be listed,
/// [`CohortError::Threads`]. A fault is no error.
pub fn verify(
    cohort: &Cohort,
    folder: &Path,
    count: u64,
    seed: u64,
    options: &RunOptions,
) -> Result<VerifyReport, CohortError> {
    let listing = Listing::of(folder)?;
    let chosen = chosen(cohort.members(), count, seed);
    let (mut rows, mut whole): (Vec<(Row, String)>, u64) = (Vec::new(), 0);
    let mut faults = Vec::new();
    for shard in listing.shards() {
        let name = shard.record_name();
        let checked = Record::read(folder, shard)
            .map_err(|fault| FileFault::new(&name, fault))
            .and_then(|record| record.check(cohort, folder).map(|()| record));
        match checked {
            Ok(record) => {
                whole += 1;
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
        let made = compute(cohort, &member, options.memory_of_each(), &spare);
        let is_same = Row::new(&member, made.as_ref(), row.offset) == *row;
        made.into_iter().for_each(|made| spare.give_back(made));
        Ok((k, is_same))
    };
    let (mut recomputed, mut refused) = (Vec::new(), 0);
    workers::in_order(0..rows.len() as u64, &pools, work, |done| {
        let (k, is_same) = done?;
        let (row, name) = &rows[k as usize];
        let member = row.member;
        if is_same {
            recomputed.push(member);
            refused += u64::from(row.refused.is_some());
        } else {
            faults.push(FileFault::new(name, Fault::Recomputed { member }));
        }
        Ok::<(), CohortError>(())
    })?;
    Ok(VerifyReport {
        whole,
        shards: listing.of,
        faults,
        recomputed,
        refused,
    })
}

/// So many different members, or all of them.
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
