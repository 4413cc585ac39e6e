//! `cargo xtask stress --minutes N`: random scenes from new seeds for N minutes; `--scenes N`: N scenes of each kind.
//! `cargo xtask stress --kind accuracy [--scenes N] [--rows PREFIX]`: N problems (1000) for each row of `docs/accuracy.md` whose name
//! begins with the prefix (all); writes the table.
//!
//! `cargo xtask stress --kind fuzzed --scenes N`: N random files for the program `heart-phantom`, with limits of memory and time.
//!
//! The problems are in `tests/tests/stress/`, `tests/tests/accuracy/` and `crates/heart-study/tests/suite/fuzzed.rs`; this task builds them
//! with optimisation and passes amount and first seed.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::accuracy;
use crate::workspace::root;

const USAGE: &str = "usage: cargo xtask stress --minutes N | --scenes N [--seed S] [--kind NAME], or --kind accuracy [--rows PREFIX]";
/// Problems of each row of the accuracy table.
const PROBLEMS: &str = "1000";

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let (mut amount, mut seed, mut kind, mut rows) = (None, None, None, "");
    let pairs = arguments.as_chunks::<2>();
    for [flag, value] in pairs.0 {
        match flag.as_str() {
            "--minutes" if positive(value) => amount = Some(("STRESS_MINUTES", value)),
            "--scenes" if value.parse::<u64>().is_ok() => amount = Some(("STRESS_SCENES", value)),
            "--seed" => seed = Some(value.parse::<u64>().map_err(|_| USAGE)?),
            "--kind" => kind = Some(value),
            "--rows" => rows = value,
            _ => return Err(USAGE.into()),
        }
    }
    if !pairs.1.is_empty() {
        return Err(USAGE.into());
    }
    if kind.is_some_and(|kind| kind == "accuracy") {
        let problems = match amount {
            None => PROBLEMS,
            Some(("STRESS_SCENES", problems)) => problems.as_str(),
            Some(_) => return Err(USAGE.into()),
        };
        return accuracy::write_table(problems, seed.unwrap_or(1), rows);
    }
    let Some((variable, amount)) = amount else {
        return Err(USAGE.into());
    };
    // A new start for every run; 2^32 seeds apart, so that runs do not overlap.
    let now = || SystemTime::now().duration_since(UNIX_EPOCH);
    let seed = seed.unwrap_or_else(|| now().map_or(1, |time| time.as_secs() << 32));
    println!("{variable}={amount} from seed {seed}");
    // Files for the program, which has overflow checks without `--release`.
    let problems = match kind.is_some_and(|kind| kind == "fuzzed") {
        true => ["--package=heart-study", "--test=suite"].as_slice(),
        false => &["--release", "--package=tests", "--test=stress"],
    };
    let status = Command::new(env!("CARGO"))
        .arg("test")
        .args(problems)
        .args(["--", "--nocapture"])
        // names of tests begin with the kind
        .args(kind)
        .env(variable, amount)
        .env("STRESS_SEED", seed.to_string())
        .current_dir(root())
        .status()
        .map_err(|error| format!("cargo test: {error}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!(
            "scenes failed: run again with --seed {seed} to reproduce them"
        ))
    }
}

fn positive(minutes: &str) -> bool {
    let minutes = minutes.parse::<f64>();
    minutes.is_ok_and(|minutes| minutes > 0.0 && minutes.is_finite())
}
