//! Common state of the stages of the study: scene, run times, directory.

use super::options::StudyOptions;
use crate::report;
use heart_phantom::{Observer, Phantom, PhantomError, Progress, files};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of calls of [`Run::stage`] in a complete run, for the progress bar.
const STAGES: f64 = 25.0;

pub(super) struct Run<'a> {
    pub(super) options: &'a StudyOptions,
    pub(super) out: &'a Path,
    /// The scene of all three acquisitions, which share the shapes of the heart.
    pub(super) phantom: Phantom,
    pub(super) time: report::Time,
    progress: Observer<'a, Progress>,
    stages: AtomicUsize,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        options: &'a StudyOptions,
        out: &'a Path,
        progress: Observer<'a, Progress>,
    ) -> Result<Self, PhantomError> {
        Ok(Self {
            options,
            out,
            phantom: Phantom::new(options.scene())?,
            time: report::Time::default(),
            progress,
            stages: AtomicUsize::new(0),
        })
    }

    /// Starts a stage of the progress, unless the caller stops the study.
    pub(super) fn stage(&self, stage: &'static str) -> Result<(), PhantomError> {
        let done = self.stages.fetch_add(1, Ordering::Relaxed) as f64;
        let observed = (self.progress)(Progress {
            stage,
            fraction: (done / STAGES).min(1.0),
        });
        match observed.is_break() {
            true => Err(PhantomError::Stopped),
            false => Ok(()),
        }
    }

    /// Writes an array as `NAME-WHAT.npy`.
    pub(super) fn write(
        &self,
        name: &str,
        what: &str,
        shape: &[usize],
        values: &[f32],
    ) -> Result<(), PhantomError> {
        let file = format!("{name}-{what}.npy");
        files::write_npy(&self.out.join(file), shape, values)
    }
}

/// Largest resident memory of this process so far in bytes, as reported by the kernel; 0 if unknown.
pub(super) fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| rest.split_whitespace().next())
        .and_then(|kib| kib.parse::<u64>().ok())
        .map_or(0, |kib| kib * 1024)
}
