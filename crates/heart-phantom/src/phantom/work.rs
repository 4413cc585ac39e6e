//! Counters of the work done and saved.

use radon::FbpReport;
use revolve_voxel::{RayCounters, VoxelCounters};
use std::sync::{Mutex, PoisonError};

/// Work done for a phantom so far, independent of the number of threads.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct WorkReport {
    /// Equilibria of the pair of membranes.
    pub shapes_solved: usize,
    /// Largest number of shapes in memory at a time.
    pub shapes_at_once: usize,
    /// Rays whose intersections with the surfaces were computed.
    pub rays_cast: u64,
    /// Rays that miss the body and were skipped.
    pub rays_skipped: u64,
    /// Voxels with a computed coverage, because a surface may cut them; counted per layer.
    pub voxels_cut: u64,
    /// Slices back-projected.
    pub slices_reconstructed: usize,
    /// Slices without signal.
    pub slices_skipped: usize,
    /// Iterations of OSEM through all views of a gate.
    pub osem_iterations: usize,
}

/// The counters behind a [`WorkReport`].
#[derive(Debug, Default)]
pub(crate) struct Work(Mutex<WorkReport>);

impl Work {
    pub(crate) fn report(&self, shapes_solved: usize, shapes_at_once: usize) -> WorkReport {
        let mut report = WorkReport::default();
        self.add(|sum| report = *sum);
        (report.shapes_solved, report.shapes_at_once) = (shapes_solved, shapes_at_once);
        report
    }

    pub(crate) fn rays(&self, rays: RayCounters) {
        self.add(|sum| {
            sum.rays_cast += rays.cast;
            sum.rays_skipped += rays.skipped;
        });
    }

    pub(crate) fn voxels(&self, voxels: VoxelCounters) {
        self.add(|sum| sum.voxels_cut += voxels.cut);
    }

    pub(crate) fn reconstruction(&self, report: FbpReport) {
        self.add(|sum| {
            sum.slices_reconstructed += report.slices_reconstructed;
            sum.slices_skipped += report.slices_skipped;
        });
    }

    pub(crate) fn osem(&self, iterations: usize) {
        self.add(|sum| sum.osem_iterations += iterations);
    }

    /// Sums are consistent even after a panic elsewhere.
    fn add(&self, change: impl FnOnce(&mut WorkReport)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }
}
