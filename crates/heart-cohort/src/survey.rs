//! Estimates a cohort before its computation: ranges from the draws, size and time from some computed members.

use crate::cohort::Cohort;
use crate::compute::{RunOptions, Spare, compute};
use crate::error::CohortError;
use crate::field::FieldValue;
use crate::workers;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Largest number of members drawn.
const MOST_DRAWN: u64 = 20_000;

/// The estimate of a cohort.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Survey {
    /// Number of members.
    pub members: u64,
    /// Number of members drawn, from the first.
    pub drawn: u64,
    /// Number of draws.
    pub draws: u64,
    /// Number of these members in each case.
    pub cases: BTreeMap<String, u64>,
    /// The varied fields, in the order of their paths.
    pub fields: Vec<FieldRange>,
    /// Number of computed members, evenly spaced from the first to the last.
    pub tried: u64,
    /// Keys of rejected members with the reasons.
    pub rejected: Vec<(String, String)>,
    /// Distinct warnings of the computed members, with the number of members of each.
    pub warnings: BTreeMap<String, u64>,
    /// Estimated bytes of all shards, from the mean of the computed members.
    pub bytes: u64,
    /// Members per second on these threads of this machine.
    pub members_per_second: f64,
    /// Number of threads.
    pub threads: usize,
}

/// The drawn values of a field.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FieldRange {
    /// Its dotted path.
    pub path: String,
    /// Smallest, mean and largest number; `None` if not all values are numbers.
    pub range: Option<[f64; 3]>,
    /// Number of distinct values, if small.
    pub values: Option<usize>,
}

/// Draws at most 20 000 members and computes some of them. Writes nothing.
///
/// # Errors
/// [`PhantomError::Count`](heart_phantom::PhantomError::Count) for the number of threads; [`CohortError::Unmet`] for constraints that cannot be
/// met; [`PhantomError::Threads`](heart_phantom::PhantomError::Threads).
pub fn survey(cohort: &Cohort, tried: u64, options: &RunOptions) -> Result<Survey, CohortError> {
    options.check()?;
    let (members, tried) = (cohort.members(), tried.min(cohort.members()));
    let drawn = members.min(MOST_DRAWN);
    let (mut draws, mut cases) = (0, BTreeMap::new());
    let mut fields: BTreeMap<String, Seen> = BTreeMap::new();
    for index in 0..drawn {
        let member = cohort.member(index)?;
        draws += u64::from(member.attempts);
        *cases.entry(member.case).or_insert(0) += 1;
        for (path, value) in member.values {
            fields.entry(path).or_default().add(&value);
        }
    }
    let pools = workers::pools(options.threads)?;
    let start = Instant::now();
    let (mut rejected, mut bytes) = (Vec::new(), 0);
    let mut warnings = BTreeMap::new();
    let spare = Spare::default();
    let work = |k: u64| -> Result<_, CohortError> {
        let member = cohort.member(k * members / tried)?;
        let made = compute(cohort, &member, options, &spare);
        Ok((member.key, made))
    };
    workers::in_order(0..tried, &pools, work, |done| {
        let (key, made) = done?;
        match made {
            Ok(made) => {
                for warning in &made.warnings {
                    *warnings.entry(warning.clone()).or_insert(0) += 1;
                }
                bytes += made.bytes.len() as u64;
                spare.give_back(made);
            }
            Err(reason) => rejected.push((key, reason)),
        }
        Ok::<(), CohortError>(())
    })?;
    let seconds = start.elapsed().as_secs_f64();
    Ok(Survey {
        members,
        drawn,
        draws,
        cases,
        fields: (fields.into_iter())
            .map(|(path, seen)| seen.range(path))
            .collect(),
        tried,
        rejected,
        warnings,
        bytes: (bytes as f64 / tried.max(1) as f64 * members as f64) as u64,
        members_per_second: tried as f64 / seconds,
        threads: pools.len(),
    })
}

/// Statistics of a field.
#[derive(Default)]
struct Seen {
    numbers: Vec<f64>,
    others: bool,
    different: BTreeSet<String>,
}

impl Seen {
    /// Largest number of distinct values that is counted.
    const FEW: usize = 20;

    fn add(&mut self, value: &FieldValue) {
        match value.number() {
            Some(number) => self.numbers.push(number),
            None => self.others = true,
        }
        if self.different.len() <= Self::FEW {
            self.different.insert(value.to_string());
        }
    }

    fn range(self, path: String) -> FieldRange {
        let n = self.numbers.len() as f64;
        let numbers = || self.numbers.iter().copied();
        let least = numbers().fold(f64::INFINITY, f64::min);
        let most = numbers().fold(f64::NEG_INFINITY, f64::max);
        let mean = numbers().sum::<f64>() / n;
        let different = self.different.len();
        FieldRange {
            path,
            range: (!self.others).then_some([least, mean, most]),
            values: (different <= Self::FEW).then_some(different),
        }
    }
}
