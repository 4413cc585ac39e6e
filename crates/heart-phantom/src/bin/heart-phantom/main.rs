//! The command line: `heart-phantom paper --out DIR` runs the whole study.

use clap::{Parser, Subcommand};
use heart_phantom::study::{self, StudyOptions};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::process::ExitCode;

/// A beating heart phantom with exact ground truth.
#[derive(Debug, Parser)]
#[command(version, about, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the study of Rohmer, Sitek and Gullberg (2006) and write its figures and numbers.
    Paper(Paper),
}

#[derive(Debug, clap::Args)]
struct Paper {
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Voxels along an edge of the volume, bins and rows of the camera.
    #[arg(long, default_value_t = StudyOptions::default().size)]
    size: usize,
    /// Views over 180 degrees.
    #[arg(long, default_value_t = StudyOptions::default().views)]
    views: usize,
    /// Volume gain of the cavity at the height of the cycle (0.6 is an ejection fraction of 0.375).
    #[arg(long, default_value_t = StudyOptions::default().gain, allow_negative_numbers = true)]
    gain: f64,
    /// Heart rate in beats per minute.
    #[arg(long, default_value_t = StudyOptions::default().beats_per_minute, allow_negative_numbers = true)]
    bpm: f64,
    /// Nodes of a membrane.
    #[arg(long, default_value_t = StudyOptions::default().nodes)]
    nodes: usize,
    /// Threads to use; all cores if not given. The results do not depend on it.
    #[arg(long)]
    threads: Option<usize>,
    /// Leave the figures out (numbers, sinograms and volumes are written all the same).
    #[arg(long)]
    no_figures: bool,
    /// No progress bar, no summary.
    #[arg(long)]
    quiet: bool,
}

fn main() -> ExitCode {
    let Command::Paper(paper) = Arguments::parse().command;
    match run(&paper) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(paper: &Paper) -> Result<(), heart_phantom::PhantomError> {
    let options = StudyOptions {
        size: paper.size,
        views: paper.views,
        gain: paper.gain,
        beats_per_minute: paper.bpm,
        nodes: paper.nodes,
        threads: paper.threads,
        figures: !paper.no_figures,
    };
    let bar = if paper.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(1000)
    };
    if let Ok(style) =
        ProgressStyle::with_template("{bar:40.cyan/blue} {percent:>3}% {elapsed_precise} {msg}")
    {
        bar.set_style(style);
    }
    let report = study::run(&options, &paper.out, &|progress| {
        bar.set_message(progress.stage);
        bar.set_position((progress.fraction * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let report = report?;
    if !paper.quiet {
        println!("{}", study::summary(&report));
        println!("written to {}", paper.out.join("index.html").display());
    }
    Ok(())
}
