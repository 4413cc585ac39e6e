//! `cargo xtask fuzz`: runs each target of `fuzz/` for ten minutes by cargo-fuzz.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::workspace::{root, run};

/// Targets with the directories of their seeds: all files except sources.
const TARGETS: &[(&str, &str)] = &[
    ("scene", "crates/heart-phantom/scenes"),
    ("cohort", "crates/heart-cohort/src"),
    ("solid", "fuzz/seeds/solid"),
    ("banded", "fuzz/seeds/banded"),
    ("fbp", "fuzz/seeds/fbp"),
];

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let usage = "usage: cargo xtask fuzz [--minutes N] [TARGET]";
    let (minutes, rest) = match arguments {
        [flag, minutes, rest @ ..] if flag == "--minutes" => {
            (minutes.parse().map_err(|_| usage)?, rest)
        }
        rest => (10.0, rest),
    };
    let is_chosen = |name: &str| rest.is_empty() || rest.iter().any(|given| given == name);
    if rest.len() > 1 || !TARGETS.iter().any(|(name, _)| is_chosen(name)) {
        return Err(usage.into());
    }
    let mut version = Command::new(env!("CARGO"));
    version
        .args(["fuzz", "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if !version.status().is_ok_and(|status| status.success()) {
        return Err("cargo-fuzz is not installed: cargo install cargo-fuzz --locked".into());
    }
    for (name, seeds) in TARGETS.iter().filter(|(name, _)| is_chosen(name)) {
        println!("{name}");
        let found = root().join("fuzz/target/corpus").join(name);
        fill(&found, &root().join(seeds))
            .map_err(|error| format!("{}: {error}", found.display()))?;
        run(Command::new(env!("CARGO"))
            .args(["fuzz", "run", name])
            .arg(&found)
            .args(["--", "-only_ascii=1", "-max_len=8192", "-timeout=60"])
            .arg(format!("-max_total_time={:.0}", 60.0 * minutes))
            // The sanitizer is an unstable option of the compiler.
            .env("RUSTC_BOOTSTRAP", "1")
            .current_dir(root()))?;
    }
    Ok(())
}

/// Copies the seeds to the corpus.
fn fill(corpus: &Path, seeds: &Path) -> io::Result<()> {
    fs::create_dir_all(corpus)?;
    for entry in fs::read_dir(seeds)? {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "rs")
            && let Some(name) = path.file_name()
        {
            fs::copy(&path, corpus.join(name))?;
        }
    }
    Ok(())
}
