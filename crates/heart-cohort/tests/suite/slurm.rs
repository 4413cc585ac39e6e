//! Scripts for Slurm.

use heart_cohort::{CohortError, SlurmOptions, sbatch};
use std::path::Path;

fn script(options: &SlurmOptions) -> Result<String, CohortError> {
    let [program, cohort, folder] =
        ["heart-phantom", "it's.toml", "out $HOME {EACH}"].map(Path::new);
    sbatch(program, cohort, folder, options)
}

#[test]
fn a_script_is_valid_shell_and_contains_all_options() {
    let options = SlurmOptions::new(40)
        .with_threads(3)
        .with_memory_mib(2048)
        .with_shapes_mib(Some(1500))
        .with_minutes(90)
        .with_partition(Some("short".into()))
        .with_at_once(Some(8));
    let text = script(&options).unwrap();
    assert!(text.starts_with("#!/bin/bash\n#SBATCH "));
    for line in [
        "#SBATCH --array=1-40%8\n",
        "#SBATCH --partition=short\n",
        "#SBATCH --time=90\n",
        "=2048M\n",
        "--cpus-per-task=3\n",
        "--signal=B:TERM@30\n",
        "\"$1\" --quiet --memory 1500 --threads",
        "'heart-phantom' 'it'\\''s.toml' 'out $HOME {EACH}'\n",
    ] {
        assert!(text.contains(line), "{text}");
    }
    assert!(!text.contains("{T") && !text.contains("{P"));
}

/// The shell evaluates the shards of each task: all shards, each once.
#[test]
fn tasks_compute_every_shard_once() {
    for (shards, tasks) in [(1, 1), (1000, 1000), (1001, 501), (2500, 834)] {
        let text = script(&SlurmOptions::new(shards)).unwrap();
        assert!(
            text.contains(&format!("#SBATCH --array=1-{tasks}\n")),
            "{text}"
        );
        let body = text.replace("\"$1\" --quiet", "echo").replace("exec ", "");
        let each = format!("for SLURM_ARRAY_TASK_ID in $(seq {tasks}); do\n{body}\ndone");
        let output = std::process::Command::new("bash")
            .arg("-c")
            .arg(each)
            .output()
            .unwrap();
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
    let changed = |change: &dyn Fn(&mut SlurmOptions)| {
        let mut options = SlurmOptions::new(1);
        change(&mut options);
        script(&options).unwrap_err().to_string()
    };
    let partition = "a\n#SBATCH --uid=0";
    for (error, words) in [
        (
            changed(&|options| options.shards = 0),
            "shards is 0; it must be between 1",
        ),
        (changed(&|options| options.minutes = 0), "minutes is 0"),
        (
            changed(&|options| options.memory_mib = u64::MAX),
            "memory is",
        ),
        (
            changed(&|options| options.shapes_mib = Some(5000)),
            "memory for shapes is 5000; it must be between 1 and",
        ),
        (
            changed(&|options| options.at_once = Some(0)),
            "at-once is 0",
        ),
        (
            changed(&|options| options.partition = Some(partition.into())),
            "partition is a\\n#SBATCH --uid=0; it must consist of",
        ),
        (
            changed(&|options| options.partition = Some(String::new())),
            "partition is ",
        ),
    ] {
        assert!(error.contains(words), "{error}");
    }
    let [program, cohort] = ["heart-phantom", "cohort.toml"].map(Path::new);
    for folder in ["", "-out"] {
        let error = sbatch(program, cohort, Path::new(folder), &SlurmOptions::new(1));
        let error = error.unwrap_err().to_string();
        assert!(
            error.contains("must not be empty or begin with -"),
            "{error}"
        );
    }
}
