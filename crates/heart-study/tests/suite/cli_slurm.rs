//! Scripts for Slurm.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn slurm(folder: &Path, global: &[&str], options: &[&str]) -> Output {
    fs::write(folder.join("it's.toml"), "members = 3000\n").unwrap();
    let fixed = ["cohort", "slurm", "it's.toml", "--out", "out $HOME {EACH}"];
    Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args([global, &fixed, options].concat())
        .current_dir(folder)
        .output()
        .unwrap()
}

fn script(folder: &Path, global: &[&str], options: &[&str]) -> String {
    let output = slurm(folder, global, options);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_script_is_valid_shell_and_contains_all_options() {
    let folder = tempfile::tempdir().unwrap();
    let global = ["--threads", "3", "--memory", "1500"];
    let options = [
        "--shards=40",
        "--task-memory=2048",
        "--minutes=90",
        "--partition=short",
        "--at-once=8",
    ];
    let text = script(folder.path(), &global, &options);
    assert!(text.starts_with("#!/bin/bash\n#SBATCH "));
    for line in [
        "#SBATCH --array=1-40%8\n",
        "#SBATCH --partition=short\n",
        "#SBATCH --time=90\n",
        "=2048M\n",
        "--cpus-per-task=3\n",
        "--signal=B:TERM@30\n",
        "\"$1\" --quiet --memory 1500 --threads",
        "/it'\\''s.toml' '/",
        "/out $HOME {EACH}'\n",
    ] {
        assert!(text.contains(line), "{text}");
    }
    assert!(!text.contains("{T") && !text.contains("{P"));
}

/// The shell evaluates the shards of each task: all shards, each once.
#[test]
fn tasks_compute_every_shard_once() {
    let folder = tempfile::tempdir().unwrap();
    for (shards, tasks) in [(1, 1), (1000, 1000), (1001, 501), (2500, 834)] {
        let text = script(folder.path(), &[], &[&format!("--shards={shards}")]);
        assert!(
            text.contains(&format!("#SBATCH --array=1-{tasks}\n")),
            "{text}"
        );
        let body = text.replace("\"$1\" --quiet", "echo").replace("exec ", "");
        let each = format!("for SLURM_ARRAY_TASK_ID in $(seq {tasks}); do\n{body}\ndone");
        let output = Command::new("bash").args(["-c", &each]).output().unwrap();
        let output = String::from_utf8(output.stdout).unwrap();
        let mut next = 1;
        for line in output.lines() {
            let (range, of) = line.rsplit(' ').next().unwrap().split_once('/').unwrap();
            let (from, to) = range.split_once('-').unwrap();
            assert_eq!((from.parse(), of.parse()), (Ok(next), Ok(shards)), "{line}");
            next = to.parse::<u64>().unwrap() + 1;
        }
        assert_eq!(next, shards + 1);
    }
}

#[test]
fn invalid_options_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    for (global, options, words) in [
        (&[][..], "--shards=0", "1.."),
        (&[], "--shards=3001", "must be between 1 and 3000"),
        (&[], "--minutes=0", "1.."),
        (&[], "--task-memory=18446744073709551615", "is not in 1.."),
        (&["--memory", "5000"], "--minutes=1", "must not exceed"),
        (&[], "--at-once=0", "1.."),
        (&[], "--partition=a\n#SBATCH --uid=0", "must consist of"),
        (&[], "--partition=", "must consist of"),
    ] {
        let all = match options.starts_with("--shards") {
            true => vec![options],
            false => vec!["--shards=1", options],
        };
        let output = slurm(folder.path(), global, &all);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(2) && error.contains(words),
            "{options}: {error}"
        );
    }
}
