//! The wall between two curves: material coordinates, thickness, and sectors.

pub(crate) mod body_line;
pub(crate) mod cells;
pub(crate) mod isoline;
pub(crate) mod locate;
pub(crate) mod nearest;
pub(crate) mod root;
pub(crate) mod sector;
pub(crate) mod sector_voxels;
pub(crate) mod shares;
pub(crate) mod shell;
pub(crate) mod thickness;
pub(crate) mod twist;
