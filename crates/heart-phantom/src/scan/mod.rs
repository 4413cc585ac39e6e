//! What the camera sees, and when: views of a beating heart, each the mean over the time that it sees.

mod acquisition;
mod averages;
mod bin_sample;
mod camera;
mod counting;
mod depth;
mod gates;
mod halves;
mod levels;
mod nodes;
mod orbit;
mod project;
mod readout;
mod samples;
mod settings;
mod spans;
mod time_rule;
mod timing;
mod view_error;
mod view_time;
mod views;
mod whole;

pub(crate) use acquisition::Acquisition;
pub use acquisition::{Sinograms, TruthOf};
pub(crate) use averages::{Averages, LATTICES};
pub use bin_sample::BinSample;
pub use camera::{Camera, CameraGeometry, Heads, Rotation};
pub(crate) use camera::{MOST_SAMPLES, VOXELS};
pub use counting::{Counting, Decay};
pub(crate) use depth::{Depth, Facing, SubBins};
pub(crate) use gates::{SharedShapes, add_to_gates};
pub use orbit::Orbit;
pub(crate) use readout::Readout;
pub use settings::{Accuracy, Counts, Mode, Noise};
pub(crate) use timing::STEPS;
pub use view_error::ViewError;
#[cfg(feature = "scene")]
pub use view_time::ViewReport;
pub use view_time::ViewTime;
pub(crate) use views::MOST_NODES;
pub(crate) use whole::{Lasting, Scan};
