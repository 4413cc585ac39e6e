//! A scene: what beats, what looks at it, what is made of it. Types, their TOML file, and its run.

mod build;
mod check;
mod check_reconstruction;
mod check_time;
mod error;
mod fault;
mod place;
mod read;
mod run;
mod run_report;
mod sections;
mod source;
mod study;
mod template;

pub use crate::{
    Accuracy, Activity, Balloon, Counting, Counts, Decay, GateFiles, Method, Mode, Noise, Osem,
    Output, Product, Rotation,
};
pub use error::SceneError;
pub(crate) use error::place_in;
pub use membrane_forces::PressureLaw;
pub use radon::{ArcPolicy, Window};
pub use run::{GateResults, Run, run};
pub use run_report::{GateReport, PictureReport, Progress, RunReport, SliceOrders};
pub use sections::{
    AcquisitionSettings, AttenuationSettings, BackgroundSettings, BlurSettings, CameraSettings,
    CollimatorSettings, CycleSettings, DefectSettings, DiscretisationSettings, HeartSettings,
    HolesSettings, MediumSettings, OrganSettings, OrganShapeSettings, PixelRange, PoseSettings,
    ReconstructionSettings, TruthSettings,
};
pub(crate) use source::Source;
pub use study::Scene;
