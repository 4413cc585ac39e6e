//! `cargo xtask mutants`: which small changes of the code no test notices, by cargo-mutants, in a random sample of each crate.
//!
//! A change that no test can notice is listed in `xtask/mutants.txt` with the reason.

use std::fs;
use std::process::{Command, Stdio};

use crate::workspace::{package_name, root, target_folder};

/// Crates with a score, and the packages with their tests.
const CRATES: &[(&str, &[&str])] = &[
    ("membrane-forces", &["membrane-forces"]),
    ("membrane-newton", &["membrane-newton"]),
    ("membrane-implicit", &["membrane-implicit"]),
    ("revolve-voxel", &["revolve-voxel"]),
    ("radon", &["radon-fbp"]),
    ("heart-phantom", &["heart-phantom", "heart-phantom-tests"]),
];
/// Changes that no test can notice, one a line: the change as cargo-mutants names it, without its place in the file; two blanks; the reason.
const EQUIVALENT: &str = "xtask/mutants.txt";
/// Smallest share of noticed changes.
const LEAST: f64 = 0.97;
const USAGE: &str = "usage: cargo xtask mutants [--sample N] [--seed S] [CRATE]";

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let (mut sample, mut seed, mut rest) = (300, 0, arguments);
    while let [flag, value, tail @ ..] = rest
        && flag.starts_with("--")
    {
        let value: usize = value.parse().map_err(|_| USAGE)?;
        match flag.as_str() {
            "--sample" if value > 0 => sample = value,
            "--seed" => seed = value,
            _ => return Err(USAGE.into()),
        }
        rest = tail;
    }
    let is_chosen = |name: &str| rest.is_empty() || rest == [name];
    if !CRATES.iter().any(|(name, _)| is_chosen(name)) {
        return Err(USAGE.into());
    }
    let mut version = Command::new(env!("CARGO"));
    version.args(["mutants", "--version"]).stdout(Stdio::null());
    if !version.status().is_ok_and(|status| status.success()) {
        return Err("cargo-mutants is not installed: cargo install cargo-mutants --locked".into());
    }
    let listed = fs::read_to_string(root().join(EQUIVALENT))
        .map_err(|error| format!("{EQUIVALENT}: {error}"))?;
    let mut poor = Vec::new();
    for (name, tests) in CRATES.iter().filter(|(name, _)| is_chosen(name)) {
        let found = sampled(name, tests, sample, seed)?;
        let missed: Vec<String> = (found.missed.lines().map(without_place))
            .filter(|change| !is_equivalent(&listed, change))
            .collect();
        let noticed = found.caught.lines().count() + found.timeout.lines().count();
        let score = noticed as f64 / (noticed + missed.len()).max(1) as f64;
        println!("{name}: {noticed} of {} noticed", noticed + missed.len());
        missed.iter().for_each(|change| println!("    {change}"));
        if score < LEAST {
            poor.push(*name);
        }
    }
    match poor.is_empty() {
        true => Ok(()),
        false => Err(format!("below {:.0} %: {}", 100.0 * LEAST, poor.join(", "))),
    }
}

/// What cargo-mutants writes, one change a line.
struct Found {
    caught: String,
    missed: String,
    timeout: String,
}

/// Tests about `sample` changes of a crate: each `k`th of its list from `seed` on.
fn sampled(name: &str, tests: &[&str], sample: usize, seed: usize) -> Result<Found, String> {
    let package = package_name(name);
    let list = Command::new(env!("CARGO"))
        .args(["mutants", "--list", "--package", package])
        .current_dir(root())
        .output()
        .map_err(|error| format!("cargo mutants: {error}"))?;
    let all = list.stdout.iter().filter(|byte| **byte == b'\n').count();
    let parts = (all / sample).max(1);
    let out = target_folder().join("mutants").join(name);
    fs::create_dir_all(&out).map_err(|error| format!("{}: {error}", out.display()))?;
    // It fails if a change is missed, or if the tests fail without a change: then there are no files.
    Command::new(env!("CARGO"))
        .args(["mutants", "--package", package, "--sharding", "round-robin"])
        .args(["--shard", &format!("{}/{parts}", seed % parts)])
        .args(["--test-package", &tests.join(",")])
        .arg("--output")
        .arg(&out)
        .current_dir(root())
        .status()
        .map_err(|error| format!("cargo mutants: {error}"))?;
    let read = |file: &str| {
        let path = out.join("mutants.out").join(file);
        fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    Ok(Found {
        caught: read("caught.txt")?,
        missed: read("missed.txt")?,
        timeout: read("timeout.txt")?,
    })
}

/// `path:line:column: change` without line and column.
fn without_place(line: &str) -> String {
    let (place, change) = line.split_once(": ").unwrap_or((line, ""));
    format!("{}: {change}", place.split(':').next().unwrap_or(place))
}

fn is_equivalent(listed: &str, change: &str) -> bool {
    (listed.lines()).any(|line| {
        line.split_once("  ")
            .is_some_and(|(known, _)| known == change)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listed_change_counts_at_any_place_with_a_reason() {
        let change = without_place("crates/a/src/b.rs:27:19: replace < with <= in f");
        assert_eq!(change, "crates/a/src/b.rs: replace < with <= in f");
        let listed = format!("{change}  both give the same at equality\nx.rs: replace f with 0\n");
        assert!(is_equivalent(&listed, &change));
        assert!(!is_equivalent(&listed, "x.rs: replace f with 0"));
    }
}
