//! What the voxels really hold, and how a reconstruction compares with it.

mod regions;
mod volume;

pub(crate) use regions::{BREATHS, MASK_PHASES, swept};
pub use regions::{Measures, Regions};
pub(crate) use volume::{
    MOST_IN_PASS, finder_bytes, in_pass, truth_of_gates_into, truth_of_slices,
};
