//! Cohorts from their text to their shards, by members of 8 x 8 bins.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bytes;
mod constraints;
mod distributions;
mod draws;
mod failures;
mod folder;
mod learning;
mod manifest;
mod messages;
mod verified;

use heart_cohort::heart_phantom::no_observer;
use heart_cohort::{Cohort, RunOptions, Shard, ShardReport, run_shard};
use std::path::Path;

/// Two gates of a small heart with a small camera: some milliseconds per member.
const SCENE: &str = "[scene]
heart.discretisation = { differences = { nodes = 51 } }
camera = { views = 3, bins = 8, rows = 8, pitch = [1.5, 1.5] }
acquisition.mode = { gated = { gates = 2 } }
noise = { counts = { per_unit = 100.0 }, seed = 1 }
output.write = [\"truth\", \"projections\", \"reconstruction\", \"labels\"]
reconstruction.arc = \"extend\"
";

/// The text of a cohort of such members.
fn text(members: u64, head: &str, vary: &str) -> String {
    format!("members = {members}\n{head}\n{SCENE}\n[vary]\n{vary}\n")
}

/// Some members are rejected: their outer balloon is not outside.
fn with_rejected(members: u64) -> Cohort {
    let vary = "heart.outer.radius = { choice = [2.6, 2.8, 1.7] }\ncycle.volume.gain = { uniform = [0.2, 0.6] }";
    Cohort::from_toml(&text(members, "seed = 5", vary)).unwrap()
}

fn shard(cohort: &Cohort, folder: &Path, [shard, of]: [u64; 2], threads: usize) -> ShardReport {
    let options = RunOptions::new(threads);
    run_shard(cohort, folder, Shard { shard, of }, &options, &no_observer).unwrap()
}

fn all(cohort: &Cohort, folder: &Path, of: u64, threads: usize) -> Vec<ShardReport> {
    (1..=of)
        .map(|k| shard(cohort, folder, [k, of], threads))
        .collect()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
