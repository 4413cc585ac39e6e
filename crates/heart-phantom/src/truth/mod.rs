//! Voxelised ground truth and image quality of a reconstruction.

pub(crate) mod regions;
mod volume;

pub(crate) use regions::{BREATHS, MASK_PHASES, check_volumes, swept};
pub(crate) use volume::{
    MOST_IN_PASS, SharedShapes, alone, finder_bytes, in_pass, truth_of_gates_into, truth_of_slices,
};
