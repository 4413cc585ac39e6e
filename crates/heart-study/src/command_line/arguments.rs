//! The command line.

use crate::StudyOptions;
use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The text after the help.
const AFTER: &str = "\
Exit codes: 0 success; 1 failure during work (disk full, directory locked by another run); 2 invalid command or scene, or all members of a cohort run
rejected; 128 + n ended by signal n (130 after Ctrl-C). Files appear under their names only when they are complete, report.json last; a command that
fails or is interrupted removes its files. Errors of a scene contain file, line, column, field and the allowed values.";

/// Beating-heart phantom with exact projections and ground truth.
#[derive(Debug, Parser)]
#[command(name = "heart-phantom", version, about, arg_required_else_help = true, after_help = AFTER)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Number of threads [default: all cores]. Results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=4096))]
    pub(crate) threads: Option<usize>,
    /// Memory for shapes of the heart in MiB [default: 512]. Results do not depend on it; a run or a member that needs more is rejected.
    #[arg(long, global = true, value_name = "MIB", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1 << 30))]
    pub(crate) memory: Option<usize>,
    /// Omit progress bar and summary.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Print reports and errors as JSON.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the study of Rohmer, Sitek and Gullberg (2006) and write its figures and numbers: some seconds on two cores, 350 MB of memory by default.
    Paper(Paper),
    /// Measure ejection fractions in images of gated SPECT, with each cause of error switched off in turn: some minutes on two cores.
    Ef {
        /// Output directory; created if necessary. Files that the report.json of an earlier run there lists are removed, others are never replaced.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Test the program with one heart and few views.
        #[arg(long)]
        quick: bool,
    },
    /// Write a scene with a comment on every field to a file or standard output.
    Init {
        /// New file.
        file: Option<PathBuf>,
    },
    /// Validate a scene and list its files, sizes and memory.
    Check {
        /// Scene file.
        scene: PathBuf,
    },
    /// Compute the products of [output] and write them to a directory.
    Run {
        /// Scene file.
        scene: PathBuf,
        /// Output directory; created if necessary. Files that the report.json of an earlier run there lists are removed, others are never replaced.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Omit index.html.
        #[arg(long)]
        no_html: bool,
    },
    /// Print volumes and wall thickness at one phase; with --out also write activity, labels and surfaces.
    Truth {
        /// Scene file.
        scene: PathBuf,
        /// Cardiac phase, 0 to 1; phase 0 is end-systole with the sinusoid, end-diastole with the physiological curve.
        #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
        phase: f64,
        /// Output directory for activity, labels and surfaces; created if necessary. Existing files are never replaced.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compute one projection and write it as .npy or .png.
    View {
        /// Scene file.
        scene: PathBuf,
        /// Index of the view, from 0.
        #[arg(long, default_value_t = 0)]
        view: usize,
        /// Index of the gate, from 0.
        #[arg(long, default_value_t = 0)]
        gate: usize,
        /// New file, .npy or .png; its directory is created if necessary. An existing file is never replaced.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Compute many studies, drawn from distributions of scene fields, in shards.
    Cohort {
        #[command(subcommand)]
        command: Cohort,
    },
    /// Print shell completions.
    Completions {
        /// Shell.
        shell: Shell,
    },
    /// Print the manual page (roff).
    Man {
        /// Command of the page, such as `cohort run` [default: all].
        command: Vec<String>,
    },
}

/// Commands for cohorts.
#[derive(Debug, Subcommand)]
pub(crate) enum Cohort {
    /// Write a cohort with a comment on every line to a file or standard output.
    Init {
        /// Clinical studies: chest, collimator, 16 gates, averages over bins, noise.
        #[arg(long)]
        clinical: bool,
        /// New file.
        file: Option<PathBuf>,
    },
    /// Draw up to 20000 members and compute some; print ranges of the fields and the expected size and time.
    Check {
        /// Cohort file.
        cohort: PathBuf,
        /// Number of members to compute.
        #[arg(long, default_value_t = 10, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
        members: u64,
    },
    /// Compute shards that are not complete: an archive (WebDataset) and a record each. The exit code is 2 if all members are rejected.
    ///
    /// An interrupted shard is computed again from its first member, complete shards are kept: of a large cohort compute many shards, such as
    /// --shard all/40.
    Run {
        /// Cohort file.
        cohort: PathBuf,
        /// Output directory; created if necessary. Several processes may write to it.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Shard and number of shards, from 1: 3/40, 11-20/40 or all/40.
        #[arg(long, default_value = "1/1", value_name = "K/N", value_parser = shards)]
        shard: Shards,
    },
    /// Write one manifest (CSV) for a directory that contains all shards.
    Merge {
        /// Directory of the shards.
        dir: PathBuf,
    },
    /// Compare all shards with the cohort and their checksums, and recompute some members.
    Verify {
        /// Cohort file.
        cohort: PathBuf,
        /// Directory of the shards.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Number of members to recompute.
        #[arg(long, default_value_t = 10, value_name = "N")]
        members: u64,
        /// Seed that selects these members.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Write the gates of one member as NIfTI in the layout of nnU-Net and MONAI.
    Export {
        /// Cohort file.
        cohort: PathBuf,
        /// Index of the member, from 0.
        #[arg(long, value_name = "N")]
        member: u64,
        /// Directory of the data set; cases of other members are kept.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Print a Slurm job script (sbatch) that computes all shards.
    Slurm(Slurm),
}

#[derive(Debug, Args)]
pub(crate) struct Slurm {
    /// Cohort file.
    pub(crate) cohort: PathBuf,
    /// Output directory, shared by all machines.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Number of shards; above 1000 each array task computes several.
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
    pub(crate) shards: u64,
    /// Time limit per shard in minutes.
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..=1 << 20))]
    pub(crate) minutes: u64,
    /// Memory per task in MiB; --memory, that of shapes, is passed to the program.
    #[arg(long, default_value_t = 4096, value_name = "MIB", value_parser = RangedU64ValueParser::<u64>::new().range(1..=1 << 30))]
    pub(crate) task_memory: u64,
    /// Largest number of concurrent tasks.
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
    pub(crate) at_once: Option<u64>,
    /// Partition [default: that of the site].
    #[arg(long, value_name = "NAME", value_parser = partition)]
    pub(crate) partition: Option<String>,
}

fn partition(name: &str) -> Result<String, String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_-.,".contains(c);
    match !name.is_empty() && name.chars().all(is_part) {
        true => Ok(name.to_owned()),
        false => Err("must consist of letters, digits, and _ - . ,".to_owned()),
    }
}

/// A range of shards and the number of all shards.
#[derive(Debug, Clone)]
pub(crate) struct Shards {
    pub(crate) which: RangeInclusive<u64>,
    pub(crate) of: u64,
}

fn shards(text: &str) -> Result<Shards, String> {
    let shards = text.split_once('/').and_then(|(which, of)| {
        let (from, to) = match which {
            "all" => ("1", of),
            which => which.split_once('-').unwrap_or((which, which)),
        };
        let [from, to, of] = [from, to, of].map(|k| k.parse::<u64>().ok());
        let (which, of) = (from?..=to?, of?);
        let is_valid = 1 <= *which.start() && !which.is_empty() && *which.end() <= of;
        is_valid.then_some(Shards { which, of })
    });
    shards.ok_or_else(|| "must be K/N or K-L/N with 1 <= K <= L <= N, or all/N".to_owned())
}

#[derive(Debug, Args)]
pub(crate) struct Paper {
    /// Output directory; created if necessary. Files that the report.json of an earlier run there lists are removed, others are never replaced.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) options: StudyOptions,
}
