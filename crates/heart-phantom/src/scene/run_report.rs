//! What a run tells: how far it is, and what it found and did.

use super::study::Scene;
use crate::files::SliceOrder;
use crate::{
    Artefacts, BeatReport, Memory, MotionReport, Numbers, OsemReport, PhaseReport, PolarMap,
    Resolution, TruthOf, ViewError, ViewReport, Warning, WorkReport,
};
use serde::Serialize;
use std::path::PathBuf;

/// How far a computation is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub stage: &'static str,
    /// Share of the work behind us, 0 to 1.
    pub fraction: f64,
}

/// What a run found and did; `report.json` holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RunReport {
    /// The program and its version: [`PROGRAM`](crate::files::PROGRAM).
    pub program: String,
    /// The scene, defaults filled in, if the phantom was made from one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// What may surprise.
    pub warnings: Vec<Warning>,
    /// Volumes, ejection fraction, wall.
    pub numbers: Numbers,
    /// The heart at the phases that stand for the views, and at end-diastole and end-systole.
    pub phases: Vec<PhaseReport>,
    /// Torsion, shortening and the scene's points at the phases that stand for the views, where motion was written, or there are points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<MotionReport>,
    /// Ejection fraction measured on the images of the cardiac gates, beside the true one of `numbers`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredEjection>,
    /// The beats, where they differ or some do not count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beats: Option<BeatReport>,
    /// One entry for each gate, or one.
    pub gates: Vec<GateReport>,
    /// One entry for each volume of all gates in one frame, where such were made.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compensated: Vec<CompensatedReport>,
    /// What the pictures show, where such were written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureReport>,
    /// Rows and slices in the files of the formats chosen.
    pub slice_order: SliceOrders,
    /// What the numbers in label volumes stand for, from 0 on, where such were written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
    /// Memory that this was said to take at most.
    pub memory: Memory,
    /// Work done.
    pub work: WorkReport,
    /// Files written, relative to the folder.
    pub files: Vec<PathBuf>,
}

/// The order of what follows each other along z, in the files of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SliceOrders {
    /// Rows of the projections.
    pub projections: SliceOrder,
    /// Slices of the volumes.
    pub volumes: SliceOrder,
}

/// One set of views.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct GateReport {
    /// When and from where its views are taken.
    pub views: ViewReport,
    /// Bounds on the errors of the samples, where views were computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_error: Option<ViewError>,
    /// Steps a cycle of the quadrature over time, as given or as the tolerance took, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_steps: Option<usize>,
    /// Sub-bins and rays of averages over bins, where samples are such ([`Phantom::resolution`](crate::Phantom::resolution)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Mean counts of a sample of 1, where views with noise were made, or the camera's sensitivity is known, and all views have the
    /// same; what each has by that sensitivity is [`ViewReport::counts_per_unit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts_per_unit: Option<f64>,
    /// Counts in all projections, expected or drawn, where the counts per unit are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts: Option<f64>,
    /// What OSEM did, where it reconstructed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osem: Option<OsemReport>,
    /// What the exact volume is the mean over, where it was written: its file is `truth`, or `truth-mean-of-views`, and `rmse` below
    /// is the difference from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthOf>,
    /// The reconstruction against the truth, where both were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub artefacts: Option<Artefacts>,
    /// Polar map of the reconstruction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polar_map: Option<PolarMap>,
    /// Polar map of the exact volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polar_map_truth: Option<PolarMap>,
}

/// Ejection fraction from the largest and the smallest cavity of the polar maps of all gates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MeasuredEjection {
    /// On the reconstructions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ejection_fraction: Option<f64>,
    /// On the exact volumes, which are averages over the gates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ejection_fraction_truth: Option<f64>,
}

impl MeasuredEjection {
    /// `None` without images of several gates.
    pub(super) fn of(gates: &[GateReport]) -> Option<Self> {
        let measured = |map: fn(&GateReport) -> Option<PolarMap>| {
            let volumes: Option<Vec<f64>> = (gates.iter().map(map))
                .map(|map| Some(map?.cavity_ml))
                .collect();
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

/// A volume of all gates in one frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct CompensatedReport {
    /// What OSEM did, where it reconstructed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osem: Option<OsemReport>,
    /// The volume against the truth in that frame, where both were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub artefacts: Option<Artefacts>,
}

/// The slice that all pictures of a run show, and its greys.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PictureReport {
    /// Index of the slice.
    pub slice: usize,
    /// Its height in cm.
    pub z_cm: f64,
    /// Activity that is black, as is everything below.
    pub black: f64,
    /// Activity that is white: the largest of that slice in all gates.
    pub white: f64,
}
