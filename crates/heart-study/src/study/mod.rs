//! The study of Rohmer, Sitek and Gullberg (2006), end to end: shapes, both methods, three
//! acquisitions, their reconstructions, every figure and every number.

mod evolving;
mod membranes;
pub(crate) mod options;
mod paper_newton;
mod pictures;
mod rubber;
mod run;
mod tomography;

use crate::figures::CircleStudy;
use crate::html::Page;
use crate::report::Report;
use heart_phantom::PhantomError;
use heart_phantom::{Observer, Progress, files};
use options::StudyOptions;
use run::Run;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Heading of the page.
const TITLE: &str = "A beating heart from two balloons";
/// Introduction of the page.
const INTRODUCTION: &str = "The study of Rohmer, Sitek and Gullberg (2006), Simulation of the \
    Beating Heart Based on Physically Modeling a Deformable Balloon (hal-03929238), reproduced: \
    solved shapes, sinograms from exact chords, filtered back-projection slice by slice.";

/// Runs the study and writes its files to the directory `out`, `report.json` last. The report of an earlier run and the files that
/// it lists are removed first. A study that fails removes its files. Threads are those of the current pool.
///
/// # Errors
/// An option out of range, a directory that is not writable or other files under names of the study are reported before any work; see [`PhantomError`].
/// [`Stopped`](PhantomError::Stopped) if `progress`, called before each stage, stops the study.
pub fn run(
    options: &StudyOptions,
    out: &Path,
    progress: Observer<'_, Progress>,
) -> Result<Report, PhantomError> {
    options.validate()?;
    let mut folder = files::Folder::lock(out)?;
    let planned = planned(options.figures);
    folder.clear(&planned)?;
    let mut report = compute(options, out, progress)?;
    let is_written = |name: &PathBuf| out.join(name).is_file() || *name == Path::new(files::REPORT);
    report.files = planned.into_iter().filter(is_written).collect();
    report.peak_memory_bytes = run::peak_memory();
    files::write_atomically(&out.join(files::REPORT), |file| {
        serde_json::to_writer_pretty(&mut *file, &report)?;
        file.write_all(b"\n")
    })?;
    folder.finish();
    Ok(report)
}

/// Names of all files of the study, the report last.
fn planned(figures: bool) -> Vec<PathBuf> {
    let mut names = Vec::new();
    if figures {
        names.extend(
            pictures::FILES
                .iter()
                .chain(&[Page::FILE])
                .map(PathBuf::from),
        );
    }
    for (k, (name, _)) in tomography::ACQUISITIONS.into_iter().enumerate() {
        names.extend(tomography::ARRAYS.map(|what| format!("{name}-{what}.npy").into()));
        if figures {
            let number = 15 + k;
            names.extend(
                pictures::VOLUMES.map(|what| format!("fig{number}-{name}-{what}.png").into()),
            );
        }
    }
    names.push(files::REPORT.into());
    names
}

/// Computes the study and writes its files, without the report.
fn compute(
    options: &StudyOptions,
    out: &Path,
    progress: Observer<'_, Progress>,
) -> Result<Report, PhantomError> {
    let mut run = Run::new(options, out, progress)?;
    let total = Instant::now();
    let mut page = options
        .figures
        .then(|| Page::new(out, TITLE, vec![INTRODUCTION.into()]));
    let mut report = Report {
        program: files::PROGRAM.into(),
        settings: options.clone(),
        voxel_cm: run.phantom.camera().pitch(),
        ..Report::default()
    };
    let circle = solve(&mut run, &mut report, page.as_mut())?;

    run.stage("voxels")?;
    let clock = Instant::now();
    let regions = run.phantom.regions()?.clone();
    run.time.truth_and_files += clock.elapsed().as_secs_f64();
    let mut volumes = [Vec::new(), Vec::new()];
    for (k, (name, mode)) in tomography::ACQUISITIONS.into_iter().enumerate() {
        let result = tomography::reconstruct(&mut run, (name, mode), &regions, &mut volumes)?;
        let clock = Instant::now();
        if let Some(page) = &mut page {
            run.stage("drawing")?;
            if k == 0 {
                pictures::pose(page, &run)?;
                pictures::projection_images(page, &run, &result.sinograms.samples)?;
            }
            pictures::reconstruction(page, &run, (15 + k, name), &volumes[0])?;
        }
        run.time.truth_and_files += clock.elapsed().as_secs_f64();
        *report.ram_lak.each_mut()[k] = result.ram_lak;
        *report.hann.each_mut()[k] = result.hann;
    }

    if let Some(mut page) = page {
        pictures::measures(&mut page, &report);
        pictures::circle(&mut page, &circle, report.circle.order)?;
        page.write()?;
    }
    run.time.total = total.elapsed().as_secs_f64();
    report.time = run.time;
    Ok(report)
}

