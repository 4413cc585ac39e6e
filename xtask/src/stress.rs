//! `cargo xtask stress --minutes N`: as many random scenes as fit, from seeds that nobody has tried; `--scenes N`: so many of each kind.
//!
//! The scenes live in `tests/tests/stress/`; this builds them with optimisation and gives them time and a first seed.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::workspace::root;

const USAGE: &str = "usage: cargo xtask stress --minutes N | --scenes N [--seed S] [--kind NAME]";

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let (mut amount, mut seed, mut kind) = (None, None, None);
    let pairs = arguments.as_chunks::<2>();
    for [flag, value] in pairs.0 {
        match flag.as_str() {
            "--minutes" if positive(value) => amount = Some(("STRESS_MINUTES", value)),
            "--scenes" if value.parse::<u64>().is_ok() => amount = Some(("STRESS_SCENES", value)),
            "--seed" => seed = Some(value.parse::<u64>().map_err(|_| USAGE)?),
            "--kind" => kind = Some(value),
            _ => return Err(USAGE.into()),
        }
    }
    let (Some((variable, amount)), []) = (amount, pairs.1) else {
        return Err(USAGE.into());
    };
    // A start of its own for every run; 2^32 seeds apart, so that runs do not overlap.
    let now = || SystemTime::now().duration_since(UNIX_EPOCH);
    let seed = seed.unwrap_or_else(|| now().map_or(1, |time| time.as_secs() << 32));
    println!("{variable}={amount} from seed {seed}");
    let status = Command::new(env!("CARGO"))
        .args([
            "test",
            "--release",
            "--package",
            "tests",
            "--test",
            "stress",
            "--",
            "--nocapture",
        ])
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
            "scenes failed: run again with --seed {seed} to see them"
        ))
    }
}

fn positive(minutes: &str) -> bool {
    let minutes = minutes.parse::<f64>();
    minutes.is_ok_and(|minutes| minutes > 0.0 && minutes.is_finite())
}
