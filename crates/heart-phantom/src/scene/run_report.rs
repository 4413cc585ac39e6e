//! Progress and report of a run.

use super::read::json_text;
use super::study::Scene;
use crate::files::SliceOrder;
use crate::{
    Artefacts, BeatReport, Memory, MotionReport, Numbers, OsemReport, PhaseReport, PolarMap,
    Resolution, TruthOf, ViewError, ViewReport, Warning, WorkReport,
};
use serde::Serialize;
use std::path::PathBuf;

/// The progress of a computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The current stage.
    pub stage: &'static str,
    /// Completed fraction of the work, 0 to 1.
    pub fraction: f64,
}

/// The results of a run, written to `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RunReport {
    /// The program and its version: [`PROGRAM`](crate::files::PROGRAM).
    pub program: String,
    /// The scene with defaults, if the phantom was made from a scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// Warnings about settings with unexpected consequences.
    pub warnings: Vec<Warning>,
    /// Volumes, ejection fraction, wall thickness.
    pub numbers: Numbers,
    /// The heart at the phases that represent the projections, at end-diastole and at end-systole.
    pub phases: Vec<PhaseReport>,
    /// Torsion, shortening and the scene's points at these phases, if motion is written or points are given.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<MotionReport>,
    /// Ejection fraction measured in the images of the cardiac gates; `numbers` has the true value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredEjection>,
    /// Statistics of the beats, if R-R intervals vary or beats are rejected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beats: Option<BeatReport>,
    /// One entry per gate; one without gating.
    pub gates: Vec<GateReport>,
    /// One entry per motion-compensated volume.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compensated: Vec<CompensatedReport>,
    /// Slice and grey scale of the images, if written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureReport>,
    /// Order of rows and slices in the files.
    pub slice_order: SliceOrders,
    /// Names of the label values, from 0, if labels are written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
    /// Predicted upper limit of the memory.
    pub memory: Memory,
    /// Work done by the computation.
    pub work: WorkReport,
    /// Files written, relative to the directory.
    pub files: Vec<PathBuf>,
}

/// The order along z in the files of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SliceOrders {
    /// Rows of the projections.
    pub projections: SliceOrder,
    /// Slices of the volumes.
    pub volumes: SliceOrder,
}

/// The results of one gated projection set.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct GateReport {
    /// Times and angles of the projections.
    pub views: ViewReport,
    /// Bounds on the errors of the samples, if projections were computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_error: Option<ViewError>,
    /// Quadrature steps per cycle, given or derived from the tolerance, if there is a quadrature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_steps: Option<usize>,
    /// Sub-bins and rays of bin averages, if samples are bin averages ([`Phantom::resolution`](crate::Phantom::resolution)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Expected counts per unit sample, if noise or the sensitivity of the camera is given and all views have the same value;
    /// [`ViewReport::counts_per_unit`] contains the value of each view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts_per_unit: Option<f64>,
    /// Counts in all projections, expected or drawn, if the counts per unit are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts: Option<f64>,
    /// Iterations of OSEM, if OSEM reconstructed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osem: Option<OsemReport>,
    /// Time average that the voxelised ground truth represents, if written. Its file is `truth` or `truth-mean-of-views`;
    /// [`Artefacts::rmse`] compares with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthOf>,
    /// Comparison of reconstruction and ground truth, if both exist.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub artefacts: Option<Artefacts>,
    /// Polar map of the reconstruction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polar_map: Option<PolarMap>,
    /// Polar map of the voxelised ground truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polar_map_truth: Option<PolarMap>,
}

/// Ejection fraction from the largest and the smallest cavity in the polar maps of all gates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MeasuredEjection {
    /// Value of the reconstructions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ejection_fraction: Option<f64>,
    /// Value of the ground truth, which is averaged over each gate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ejection_fraction_truth: Option<f64>,
}

impl RunReport {
    /// Returns the text of `report.json`. It is empty if a name in `files` is not Unicode; a run with such a name fails.
    #[must_use]
    pub fn to_json(&self) -> String {
        json_text(self).unwrap_or_default()
    }
}

impl MeasuredEjection {
    /// Returns `None` without images of several gates.
    pub(super) fn of(gates: &[GateReport]) -> Option<Self> {
        let measured = |map: fn(&GateReport) -> Option<PolarMap>| {
            let volumes: Option<Vec<f64>> =
                (gates.iter().map(map)).map(|map| map?.cavity_ml).collect();
            let volumes = volumes.filter(|volumes| volumes.len() > 1)?;
            let most = volumes.iter().copied().fold(0.0, f64::max);
            let least = volumes.iter().copied().fold(f64::INFINITY, f64::min);
            (most > 0.0).then(|| (most - least) / most)
        };
        let found = Self {
            ejection_fraction: measured(|gate| gate.polar_map),
            ejection_fraction_truth: measured(|gate| gate.polar_map_truth),
        };
        let some = found.ejection_fraction.or(found.ejection_fraction_truth);
        some.map(|_| found)
    }
}

/// The results of one motion-compensated volume.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct CompensatedReport {
    /// Iterations of OSEM, if OSEM reconstructed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osem: Option<OsemReport>,
    /// Comparison with the ground truth at the reference phase, if both exist.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub artefacts: Option<Artefacts>,
}

/// Slice and grey scale of the images of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PictureReport {
    /// Index of the slice.
    pub slice: usize,
    /// Its height in cm.
    pub z_cm: f64,
    /// Activity displayed as black; lower values are black, too.
    pub black: f64,
    /// Activity displayed as white: the largest value of this slice in all gates.
    pub white: f64,
}
