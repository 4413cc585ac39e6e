//! A scene: what beats, what looks at it, what is made of it. Types, their TOML file, and its run.

mod build;
mod check;
mod check_time;
mod error;
mod fault;
mod place;
mod read;
mod run;
mod sections;
mod source;
mod study;
mod template;

pub use crate::{Accuracy, Counts, Mode, Noise, Output, Product};
pub use error::SceneError;
pub(crate) use error::place_in;
pub use run::{GateReport, PictureReport, Progress, RunReport, SliceOrders, run};
pub use sections::{
    AcquisitionSettings, ActivitySettings, ArcSettings, AttenuationSettings, BackgroundSettings,
    BalloonSettings, BlurSettings, CameraSettings, CycleSettings, DefectSettings,
    DiscretisationSettings, HeartSettings, Law, MediumSettings, PixelRange, PoseSettings,
    ReconstructionSettings, RotationSettings, TruthSettings, WindowSettings,
};
pub(crate) use source::Source;
pub use study::Scene;
