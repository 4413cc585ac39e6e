//! A beating-heart phantom with exact ground truth.
//!
#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! Two coaxial elastic membranes, endocardial and epicardial, are inflated by water. Their shapes `c(s)` follow from
//!
#![doc = include_str!("../img/equations.html")]
//!
//! (Rohmer, Sitek and Gullberg 2006, hal-03929238, Eq. 3 and 7). The cardiac cycle defines the volume of the cavity; the force intensities `f`
//! of both membranes are unknowns. The shapes are revolved into a body, whose line integrals have closed forms.
//!
//! # Conventions
//! Centimetres, seconds; radians, but degrees in `Scene` and in fields named `..._degrees`; 1 cm^3 is 1 mL. Body frame: x along the axis of revolution from the base to the apex. Lab frame: the camera
//! rotates about z; view `theta` has its bins along `(cos theta, sin theta, 0)` and its rays along `(-sin theta, cos theta, 0)`. Item `k` of
//! `n` bins, rows or voxels is centred at `(k - (n - 1) / 2) * pitch`. Projections are `[view][row][bin]`, volumes `[z][y][x]`; the last
//! index is the fastest. Arrays are `Vec`s, which `ndarray` takes without a copy: `Array3::from_shape_vec((nz, ny, nx), volume)`, views as
//! `(n_views, n_rows, n_bins)`.
//!
//! # Limits
//! No anatomy except the two membranes and the organs around them, no blood flow. The numerical kernels are in the crates
//! [`membrane_forces`], [`membrane_newton`], [`membrane_implicit`], [`revolve_voxel`], [`photon_scatter`] and [`radon`].
//!
//! # Files
//! [`files`] writes volumes and projections atomically: npy, npz, NIfTI, MetaImage, NRRD, Interfile, raw with JSON, DICOM.
//!
//! # Features
//! - `files` (on by default): formats that need a library: npz, compressed NIfTI, images of slices (PNG, GIF). Without it
//!   (`default-features = false`) they return [`PhantomError::NotBuilt`], and the dependency tree has 60 packages instead of 79.
//! - `dicom` (off by default): the format DICOM.
//!
//! The crate `heart-study` contains the study of the paper, its figures and the command line.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod error;
pub mod files;
mod model;
mod observer;
mod once;
mod phantom;
mod ranges;
mod scan;
pub mod scene;
mod text;
mod truth;

pub use membrane_forces;
pub use membrane_implicit;
pub use membrane_newton;
pub use photon_scatter;
pub use radon;
pub use revolve_voxel;

pub use error::{PhantomError, check as check_value, check_count, check_length};
pub use model::{
    activity::{Activity, Background, Uptake},
    attenuation::{Attenuation, Medium},
    breathing::{Breathing, BreathingCurve, RespiratoryGates},
    chest::Chest,
    cycle::Cycle,
    defect::Defect,
    heart::{Balloon, Heart},
    material::{MaterialPoint, Wall},
    rhythm::{Beats, GatedBy, RrIntervals},
    shape::{HeartShape, MMHG_PER_KPA},
    strain::{Deformation, GreenStrain},
    twist::Twist,
    volume_curve::{VolumeCurve, VolumeRange},
};
pub use observer::{Observer, no_observer};
pub use phantom::{
    Phantom,
    artefacts::Artefacts,
    beats::BeatReport,
    memory::Memory,
    method::{Compensation, Method, Osem, OsemReport},
    motion::{MotionField, MotionReport, PointMotion},
    numbers::{Numbers, Thickness},
    output::{GateFiles, Output, Product, ProjectionValues},
    phases::{MotionPhase, PhaseOf, PhaseReport, ScenePhase},
    polar::PolarMap,
    products::PlannedFile,
    warning::{Warning, WarningKind},
    work::WorkReport,
};
pub use scan::{
    acquisition::{Sinograms, TruthOf},
    camera::Camera,
    counting::{Counting, Decay},
    imaging::Resolution,
    orbit::Orbit,
    ray_geometry::RayGeometry,
    settings::{Accuracy, BinSample, Counts, Mode, Noise, Rotation},
    view_error::ViewError,
    view_time::{ViewReport, ViewTime},
};
pub use scene::{
    run::{GateResults, Run, run},
    run_report::{
        CompensatedReport, GateReport, MeasuredEjection, PictureReport, Progress, RunReport,
        SliceOrders,
    },
    study::Scene,
};
pub use text::{chain, escape};
pub use truth::regions::{ImageQuality, Regions};
