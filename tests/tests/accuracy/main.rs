//! The accuracy table: for every tolerance option and every reported error, the ratio of the true error to the stated one.
//!
//! A row draws random problems, solves each through the public interface, and compares with a reference that shares no discretisation
//! with the result. `cargo test -p tests --test accuracy` runs a few problems of each row; `cargo xtask stress --kind accuracy` runs at
//! least 1000 and writes the distributions into `docs/accuracy.md`; `--rows PREFIX` measures the rows whose names begin with it.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod bodies;
mod camera;
mod equilibria;
mod files;
mod heart;
mod motion;
mod response;
mod tomography;
mod voxel;

use rayon::prelude::*;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use tests::Random;

/// One stated error.
pub(crate) struct Row {
    /// Path of the option or of the reported number, `crate::Type::field`.
    pub(crate) name: &'static str,
    /// The quantity whose error is stated.
    pub(crate) what: &'static str,
    /// The reference of the result.
    pub(crate) reference: &'static str,
    /// The norm of the error.
    pub(crate) norm: &'static str,
    /// Problems in an ordinary run of the tests: about two seconds.
    pub(crate) quick: u64,
    /// True error over stated error of a random problem; `None` if a typed error rejects it.
    pub(crate) problem: fn(&mut Random) -> Option<f64>,
}

/// Largest ratio of a true error to the stated one that passes.
const WORST: f64 = 1.5;
/// The 99th percentile of a full run is at most this.
const PERCENTILE_99: f64 = 1.0;

/// All rows, area by area.
const AREAS: [&[Row]; 8] = [
    camera::ROWS,
    response::ROWS,
    tomography::ROWS,
    bodies::ROWS,
    equilibria::ROWS,
    heart::ROWS,
    files::ROWS,
    motion::ROWS,
];

/// The results of the problems of a row.
struct Distribution {
    /// Ratios in ascending order.
    ratios: Vec<f64>,
    rejected: u64,
    /// Seeds of problems that panicked, whose ratio is not a number, or above [`WORST`].
    failed: Vec<u64>,
}

impl Distribution {
    fn of(row: &Row, problems: u64, first_seed: u64) -> Self {
        let seeds = first_seed..first_seed + problems;
        let outcomes: Vec<_> = (seeds.clone().into_par_iter())
            .map(|seed| catch_unwind(AssertUnwindSafe(|| (row.problem)(&mut Random::new(seed)))))
            .collect();
        let mut found = Self {
            ratios: Vec::new(),
            rejected: 0,
            failed: Vec::new(),
        };
        for (seed, outcome) in seeds.zip(outcomes) {
            match outcome {
                Ok(None) => found.rejected += 1,
                Ok(Some(ratio)) => {
                    if ratio.is_nan() || ratio > WORST {
                        found.failed.push(seed);
                    }
                    found.ratios.push(ratio);
                }
                Err(_) => found.failed.push(seed),
            }
        }
        found.ratios.sort_by(f64::total_cmp);
        found
    }

    /// The smallest ratio that at least this fraction of the problems do not exceed.
    fn percentile(&self, fraction: f64) -> f64 {
        let rank = (fraction * self.ratios.len() as f64).ceil() as usize;
        self.ratios
            .get(rank.max(1) - 1)
            .copied()
            .unwrap_or(f64::NAN)
    }
}

fn variable(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn accuracy_of_every_stated_error() {
    let problems = variable("STRESS_SCENES");
    let seed = variable("STRESS_SEED").unwrap_or(1);
    let mut table = String::new();
    let mut failures = String::new();
    let prefix = std::env::var("ACCURACY_ROWS").unwrap_or_default();
    let rows = AREAS.into_iter().flatten();
    for row in rows.filter(|row| row.name.starts_with(&prefix)) {
        let found = Distribution::of(row, problems.unwrap_or(row.quick), seed);
        let [median, high, worst] = [0.5, 0.99, 1.0].map(|fraction| found.percentile(fraction));
        let Row {
            name,
            what,
            reference,
            norm,
            ..
        } = row;
        let line = format!(
            "| `{name}` | {what} | {reference} | {norm} | {} | {median:.2} | {high:.2} | {worst:.2} |",
            found.ratios.len()
        );
        println!("{line}");
        writeln!(table, "{line}").expect("a string grows");
        if !found.failed.is_empty() {
            writeln!(failures, "{name}: seeds {:?}", found.failed).expect("a string grows");
        } else if found.ratios.is_empty() {
            writeln!(failures, "{name}: all {} problems rejected", found.rejected)
                .expect("a string grows");
        } else if problems.is_some() && high > PERCENTILE_99 {
            writeln!(failures, "{name}: 99th percentile {high}").expect("a string grows");
        }
    }
    if let Ok(path) = std::env::var("ACCURACY_TABLE") {
        std::fs::write(path, table).expect("the table is written");
    }
    assert!(failures.is_empty(), "stated errors exceeded:\n{failures}");
}

#[test]
fn percentiles_are_of_the_sorted_ratios() {
    let ratios = (1..=200).map(f64::from).collect();
    let found = Distribution {
        ratios,
        rejected: 0,
        failed: Vec::new(),
    };
    assert_eq!(
        [0.5, 0.99, 1.0].map(|p| found.percentile(p)),
        [100.0, 198.0, 200.0]
    );
}
