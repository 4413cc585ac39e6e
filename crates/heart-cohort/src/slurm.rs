//! A script for the batch system Slurm: an array of tasks, each of which computes some shards.

use crate::error::CohortError;
use std::path::Path;

/// Largest number of tasks of an array. The limit of a Slurm controller (`MaxArraySize`) is 1001 by default, and indices are below
/// it.
const MOST_TASKS: u64 = 1000;

/// Resources of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct SlurmOptions {
    /// Number of shards.
    pub shards: u64,
    /// Processors per task.
    pub threads: usize,
    /// Memory per task in MiB.
    pub memory_mib: u64,
    /// Memory for shapes of the heart in MiB, an option `--memory` of the program; `None` for its default.
    pub shapes_mib: Option<u64>,
    /// Time limit per shard in minutes.
    pub minutes: u64,
    /// Largest number of concurrent tasks; `None` for the limit of the site.
    pub at_once: Option<u64>,
    /// Partition; `None` for that of the site.
    pub partition: Option<String>,
}

impl SlurmOptions {
    /// Options for a number of shards, with two processors, 4 GiB and one hour each.
    #[must_use]
    pub fn new(shards: u64) -> Self {
        Self {
            shards,
            threads: 2,
            memory_mib: 4096,
            shapes_mib: None,
            minutes: 60,
            at_once: None,
            partition: None,
        }
    }

    /// Sets the number of processors per task.
    #[must_use]
    pub fn with_threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Sets the memory per task in MiB.
    #[must_use]
    pub fn with_memory_mib(mut self, memory_mib: u64) -> Self {
        self.memory_mib = memory_mib;
        self
    }

    /// Sets the memory for shapes of the heart in MiB, at most that per task; `None` for the default of the program.
    #[must_use]
    pub fn with_shapes_mib(mut self, shapes_mib: Option<u64>) -> Self {
        self.shapes_mib = shapes_mib;
        self
    }

    /// Sets the time limit per shard in minutes.
    #[must_use]
    pub fn with_minutes(mut self, minutes: u64) -> Self {
        self.minutes = minutes;
        self
    }

    /// Sets the largest number of concurrent tasks; `None` for the limit of the site.
    #[must_use]
    pub fn with_at_once(mut self, at_once: Option<u64>) -> Self {
        self.at_once = at_once;
        self
    }

    /// Sets the partition; `None` for that of the site.
    #[must_use]
    pub fn with_partition(mut self, partition: Option<String>) -> Self {
        self.partition = partition;
        self
    }

    fn check(&self) -> Result<(), CohortError> {
        let wrong = |option, given: String, wanted| {
            Err(CohortError::Slurm {
                option,
                given,
                wanted,
            })
        };
        for (option, given) in [
            ("shards", self.shards),
            ("threads", self.threads as u64),
            ("memory", self.memory_mib),
            ("minutes", self.minutes),
            ("at-once", self.at_once.unwrap_or(1)),
        ] {
            // Prevents overflow of products.
            if !(1..=1 << 40).contains(&given) {
                return wrong(option, given.to_string(), "it must be between 1 and 2^40");
            }
        }
        let shapes = self.shapes_mib.unwrap_or(1);
        if !(1..=self.memory_mib).contains(&shapes) {
            let wanted = "it must be between 1 and the memory per task";
            return wrong("memory for shapes", shapes.to_string(), wanted);
        }
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_-.,".contains(c);
        match &self.partition {
            Some(name) if name.is_empty() || !name.chars().all(is_name) => wrong(
                "partition",
                name.clone(),
                "it must consist of letters, digits, and _ - . ,",
            ),
            _ => Ok(()),
        }
    }
}

/// Returns a script for `sbatch` that computes the shards of a cohort in a directory with this program. It is an array of at most
/// 1000 tasks; with more shards each task computes several in sequence and its time limit is multiplied. A resubmitted script computes
/// the missing shards.
///
/// Half a minute before its limit a task receives `TERM` and leaves no partial files. The program takes the place of the batch shell by
/// `exec`; `--signal=B:TERM@30` addresses that shell, without `B:` Slurm signals the job steps only
/// ([sbatch](https://slurm.schedmd.com/sbatch.html)).
///
/// # Errors
/// [`CohortError::Slurm`] for zero, an invalid partition name, and paths that are empty, begin with `-` or are not UTF-8.
pub fn sbatch(
    program: &Path,
    cohort: &Path,
    folder: &Path,
    options: &SlurmOptions,
) -> Result<String, CohortError> {
    options.check()?;
    let shards = options.shards;
    let each = shards.div_ceil(MOST_TASKS);
    let at_once = options.at_once.map_or(String::new(), |n| format!("%{n}"));
    let partition = (options.partition.as_ref()).map_or(String::new(), |name| {
        format!("#SBATCH --partition={name}\n")
    });
    let run_memory = (options.shapes_mib).map_or(String::new(), |mib| format!(" --memory {mib}"));
    let mut script = include_str!("slurm.sh").to_owned();
    for (name, value) in [
        ("{TASKS}", shards.div_ceil(each).to_string() + &at_once),
        ("{MEMORY}", options.memory_mib.to_string()),
        ("{RUN_MEMORY}", run_memory),
        ("{MINUTES}", (options.minutes * each).to_string()),
        ("{PARTITION}", partition),
        ("{THREADS}", options.threads.to_string()),
        ("{EACH}", each.to_string()),
        ("{SHARDS}", shards.to_string()),
        // Paths are inserted last: they may contain names in braces.
        (
            "{PROGRAM} {COHORT} {FOLDER}",
            words(&[program, cohort, folder])?,
        ),
    ] {
        script = script.replace(name, &value);
    }
    Ok(script)
}

/// Paths as words of a shell.
fn words(paths: &[&Path]) -> Result<String, CohortError> {
    let word = |path: &&Path| match path.to_str() {
        Some(path) if path.is_empty() || path.starts_with('-') => Err(CohortError::Slurm {
            option: "path",
            given: path.to_owned(),
            wanted: "it must not be empty or begin with -",
        }),
        Some(path) => Ok(format!("'{}'", path.replace('\'', "'\\''"))),
        None => Err(CohortError::Slurm {
            option: "path",
            given: path.to_string_lossy().into_owned(),
            wanted: "it must be UTF-8",
        }),
    };
    let words: Result<Vec<String>, _> = paths.iter().map(word).collect();
    Ok(words?.join(" "))
}