/// Reference configurations, both methods, the pair and the circle, with their figures.
fn solve(
    run: &mut Run<'_>,
    report: &mut Report,
    mut page: Option<&mut Page>,
) -> Result<CircleStudy, PhantomError> {
    let clock = Instant::now();
    run.stage("reference configurations")?;
    report.reference = membranes::reference(run)?;
    run.stage("direct method")?;
    let direct = membranes::direct(run)?;
    run.stage("evolving method")?;
    let evolving = evolving::evolving(run)?;
    run.stage("circle")?;
    let circle = membranes::circle()?;
    let peak = run.options.gain;
    let states = run.phantom.heart().shapes(&[0.0, 0.5 * peak, peak])?;
    run.stage("rubber")?;
    let rubber = rubber::rubber(run)?;
    run.time.solve += clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    if let Some(page) = &mut page {
        run.stage("drawing")?;
        pictures::reference(page, &report.reference);
        pictures::direct(page, &direct)?;
        pictures::evolving(page, &evolving)?;
        pictures::pair(page, &states)?;
        pictures::rubber(page, &rubber)?;
    }
    run.time.truth_and_files += clock.elapsed().as_secs_f64();
    report.direct = direct.figures;
    report.evolving = evolving.figures;
    report.circle = membranes::of_circle(&circle);
    report.rubber = rubber.figures;
    Ok(circle)
}

/// Returns a summary in a few lines.
pub(crate) fn summary(report: &Report) -> String {
    let mut text = format!(
        "f_inner {:.8}  f_outer {:.8}  wall volume error {:.1e}\n\
         in the limit of fine meshes: f_inner {:.8}  f_outer {:.8} (stiffness x cm)\n",
        report.direct.f_inner,
        report.direct.f_outer,
        report.direct.wall_volume_error,
        report.direct.limit.f_inner,
        report.direct.limit.f_outer
    );
    let cell = |v: Option<f64>| v.map_or("      -".into(), |v| format!("{v:.5}"));
    text += "            rmse*    wall mean  wall std  background  cavity\n";
    for (name, a) in report.ram_lak.named() {
        text += &format!(
            "{name:<10} {}    {}   {}   {}   {}\n",
            cell(a.quality.rmse_truth),
            cell(a.quality.eroded_wall_mean),
            cell(a.quality.wall_std),
            cell(a.quality.background_rms),
            cell(a.quality.cavity_mean)
        );
    }
    text += "* relative to the exact volume; for the short scan, whose views acquire different shapes, to their average\n";
    if (report.ram_lak.named().iter())
        .any(|(_, a)| a.quality.eroded_wall_mean.is_none() || a.quality.wall_std.is_none())
    {
        text += "- no voxel remains in the eroded wall; choose a larger size\n";
    }
    let t = &report.time;
    text += &format!(
        "solve {:.2} s  project {:.2} s  reconstruct {:.2} s  truth and files {:.2} s  total {:.2} s  memory {} MiB",
        t.solve,
        t.project,
        t.reconstruct,
        t.truth_and_files,
        t.total,
        report.peak_memory_bytes >> 20
    );
    text
}
