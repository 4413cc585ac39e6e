//! A script for the batch system Slurm: an array of tasks, each of which computes some shards.

use super::arguments::{Arguments, Slurm};
use super::commands::Done;
use super::output::{Answer, Failure};
use heart_cohort::{Cohort, Shard};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Largest number of tasks of an array. The limit of a Slurm controller (`MaxArraySize`) is 1001 by default, and indices are below
/// it.
const MOST_TASKS: u64 = 1000;

/// Returns a script for `sbatch` that computes the shards of a cohort in a directory with this program. It is an array of at most
/// 1000 tasks; with more shards each task computes several in sequence and its time limit is multiplied. A resubmitted script computes
/// the missing shards.
///
/// Half a minute before its limit a task receives `TERM` and leaves no partial files. The program takes the place of the batch shell by
/// `exec`; `--signal=B:TERM@30` addresses that shell, without `B:` Slurm signals the job steps only
/// ([sbatch](https://slurm.schedmd.com/sbatch.html)).
pub(super) fn sbatch(arguments: &Arguments, options: &Slurm) -> Done {
    let shards = options.shards;
    // Checked here instead of in each task.
    Shard {
        shard: 1,
        of: shards,
    }
    .members(&Cohort::load(&options.cohort)?)?;
    let memory = arguments.memory.map(|mib| mib as u64);
    if memory > Some(options.task_memory) {
        return invalid("--memory must not exceed --task-memory".to_owned());
    }
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or(path.to_path_buf());
    let program = std::env::current_exe().unwrap_or(PathBuf::from("heart-phantom"));
    let mut words = Vec::new();
    for path in [program, absolute(&options.cohort), absolute(&options.out)] {
        match path.to_str() {
            Some(path) => words.push(format!("'{}'", path.replace('\'', "'\\''"))),
            None => return invalid(format!("{} must be UTF-8", path.display())),
        }
    }
    let each = shards.div_ceil(MOST_TASKS);
    let at_once = options.at_once.map_or(String::new(), |n| format!("%{n}"));
    let partition = (options.partition.as_ref()).map_or(String::new(), |name| {
        format!("#SBATCH --partition={name}\n")
    });
    let mut script = include_str!("../../assets/slurm.sh").to_owned();
    for (name, value) in [
        ("{TASKS}", shards.div_ceil(each).to_string() + &at_once),
        ("{MEMORY}", options.task_memory.to_string()),
        (
            "{RUN_MEMORY}",
            memory.map_or(String::new(), |mib| format!(" --memory {mib}")),
        ),
        ("{MINUTES}", (options.minutes * each).to_string()),
        ("{PARTITION}", partition),
        ("{THREADS}", arguments.threads.unwrap_or(2).to_string()),
        ("{EACH}", each.to_string()),
        ("{SHARDS}", shards.to_string()),
        // Paths are inserted last: they may contain names in braces.
        ("{PROGRAM} {COHORT} {FOLDER}", words.join(" ")),
    ] {
        script = script.replace(name, &value);
    }
    Ok(Answer::Text(script))
}

fn invalid(what: String) -> Done {
    let report = json!({ "error": what, "code": 2 });
    Err(Failure::Report(report, vec![what]))
}
