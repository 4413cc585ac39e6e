//! `cargo xtask stress --minutes N`: as many random scenes as fit, from seeds that nobody has tried.
//!
//! The scenes live in `tests/tests/stress/`; this builds them with optimisation and gives them time and a first seed.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::workspace::root;

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let usage = || String::from("usage: cargo xtask stress --minutes N [--seed S]");
    let (minutes, seed) = match arguments {
        [flag, minutes] if flag == "--minutes" => (minutes, None),
        [flag, minutes, other, seed] if flag == "--minutes" && other == "--seed" => {
            (minutes, Some(seed))
        }
        _ => return Err(usage()),
    };
    let minutes: f64 = minutes.parse().map_err(|_| usage())?;
    if !(minutes > 0.0 && minutes.is_finite()) {
        return Err(usage());
    }
    let seed = match seed {
        Some(seed) => seed.parse::<u64>().map_err(|_| usage())?,
        // A start of its own for every run; 2^32 seeds apart, so that runs do not overlap.
        None => SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(1, |time| time.as_secs() << 32),
    };
    println!("{minutes} minutes from seed {seed}");
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
        .env("STRESS_MINUTES", minutes.to_string())
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
