//! Projections of a beating heart, averaged over the acquisition time of each view.

pub(crate) mod acquisition;
pub(crate) mod camera;
pub(crate) mod counting;
mod gates;
mod groups;
pub(crate) mod imaging;
mod levels;
mod nodes;
pub(crate) mod orbit;
mod part_view;
mod project;
pub(crate) mod ray_geometry;
mod readout;
pub(crate) mod settings;
mod spans;
mod states;
mod time_rule;
mod timing;
pub(crate) mod view_error;
pub(crate) mod view_time;
mod views;
mod whole;

pub(crate) use acquisition::Acquisition;
pub(crate) use camera::{LEAST_DIRECTIONS, RowsOfViews, VOXELS, Voxels};
pub(crate) use gates::add_to_gates;
pub(crate) use groups::MOST_NODES;
pub(crate) use imaging::{Facing, Imaging, ImagingOptions};
pub(crate) use levels::Interpolation;
pub(crate) use states::{GROUND_TRUTH, OF_VOXEL, shortest_side};
pub(crate) use timing::{POINTS, STEPS};
pub(crate) use view_error::Total;
pub(crate) use views::evenly;
pub(crate) use whole::{Lasting, Projected, Scan};
