//! The sections of a [`Scene`], its TOML file and validation. Types that are also used without a scene are in the root
//! of the crate, [`radon::Window`], [`radon::ArcPolicy`] and [`membrane_newton::PressureLaw`] in the re-exported crates.
//!
//! # Scene files
//! In TOML, fields and variants with data are keys in snake case (`beats_per_minute`, `{ per_unit = 10.0 }`); variants without data are
//! strings in kebab case, such as `"ge-lehr"` for [`HolesSettings::GeLehr`] or `"meta-image"` for
//! [`Format::MetaImage`](crate::files::Format). The following file contains every field. Values are the defaults, except in the sections and
//! fields that it calls optional or absent by default, whose values are examples ([`Scene::to_toml`] comments them out). `{volumes}`,
//! `{projections}` and `{gates}` stand for the names of the [formats](crate::files) that can store these.
//!
//! ```toml
#![doc = include_str!("template.toml")]
//! ```

mod beam;
mod build;
mod bytes;
mod camera;
pub(crate) mod check;
mod check_beam;
mod check_camera;
mod check_output;
mod check_reconstruction;
mod check_time;
mod file;
mod finding;
mod json;
mod material;
mod motion;
mod parts;
mod place;
mod read;
pub(crate) mod run;
mod run_compensated;
pub(crate) mod run_report;
mod run_write;
mod sections;
mod source;
pub(crate) mod study;
mod template;

pub(crate) use build::WORK_BYTES;
pub use camera::{BeamSettings, CameraSettings, HeadsSettings};
pub(crate) use check_beam::needs_parallel;
pub(crate) use file::exactly;
pub(crate) use finding::{Check, array_of, place_in};
pub use finding::{Finding, SceneError};
pub use material::MaterialSettings;
pub use motion::PointSettings;
pub(crate) use parts::Parts;
pub use place::{locate, read_toml};
pub use read::read_text;
pub use sections::{
    AcquisitionSettings, BlurSettings, CollimatorSettings, CycleSettings, DiscretisationSettings,
    HeartSettings, HolesSettings, OrganSettings, OrganShapeSettings, PixelRange, PoseSettings,
    ReconstructionSettings, ScatterSettings, TruthSettings,
};
pub(crate) use study::Scene;
