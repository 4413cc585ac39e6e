//! Bias of ejection fractions in gated SPECT: volumes by two edge rules in images of hearts of known volumes, with each cause of error
//! switched off in turn.

mod cases;
mod measure;
mod page;

use crate::html::Page;
use heart_phantom::PhantomError;
use heart_phantom::{Observer, Progress, files};
use measure::CaseResult;
pub(crate) use page::QUICK;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

const TITLE: &str = "Bias of ejection fractions in gated SPECT";
const SUMMARY: &str = "edge at half maximum / at the steepest gradient (true value); volumes in mL";

/// The results, written to `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct EjectionReport {
    /// The program and its version.
    pub(crate) program: String,
    /// Whether it tests the program with one heart and few views: its numbers have no meaning.
    pub(crate) quick: bool,
    /// Counts in all projections of a study.
    pub(crate) counts: f64,
    /// All cases.
    pub(crate) cases: Vec<CaseResult>,
    /// Wall time in seconds.
    pub(crate) seconds: f64,
    /// Files written, relative to the directory.
    pub(crate) files: Vec<PathBuf>,
}

/// Runs the study and writes page, plots and `report.json` to the directory `out`. The report of an earlier run and the files that it lists
/// are removed first. A study that fails removes its files. The full study takes some minutes on two cores; a `quick` one has one heart and few
/// views and tests the program only.
///
/// # Errors
/// A directory that is not writable or other files under names of the study are reported before any work; see [`PhantomError`].
pub(crate) fn ejection(
    quick: bool,
    out: &Path,
    progress: Observer<'_, Progress>,
) -> Result<EjectionReport, PhantomError> {
    let mut folder = files::Folder::lock(out)?;
    let planned = page::PLOTS.iter().chain(&[Page::FILE, files::REPORT]);
    folder.clear(&planned.map(PathBuf::from).collect::<Vec<_>>())?;
    let (clock, cases) = (Instant::now(), cases::all(quick)?);
    let (mut shared, mut results) = (None, Vec::new());
    for case in &cases {
        let _ = progress(Progress {
            stage: "images",
            fraction: results.len() as f64 / cases.len() as f64,
        });
        results.push(measure::measure(case, &mut shared)?);
    }
    let mut page = Page::new(out, TITLE, page::introduction(quick, &cases));
    page::write(&mut page, &results)?;
    let mut files = page.write()?;
    files.push(files::REPORT.into());
    let report = EjectionReport {
        program: files::PROGRAM.into(),
        quick,
        counts: measure::COUNTS,
        cases: results,
        seconds: clock.elapsed().as_secs_f64(),
        files,
    };
    files::write_atomically(&out.join(files::REPORT), |file| {
        serde_json::to_writer_pretty(&mut *file, &report)?;
        file.write_all(b"\n")
    })?;
    folder.finish();
    Ok(report)
}

impl EjectionReport {
    /// Returns a summary: a heading, a line per case, and for a quick study that its numbers have no meaning.
    pub(crate) fn summary(&self) -> Vec<String> {
        let line = |result: &CaseResult| {
            let case = format!(
                "{:6} {:.2}  {:33}",
                result.case.size, result.case.fraction, result.case.name
            );
            let columns = ["EDV", "ESV", "EF"].iter().enumerate().map(|(part, name)| {
                let [half, steep] = [0, 1].map(|rule| result.rules[rule].expected.values()[part]);
                let digits = if part == 2 { 3 } else { 1 };
                let truth = result.truth.values()[part];
                format!("  {name} {half:5.digits$} / {steep:5.digits$} ({truth:5.digits$})")
            });
            columns.fold(case, |line, column| line + &column)
        };
        [SUMMARY.to_owned()]
            .into_iter()
            .chain(self.cases.iter().map(line))
            .chain(self.quick.then(|| QUICK.to_owned()))
            .collect()
    }
}
