//! A beating heart phantom with exact ground truth.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! Two concentric elastic balloons, endocardium and epicardium, are inflated by water. Their shapes `c(s)` follow from
//!
#![doc = include_str!("../img/equations.html")]
//!
//! (Rohmer, Sitek and Gullberg 2006, hal-03929238, Eq. 3 and 7): the cavity's volume is given by the cardiac cycle, both
//! pressures `f` are solved for. The shapes are revolved into a body, a camera turns round it while it beats, and its line
//! integrals are exact.
//!
//! # Conventions
//! Centimetres, seconds, radians; 1 cm^3 is 1 mL. Body frame: x along the axis of revolution from the base to the apex.
//! Lab frame: the camera turns about z; view `theta` has its bins along `(cos theta, sin theta, 0)` and its rays along
//! `(-sin theta, cos theta, 0)`. Item `k` of `n` bins, rows or voxels is centred at `(k - (n - 1) / 2) * pitch`. Sinograms are
//! `[view][row][bin]`, volumes `[z][y][x]`, the last index fastest.
//!
//! # What it is not
//! No anatomy beyond the two balloons and the organs that are put around them, no blood flow. No numerical kernels: those are in the crates below,
//! [`membrane_newton`], [`membrane_implicit`], [`revolve_voxel`] and [`radon`].
//!
//! # Files
//! [`files`] writes volumes and projections whole or not at all: npy, npz, NIfTI, MetaImage, NRRD, Interfile,
//! raw with JSON, DICOM.
//!
//! # Features
//! The first two are on by default; without them (`default-features = false`) the crate and its dependencies are 46 packages instead of 78.
//! - `scene`: `Scene`, its TOML, `run` and its report.
//! - `dicom` (off by default): DICOM.
//! - `files`: the formats that need a library: npz, compressed NIfTI, raw with JSON, pictures of slices (PNG, GIF). Without it they are
//!   refused ([`PhantomError::NotBuilt`]); all others are there.
//!
//! The paper's figures, its study as a whole and the command line are in the crate `heart-study`, above this one.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod error;
pub mod files;
mod model;
mod phantom;
mod ranges;
mod scan;
pub mod scene;
mod text;
mod truth;

pub use membrane_forces;
pub use membrane_implicit;
pub use membrane_newton;
pub use radon;
pub use revolve_voxel;

pub use error::PhantomError;
pub use model::{
    Activity, Attenuation, Background, Balloon, Beats, Breathing, BreathingCurve, Chest, Cycle,
    Defect, Deformation, GatedBy, GreenStrain, Heart, HeartShape, MMHG_PER_KPA, MaterialPoint,
    Medium, RespiratoryGates, RespiratoryMotion, RrIntervals, Stretch, Twist, Uptake, VolumeCurve,
    VolumeRange, Wall, WallRegion,
};
pub use phantom::{
    Artefacts, BeatReport, Compensation, Edge, GateFiles, Memory, Method, Moment, MotionField,
    MotionReport, Numbers, Osem, OsemReport, Output, Phantom, PhaseOf, PhaseReport, PlannedFile,
    PointMotion, PolarMap, Product, ProjectionValues, Resolution, ScenePhase, Seen, Thickness,
    Warning, WorkReport,
};
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use scan::ViewReport;
pub use scan::{
    Accuracy, BinSample, Camera, CameraGeometry, Counting, Counts, Decay, Heads, Mode, Noise,
    Orbit, Rotation, Sinograms, TruthOf, ViewError, ViewTime,
};
pub use scene::Scene;
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use scene::{
    CompensatedReport, GateReport, GateResults, MeasuredEjection, PictureReport, Progress, Run,
    RunReport, SliceOrders, run,
};
pub use text::shown;
pub use truth::{Measures, Regions};
