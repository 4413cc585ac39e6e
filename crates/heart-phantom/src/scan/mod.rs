//! What the camera sees, and when: views of a beating heart, each the mean over the time that it sees.

mod acquire;
mod acquisition;
mod bin_sample;
mod camera;
mod counting;
mod depth;
mod gates;
mod halves;
mod levels;
mod nodes;
mod orbit;
mod product;
mod project;
mod quadrature;
mod readout;
mod settings;
mod spans;
mod timing;
mod total;
mod view_time;
mod views;
mod whole;
mod wide;

pub use acquire::acquire;
pub use acquisition::{Acquisition, Sinograms, TruthOf};
pub use bin_sample::BinSample;
pub(crate) use bin_sample::lattice;
pub use camera::{Camera, CameraGeometry, Heads, Rotation};
pub(crate) use camera::{MOST_SAMPLES, VOXELS};
pub use counting::{Counting, Decay};
pub use depth::Collimation;
pub(crate) use depth::{Depth, Facing};
pub(crate) use gates::{SharedShapes, add_to_gates};
pub use orbit::Orbit;
pub(crate) use readout::Readout;
pub use settings::{Accuracy, Counts, Mode, Noise};
pub(crate) use timing::STEPS;
#[cfg(feature = "scene")]
pub use view_time::ViewReport;
pub use view_time::ViewTime;
pub(crate) use views::MOST_NODES;
pub(crate) use whole::{Lasting, Scan};
pub(crate) use wide::Wide;
