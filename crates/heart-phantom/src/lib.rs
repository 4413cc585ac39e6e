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
//! let short = Acquisition::Instants { interval: 1.0 };
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

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::unreachable,
        clippy::panic
    )
)]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod acquire;
mod activity;
mod artefacts;
mod attenuation;
#[cfg(feature = "scene")]
mod build;
mod camera;
mod cycle;
mod defect;
mod error;
pub mod files;
mod heart;
mod kept;
mod levels;
mod material;
mod memory;
mod numbers;
mod parts;
mod phantom;
mod phases;
mod planned;
mod prepare;
mod quadrature;
mod readout;
#[cfg(feature = "scene")]
mod run;
mod scan;
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub mod scene;
mod settings;
#[cfg(feature = "scene")]
mod source;
mod steps;
mod text;
mod timing;
mod truth;
mod view_time;
mod volume_curve;
mod warning;
mod wide;
mod work;

pub use membrane_forces;
pub use membrane_implicit;
pub use membrane_newton;
pub use radon;
pub use revolve_voxel;

pub use acquire::{Acquisition, Sinograms, acquire};
pub use activity::{Activity, Background, Uptake};
pub use artefacts::Artefacts;
pub use attenuation::Attenuation;
pub use camera::{Camera, CameraGeometry, Rotation};
pub use cycle::Cycle;
pub use defect::Defect;
pub use error::PhantomError;
pub use heart::{Balloon, Heart, HeartShape};
pub use material::{MaterialPoint, Stretch, Wall, WallRegion};
pub use memory::Memory;
pub use numbers::{Numbers, Thickness};
pub use parts::PhantomParts;
pub use phantom::Phantom;
pub use phases::{PhaseOf, PhaseReport, ScenePhase};
pub use planned::PlannedFile;
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use run::{GateReport, PictureReport, Progress, RunReport, SliceOrders, run};
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use scene::Scene;
pub use settings::{Accuracy, Counts, Mode, Noise, Output, Product};
pub use text::shown;
pub use truth::{Measures, Regions, TruthOf, truth};
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use view_time::ViewReport;
pub use view_time::ViewTime;
pub use volume_curve::{VolumeCurve, VolumeRange};
pub use warning::{Edge, Seen, Warning};
pub use work::WorkReport;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct ReadmeDoctests;
