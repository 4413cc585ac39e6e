//! A script for the batch system Slurm: one task of an array for each shard.

use std::fmt::Write;
use std::path::Path;

/// What a job is given.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct SlurmOptions {
    /// Shards, tasks of the array.
    pub shards: u64,
    /// Processors of a task.
    pub threads: usize,
    /// Memory of a task in MiB.
    pub memory_mib: u64,
    /// Minutes that a task may take.
    pub minutes: u64,
    /// Partition; that of the site if there is none.
    pub partition: Option<String>,
}

impl SlurmOptions {
    /// So many shards, with two processors, 4 GiB and an hour each.
    pub fn new(shards: u64) -> Self {
        Self {
            shards,
            threads: 2,
            memory_mib: 4096,
            minutes: 60,
            partition: None,
        }
    }

    /// The same with other processors.
    pub fn with_threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// The same with other memory, in MiB.
    pub fn with_memory_mib(mut self, memory: u64) -> Self {
        self.memory_mib = memory;
        self
    }

    /// The same with other minutes.
    pub fn with_minutes(mut self, minutes: u64) -> Self {
        self.minutes = minutes;
        self
    }

    /// The same in a partition.
    pub fn with_partition(mut self, partition: Option<String>) -> Self {
        self.partition = partition;
        self
    }
}

/// A script for `sbatch` that makes the shards of a cohort in a folder, with this program. A task that is ended half a minute before its
/// time or moved elsewhere leaves nothing half written; a script that is submitted again makes what is missing.
pub fn sbatch(program: &Path, cohort: &Path, folder: &Path, options: &SlurmOptions) -> String {
    let mut script = String::from("#!/bin/bash\n#SBATCH --job-name=heart-cohort\n");
    let mut line = |text: String| {
        // Writing to a text cannot fail.
        let _ = writeln!(script, "{text}");
    };
    line(format!("#SBATCH --array=1-{}", options.shards));
    line("#SBATCH --ntasks=1".into());
    line(format!("#SBATCH --cpus-per-task={}", options.threads));
    line(format!("#SBATCH --mem={}M", options.memory_mib));
    line(format!("#SBATCH --time={}", options.minutes));
    if let Some(partition) = &options.partition {
        line(format!("#SBATCH --partition={partition}"));
    }
    line("#SBATCH --signal=TERM@30".into());
    line("#SBATCH --requeue".into());
    line("#SBATCH --open-mode=append".into());
    line("#SBATCH --output=heart-cohort-%A_%a.log".into());
    line("set -eu".into());
    // The program takes the place of the shell, so that it gets the signals.
    line(format!(
        "exec {} --quiet --threads \"${{SLURM_CPUS_PER_TASK:-{}}}\" cohort run {} --out {} --shard \"$SLURM_ARRAY_TASK_ID/{}\"",
        quoted(program),
        options.threads,
        quoted(cohort),
        quoted(folder),
        options.shards
    ));
    script
}

/// A path as one word of a shell.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.to_string_lossy().replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_is_a_shell_s_and_names_all_it_was_given() {
        let options = SlurmOptions::new(40).with_partition(Some("short".into()));
        let script = sbatch(
            Path::new("heart-phantom"),
            Path::new("it's.toml"),
            Path::new("out $HOME"),
            &options,
        );
        assert!(script.starts_with("#!/bin/bash\n#SBATCH "));
        for line in [
            "#SBATCH --array=1-40\n",
            "#SBATCH --partition=short\n",
            "cohort run 'it'\\''s.toml' --out 'out $HOME' --shard \"$SLURM_ARRAY_TASK_ID/40\"\n",
        ] {
            assert!(script.contains(line), "{script}");
        }
    }
}
