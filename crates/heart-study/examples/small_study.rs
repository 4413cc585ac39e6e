//! The study of the paper at a small size: force intensities of both membranes, with a report and arrays.
//!
//! `cargo run --release -p heart-study --example small_study -- FOLDER`

use heart_study::heart_phantom::no_observer;
use heart_study::{StudyOptions, run};
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "study".into()));
    let mut options = StudyOptions::default();
    options.size = 16; // voxels per side
    options.views = 8;
    options.nodes = 51; // of the finite differences
    options.figures = false;
    let report = run(&options, &folder, &no_observer)?;
    let limit = &report.direct.limit;
    println!("force intensity, inner membrane: {:.10}", limit.f_inner);
    println!("force intensity, outer membrane: {:.10}", limit.f_outer);
    println!("report and arrays: {}", folder.display());
    Ok(())
}
