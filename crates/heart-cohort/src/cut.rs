//! The cut of a cohort into shards: which members belong to which.

use crate::cohort::Cohort;
use crate::error::CohortError;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Shard `shard` of `of`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 1.
    pub shard: u64,
    /// How many there are.
    pub of: u64,
}

impl Shard {
    /// Its archive, such as `shard-00003-of-00040.tar`; its record has the ending `json`.
    pub fn file_name(&self) -> String {
        format!("shard-{:05}-of-{:05}.tar", self.shard, self.of)
    }

    /// Its members: `(shard - 1) n / of` to `shard n / of`, the last not included.
    ///
    /// # Errors
    /// [`CohortError::NoShard`].
    pub fn members(&self, cohort: &Cohort) -> Result<Range<u64>, CohortError> {
        let n = cohort.members();
        if self.of < 1 || self.of > n || !(1..=self.of).contains(&self.shard) {
            return Err(CohortError::NoShard {
                shard: self.shard,
                of: self.of,
                most: n,
            });
        }
        let from = |shard| (u128::from(shard) * u128::from(n) / u128::from(self.of)) as u64;
        Ok(from(self.shard - 1)..from(self.shard))
    }
}
