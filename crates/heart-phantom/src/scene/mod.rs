//! Scenes: the settings of a study, their TOML file, validation and the run.
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
mod run;
mod run_compensated;
mod run_report;
mod run_write;
mod sections;
mod source;
mod study;
mod template;

pub use crate::{
    Accuracy, Activity, Attenuation, Background, Balloon, Beats, BinSample, Breathing,
    BreathingCurve, Chest, Compensation, Counting, Counts, Decay, Defect, GateFiles, GatedBy,
    Medium, Method, Mode, Noise, Orbit, Osem, Output, Product, ProjectionValues, RespiratoryGates,
    Rotation, RrIntervals, Twist,
};
pub(crate) use build::WORK_BYTES;
pub use camera::{BeamSettings, CameraSettings, HeadsSettings};
pub(crate) use check_beam::needs_parallel;
pub(crate) use file::exactly;
pub(crate) use finding::{Check, array_of, place_in};
pub use finding::{Finding, SceneError};
pub use material::MaterialSettings;
pub use membrane_forces::PressureLaw;
pub use motion::PointSettings;
pub(crate) use parts::Parts;
pub use place::{locate, read_toml};
pub use radon::{ArcPolicy, Window};
pub use read::read_text;
pub use run::{GateResults, Run, run};
pub use run_report::{
    CompensatedReport, GateReport, MeasuredEjection, PictureReport, Progress, RunReport,
    SliceOrders,
};
pub use sections::{
    AcquisitionSettings, BlurSettings, CollimatorSettings, CycleSettings, DiscretisationSettings,
    HeartSettings, HolesSettings, OrganSettings, OrganShapeSettings, PixelRange, PoseSettings,
    ReconstructionSettings, ScatterSettings, TruthSettings,
};
pub use study::Scene;
