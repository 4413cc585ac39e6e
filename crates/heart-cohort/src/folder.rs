//! The division of a cohort into shards, and the shards of a directory by file names.

use crate::cohort::{Cohort, MOST_MEMBERS};
use crate::error::{CohortError, Fault, FileFault};
use heart_phantom::PhantomError;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

/// Shard `shard` of `of`, counted from 1. Its archive is `shard-00003-of-00040.tar`; its record has the extension `json`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// The index, from 1.
    pub shard: u64,
    /// The number of shards.
    pub of: u64,
}

impl Shard {
    pub(crate) fn file_name(&self) -> String {
        format!("shard-{:05}-of-{:05}.tar", self.shard, self.of)
    }

    pub(crate) fn record_name(&self) -> String {
        format!("shard-{:05}-of-{:05}.json", self.shard, self.of)
    }

    /// Returns the shard of an archive or record name; `None` for other names.
    pub(crate) fn of_file_name(name: &str) -> Option<Self> {
        let (stem, _) = name.strip_prefix("shard-")?.rsplit_once('.')?;
        let (shard, of) = stem.split_once("-of-")?;
        let shard = Self {
            shard: shard.parse().ok()?,
            of: of.parse().ok()?,
        };
        let is_possible = shard.of <= MOST_MEMBERS && (1..=shard.of).contains(&shard.shard);
        let is_its_name = name == shard.file_name() || name == shard.record_name();
        (is_possible && is_its_name).then_some(shard)
    }

    /// Returns the members: `(shard - 1) n / of` to `shard n / of` (excluded) of n.
    ///
    /// # Errors
    /// [`CohortError::NoShard`].
    pub fn members(&self, cohort: &Cohort) -> Result<Range<u64>, CohortError> {
        self.range(cohort.members()).ok_or(CohortError::NoShard {
            shard: self.shard,
            of: self.of,
            most: cohort.members(),
        })
    }

    /// As [`Shard::members`], for a number of members; `None` if the shard does not exist.
    pub(crate) fn range(&self, members: u64) -> Option<Range<u64>> {
        let is_there = (1..=members).contains(&self.of) && (1..=self.of).contains(&self.shard);
        let from = |shard| (u128::from(shard) * u128::from(members) / u128::from(self.of)) as u64;
        is_there.then(|| from(self.shard - 1)..from(self.shard))
    }
}

/// Returns the shards of a directory that have a record, in order. Neither records nor archives are read: see [`verify`](crate::verify()).
///
/// # Errors
/// [`PhantomError::Read`] if the directory cannot be listed; [`CohortError::NoShards`] without names of shards.
pub fn list_shards(folder: &Path) -> Result<Vec<Shard>, CohortError> {
    let listing = Listing::of(folder)?;
    let has_record = |shard: &Shard| folder.join(shard.record_name()).is_file();
    Ok(listing.shards().filter(has_record).collect())
}

/// The shard files of a directory.
#[derive(Debug)]
pub(crate) struct Listing {
    /// Expected number of shards: that of the most shards found, the smallest of several.
    pub(crate) of: u64,
    /// Shards with a record or an archive.
    pub(crate) shards: BTreeSet<u64>,
    /// Names that resemble those of shards or have another number of shards, and missing shards.
    pub(crate) faults: Vec<FileFault>,
}

impl Listing {
    /// Lists a directory.
    ///
    /// # Errors
    /// [`PhantomError::Read`]; [`CohortError::NoShards`].
    pub(crate) fn of(folder: &Path) -> Result<Self, CohortError> {
        let unread = |source| PhantomError::Read {
            path: folder.to_path_buf(),
            source,
        };
        let mut found: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
        let (mut names, mut faults) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(folder).map_err(unread)? {
            let name = entry.map_err(unread)?.file_name();
            let name = name.to_string_lossy().into_owned();
            if !name.starts_with("shard-") || name.ends_with(".tmp") {
                continue;
            }
            match Shard::of_file_name(&name) {
                Some(shard) => {
                    found.entry(shard.of).or_default().insert(shard.shard);
                    names.push((name, shard.of));
                }
                None => faults.push(FileFault::new(name, Fault::Name)),
            }
        }
        let most = (found.into_iter()).max_by_key(|(of, shards)| (shards.len(), Reverse(*of)));
        let Some((of, shards)) = most else {
            let folder = folder.to_path_buf();
            return Err(CohortError::NoShards { folder });
        };
        let others = names.into_iter().filter(|(_, other)| *other != of);
        faults.extend(others.map(|(name, _)| FileFault::new(name, Fault::Name)));
        faults.sort_by(|a, b| a.file.cmp(&b.file));
        let mut listing = Self { of, shards, faults };
        listing.add_missing();
        Ok(listing)
    }

    pub(crate) fn shards(&self) -> impl Iterator<Item = Shard> {
        let of = self.of;
        self.shards.iter().map(move |&shard| Shard { shard, of })
    }

    /// One fault for each run of missing shards, of which there may be as many as members.
    fn add_missing(&mut self) {
        let of = self.of;
        let mut next = 1;
        for present in self.shards.iter().copied().chain([of + 1]) {
            if present > next {
                let following = present - next - 1;
                let name = Shard { shard: next, of }.record_name();
                (self.faults).push(FileFault::new(name, Fault::Missing { following }));
            }
            next = present + 1;
        }
    }
}

/// Rejects a file of another program: one whose first `most` bytes are not those of this program.
pub(crate) fn check_own(
    path: &Path,
    most: u64,
    is_own: impl FnOnce(&[u8]) -> bool,
) -> Result<(), PhantomError> {
    let mut bytes = Vec::new();
    let path_buf = || path.to_path_buf();
    match File::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes)) {
        Ok(_) if is_own(&bytes) => Ok(()),
        Ok(_) => Err(PhantomError::Foreign { path: path_buf() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(source) => Err(PhantomError::Read {
            path: path_buf(),
            source,
        }),
    }
}
