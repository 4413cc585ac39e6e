//! Some members computed again, and their bytes compared.

use crate::cohort::Cohort;
use crate::compute::{Spare, compute};
use crate::cut::Shard;
use crate::error::CohortError;
use crate::folder;
use crate::record::{Found, Row};
use crate::shard::{RunOptions, found};
use crate::workers;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// What was found to be as it should.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifyReport {
    /// Shards whose checksums are right.
    pub shards: u64,
    /// The members that were computed again, all with the same bytes.
    pub members: Vec<u64>,
    /// How many of them were refused, as they had been.
    pub refused: u64,
}

/// Checks all shards of a folder by their checksums, then computes `count` members again, chosen by `seed`, and compares them byte by
/// byte with what is there. It needs no shard in memory, and `count` times the time of a member.
///
/// # Errors
/// [`CohortError::Cuts`] or [`CohortError::Missing`] if the folder does not hold the whole cohort, a shard that its checksums do not fit
/// included; [`CohortError::OtherCohort`]; [`CohortError::Differs`] for the first member that comes out otherwise.
pub fn verify(
    cohort: &Cohort,
    folder: &Path,
    count: u64,
    seed: u64,
    options: &RunOptions,
) -> Result<VerifyReport, CohortError> {
    let shards = folder::shards_of(folder)?;
    let chosen: Vec<u64> = chosen(cohort.members(), count, seed).into_iter().collect();
    let mut rows: Vec<(Row, PathBuf)> = Vec::new();
    let broken = check_all(cohort, folder, &shards, &chosen, &mut rows)?;
    if let Some(&first) = broken.first() {
        let (missing, of) = (broken.len() as u64, shards.len() as u64);
        return Err(folder::missing_of(folder, missing, of, first));
    }
    let pools = workers::pools(options.threads)?;
    let (mut refused, spare) = (0, Spare::default());
    let work = |k: u64| {
        let (row, path) = &rows[k as usize];
        let member = cohort.member(row.member)?;
        let made = compute(&member, options.memory_of_each(), &spare);
        let is_same = match (&made, &row.refused) {
            (Ok(made), None) => bytes_of(row, path).is_ok_and(|bytes| bytes == made.bytes),
            (Err(reason), Some(known)) => reason == known,
            _ => false,
        };
        let is_refused = made.is_err();
        made.into_iter().for_each(|made| spare.give_back(made));
        match is_same {
            true => Ok(is_refused),
            false => Err(CohortError::Differs {
                member: row.member,
                path: path.clone(),
            }),
        }
    };
    workers::in_order(0..rows.len() as u64, &pools, work, |done| {
        refused += u64::from(done?);
        Ok::<(), CohortError>(())
    })?;
    Ok(VerifyReport {
        shards: shards.len() as u64,
        members: chosen,
        refused,
    })
}

/// Checks all shards, keeps the rows of the members chosen, and returns those shards that are broken.
fn check_all(
    cohort: &Cohort,
    folder: &Path,
    shards: &[Shard],
    chosen: &[u64],
    rows: &mut Vec<(Row, PathBuf)>,
) -> Result<Vec<u64>, CohortError> {
    let mut broken = Vec::new();
    for &shard in shards {
        let path = folder.join(shard.file_name());
        match found(cohort, shard, &path)? {
            Found::Whole(record) => {
                let wanted = record
                    .rows
                    .into_iter()
                    .filter(|row| chosen.contains(&row.member));
                rows.extend(wanted.map(|row| (row, path.clone())));
            }
            Found::Broken => broken.push(shard.shard),
        }
    }
    Ok(broken)
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

fn bytes_of(row: &Row, path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(row.offset))?;
    let mut bytes = Vec::new();
    file.take(row.bytes).read_to_end(&mut bytes)?;
    Ok(bytes)
}
