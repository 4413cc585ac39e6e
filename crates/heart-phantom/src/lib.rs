//! A beating heart phantom with exact ground truth.
//!
//! Two concentric elastic balloons, endocardium and epicardium, are inflated by water. Their shapes `c(s)` follow from
//!
#![doc = include_str!("../img/equations.html")]
//!
//! (Rohmer, Sitek and Gullberg 2006, hal-03929238, Eq. 3 and 7): the cavity's volume is given by the cardiac cycle, both
//! pressures `f` are solved for. The shapes are revolved into a body, a camera turns round it while it beats, and its line
//! integrals are exact.
//!
//! ```
//! use heart_phantom::{Acquisition, Camera, Cycle, Heart, acquire};
//! let heart = Heart::study(201)?;
//! let camera = Camera::new(6, 32, 16.0)?;
//! let cycle = Cycle::new(65.0, 0.6)?;
//! let short = Acquisition::Instants;
//! let sinograms = acquire(&heart, &camera, &cycle, short, [0.0, 1.0], &|_| ())?;
//! assert_eq!(sinograms.samples.len(), 6 * 32 * 32); // [view][row][bin]
//! assert_eq!(sinograms.distinct_phases, 6);
//! # Ok::<(), heart_phantom::PhantomError>(())
//! ```
//!
//! A heart of any two membranes and any volume curve, with defects, blur, noise, attenuation, is put together as [`PhantomParts`]. A
//! whole study is a `Scene`, which a [`Phantom`] brings to life part by part:
//!
//! ```
//! use heart_phantom::{Phantom, Scene, scene::Mode};
//! let scene = Scene::default().with_size(32).with_mode(Mode::Gated { gates: 8 });
//! let phantom = Phantom::new(scene)?;
//! let slice = phantom.slice(2, 16)?; // one gate, one slice: one row of each view, the phases of one gate
//! assert_eq!(phantom.work().slices_reconstructed, 1);
//! # let _ = slice;
//! # Ok::<(), heart_phantom::PhantomError>(())
//! ```
//!
//! # Conventions
//! Centimetres, seconds, radians; 1 cm^3 is 1 mL. Body frame: x along the axis of revolution from the base to the apex.
//! Lab frame: the camera turns about z; view `theta` has its bins along `(cos theta, sin theta, 0)` and its rays along
//! `(-sin theta, cos theta, 0)`. Item `k` of `n` bins, rows or voxels is centred at `(k - (n - 1) / 2) * pitch`. Sinograms are
//! `[view][row][bin]`, volumes `[z][y][x]`, the last index fastest.
//!
//! # What it is not
//! No anatomy beyond the two balloons, no twist, no blood flow. No numerical kernels: those are in the crates below,
//! [`membrane_newton`], [`membrane_implicit`], [`revolve_voxel`] and [`radon`].
//!
//! # Files
//! [`files`] writes volumes and projections whole or not at all: npy, npz, NIfTI, MetaImage, NRRD, Interfile, raw with JSON.
//!
//! # Features
//! Both are on by default; without them (`default-features = false`) the physics is 52 packages instead of 82, itself among them.
//! - `scene`: `Scene`, its TOML, `run` and its report.
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
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
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
    Activity, Attenuation, Background, Balloon, Cycle, Defect, Deformation, GreenStrain, Heart,
    HeartShape, MaterialPoint, Stretch, Twist, Uptake, VolumeCurve, VolumeRange, Wall, WallRegion,
};
pub use phantom::{
    Artefacts, Edge, Memory, Method, Numbers, Osem, OsemReport, Output, Phantom, PhantomParts,
    PhaseOf, PhaseReport, PlannedFile, Product, ScenePhase, Seen, Thickness, Warning, WorkReport,
};
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use scan::ViewReport;
pub use scan::{
    Accuracy, Acquisition, Camera, CameraGeometry, Collimation, Counting, Counts, Decay, Mode,
    Noise, Rotation, Sinograms, TruthOf, ViewTime, acquire,
};
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use scene::{GateReport, PictureReport, Progress, RunReport, Scene, SliceOrders, run};
pub use text::shown;
pub use truth::{Measures, Regions, truth};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct ReadmeDoctests;
