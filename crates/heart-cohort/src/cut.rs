//! The division of a cohort into shards.

use crate::cohort::{Cohort, MOST_MEMBERS};
use crate::error::CohortError;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Shard `shard` of `of`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// The index, from 1.
    pub shard: u64,
    /// The number of shards.
    pub of: u64,
}

impl Shard {
    /// Returns the name of its archive, such as `shard-00003-of-00040.tar`; its record has the extension `json`.
    #[must_use]
    pub fn file_name(&self) -> String {
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
