//! Projections of a beating heart, averaged over the acquisition time of each view.

mod acquisition;
mod camera;
mod counting;
mod gates;
mod groups;
mod imaging;
mod levels;
mod nodes;
mod orbit;
mod part_view;
mod project;
mod ray_geometry;
mod readout;
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
pub use camera::Camera;
pub(crate) use camera::{LEAST_DIRECTIONS, MOST_SAMPLES, VOXELS, Voxels};
pub use counting::{Counting, Decay};
pub(crate) use gates::{SharedShapes, add_to_gates};
pub(crate) use groups::MOST_NODES;
pub use imaging::Resolution;
pub(crate) use imaging::{Facing, Imaging, ImagingOptions};
pub(crate) use levels::Interpolation;
pub use orbit::Orbit;
pub use ray_geometry::RayGeometry;
pub use settings::{Accuracy, BinSample, Counts, Mode, Noise, Rotation};
pub(crate) use timing::STEPS;
pub use view_error::ViewError;
#[cfg(feature = "scene")]
pub use view_time::ViewReport;
pub use view_time::ViewTime;
pub(crate) use whole::{Lasting, Projected, Scan};
