//! A scene: what beats, what looks at it, what is made of it. Types, their TOML file, and its run.

mod build;
mod check;
mod check_camera;
mod check_reconstruction;
mod check_time;
mod error;
mod fault;
mod material;
mod motion;
mod place;
mod read;
mod run;
mod run_compensated;
mod run_report;
mod sections;
mod source;
mod study;
mod template;

pub use crate::{
    Accuracy, Activity, Balloon, Beats, BinSample, BreathingCurve, Chest, Compensation, Counting,
    Counts, Decay, GateFiles, GatedBy, Method, Mode, Noise, Orbit, Osem, Output, Product,
    RespiratoryGates, Rotation, RrIntervals,
};
pub use error::SceneError;
pub(crate) use error::place_in;
pub use material::MaterialSettings;
pub use membrane_forces::PressureLaw;
pub use motion::{BreathingSettings, PointSettings, TwistSettings};
pub use radon::{ArcPolicy, Window};
pub use run::{GateResults, Run, run};
pub use run_report::{
    CompensatedReport, GateReport, PictureReport, Progress, RunReport, SliceOrders,
};
pub use sections::{
    AcquisitionSettings, AttenuationSettings, BackgroundSettings, BlurSettings, CameraSettings,
    CollimatorSettings, CycleSettings, DefectSettings, DiscretisationSettings, HeadsSettings,
    HeartSettings, HolesSettings, MediumSettings, OrganSettings, OrganShapeSettings, PixelRange,
    PoseSettings, ReconstructionSettings, TruthSettings,
};
pub(crate) use source::Source;
pub use study::Scene;
