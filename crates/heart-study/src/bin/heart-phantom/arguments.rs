//! What can be typed.

use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use heart_study::StudyOptions;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Shown after the help.
const AFTER: &str = "\
Exit codes: 0 done, 1 failed at work (a disk that is full, a folder that another run writes to), 2 a command or a scene that makes
no sense or cannot be run; 128 and the number of a signal that ended it (130 after Ctrl-C), as shells count. Files have their names when they are
whole, report.json when all the others do; a signal leaves nothing else behind, save one that kills at once. Errors of a scene
name file, line, column and field, and say what would be right.";

/// A beating heart phantom with exact ground truth.
#[derive(Debug, Parser)]
#[command(name = "heart-phantom", version, about, arg_required_else_help = true, after_help = AFTER)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Threads to use; all cores if not given. The results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<usize>,
    /// Memory for shapes of the heart in MiB, 512 if not given. The results do not depend on it.
    #[arg(long, global = true, value_name = "MIB", value_parser = memory())]
    pub(crate) memory: Option<usize>,
    /// No progress bar, no summary.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Reports and errors as JSON.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the study of Rohmer, Sitek and Gullberg (2006) and write its figures and numbers.
    Paper(Paper),
    /// Write a scene with a comment on every field, to a file or to the standard output.
    Init {
        /// The file; it must not exist yet.
        file: Option<PathBuf>,
    },
    /// Find whether a run of the scene would be refused, and for what first, or say what it makes.
    Check {
        /// The scene.
        scene: PathBuf,
    },
    /// Compute what the scene's [output] asks for and write it to a folder.
    Run {
        /// The scene.
        scene: PathBuf,
        /// Folder to write to; made if it does not exist.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// No index.html, the page to look at the run in.
        #[arg(long)]
        no_html: bool,
    },
    /// The heart at one phase: volumes and wall thickness; with --out also activity and labels.
    Truth {
        /// The scene.
        scene: PathBuf,
        /// Phase of the cycle, 0 to 1.
        #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
        phase: f64,
        /// Folder for the exact activity, the labels and the surfaces at that phase.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// One view, computed alone, as .npy or .png.
    View {
        /// The scene.
        scene: PathBuf,
        /// Which view, from 0.
        #[arg(long, default_value_t = 0)]
        view: usize,
        /// Which gate, from 0.
        #[arg(long, default_value_t = 0)]
        gate: usize,
        /// The file; its ending says the format. Its folder is made if it does not exist.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Many hearts, drawn from a scene in which some fields vary, in shards that any machine can make.
    Cohort {
        #[command(subcommand)]
        command: Cohort,
    },
    /// Completions for a shell, to the standard output.
    Completions {
        /// Which shell.
        shell: Shell,
    },
    /// The manual page (roff), to the standard output.
    Man {
        /// The page of one of these commands.
        command: Option<String>,
    },
}

/// What to do with a cohort.
#[derive(Debug, Subcommand)]
pub(crate) enum Cohort {
    /// Write a cohort with a comment on every line, to a file or to the standard output.
    Init {
        /// The file; it must not exist yet.
        file: Option<PathBuf>,
    },
    /// Draw the members and compute some: ranges of the fields, bytes and time of the whole.
    Check {
        /// The cohort.
        cohort: PathBuf,
        /// Members to compute.
        #[arg(long, default_value_t = 10, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
        members: u64,
    },
    /// Make a shard, unless it is whole: an archive in the layout of WebDataset with its record.
    Run {
        /// The cohort.
        cohort: PathBuf,
        /// Folder to write to; made if it does not exist. Many processes may write to it.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Which shard of how many, from 1, such as 3/40; or 11-20/40, or all/40, one after the other.
        #[arg(long, default_value = "1/1", value_name = "K/N", value_parser = shards)]
        shard: Shards,
    },
    /// Make one manifest, as CSV, of a folder that has all shards.
    Merge {
        /// The folder of the shards.
        dir: PathBuf,
    },
    /// Compare all shards with the cohort and their checksums, and recompute some members.
    Verify {
        /// The cohort.
        cohort: PathBuf,
        /// The folder of the shards.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Members to compute again.
        #[arg(long, default_value_t = 10, value_name = "N")]
        members: u64,
        /// Which ones: another seed, others.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Write the gates of one member as NIfTI in the layout that nnU-Net and MONAI read.
    Export {
        /// The cohort.
        cohort: PathBuf,
        /// Index of the member, from 0.
        #[arg(long, value_name = "N")]
        member: u64,
        /// Folder of the data set; cases of other members in it stay.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Print a script for sbatch that makes all shards on a cluster with Slurm.
    Slurm {
        /// The cohort.
        cohort: PathBuf,
        /// Folder to write to, seen by all machines.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Shards; tasks of the array, which makes several a task above 1000.
        #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
        shards: u64,
        /// Minutes that a shard may take.
        #[arg(long, default_value_t = 60, value_name = "N")]
        minutes: u64,
        /// Memory of a task in MiB.
        #[arg(long, default_value_t = 4096, value_name = "MIB")]
        task_memory: u64,
        /// Most tasks that run at the same time.
        #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<u64>::new().range(1..))]
        at_once: Option<u64>,
        /// Partition; that of the site if not given.
        #[arg(long, value_name = "NAME")]
        partition: Option<String>,
    },
}

/// Some shards in a row, of how many.
#[derive(Debug, Clone)]
pub(crate) struct Shards {
    pub(crate) which: RangeInclusive<u64>,
    pub(crate) of: u64,
}

fn shards(text: &str) -> Result<Shards, String> {
    let numbers = text.split_once('/').and_then(|(which, of)| {
        let of = of.parse().ok()?;
        let which = match which.split_once('-') {
            Some((from, to)) => from.parse().ok()?..=to.parse().ok()?,
            None if which == "all" => 1..=of,
            None => {
                let shard = which.parse().ok()?;
                shard..=shard
            }
        };
        Some(Shards { which, of })
    });
    let inside = |shards: &Shards| {
        !shards.which.is_empty() && *shards.which.start() > 0 && *shards.which.end() <= shards.of
    };
    (numbers.filter(inside))
        .ok_or_else(|| "must be K/N or K-L/N with 1 <= K <= L <= N, or all/N".to_owned())
}

/// The limit is that of the study's options.
fn memory() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=1 << 30)
}

fn threads() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=4096)
}

#[derive(Debug, Args)]
pub(crate) struct Paper {
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Voxels along an edge of the volume, bins and rows of the camera.
    #[arg(long, default_value_t = StudyOptions::default().size)]
    pub(crate) size: usize,
    /// Views over 180 degrees.
    #[arg(long, default_value_t = StudyOptions::default().views)]
    pub(crate) views: usize,
    /// Volume gain of the cavity at the height of the cycle (0.6 is an ejection fraction of 0.375).
    #[arg(long, default_value_t = StudyOptions::default().gain, allow_hyphen_values = true)]
    pub(crate) gain: f64,
    /// Heart rate in beats per minute.
    #[arg(long, default_value_t = StudyOptions::default().beats_per_minute, allow_hyphen_values = true)]
    pub(crate) bpm: f64,
    /// Nodes of a membrane.
    #[arg(long, default_value_t = StudyOptions::default().nodes)]
    pub(crate) nodes: usize,
    /// Leave the figures out (numbers, sinograms and volumes are written all the same).
    #[arg(long)]
    pub(crate) no_figures: bool,
}
