//! Solids on a grid: coverage of voxels, regions, sums of bodies, sweeps, and sets of voxels.

pub(crate) mod block;
mod bodies;
pub(crate) mod breaks;
pub(crate) mod coverage;
pub(crate) mod disc;
pub(crate) mod field;
pub(crate) mod grid;
pub(crate) mod mask;
pub(crate) mod mirror;
pub(crate) mod organ_map;
pub(crate) mod patch;
pub(crate) mod plane_clip;
pub(crate) mod profile;
pub(crate) mod regions;
pub(crate) mod runs;
pub(crate) mod sections;
pub(crate) mod square;
pub(crate) mod sweep;
pub(crate) mod wedge_cut;
