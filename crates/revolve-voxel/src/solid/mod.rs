//! Solids of revolution: meridians, measures, distances, bodies of layers and their poses.

pub(crate) mod body;
pub(crate) mod box_tree;
pub(crate) mod chains;
pub(crate) mod curve;
pub(crate) mod distance;
pub(crate) mod mass_properties;
pub(crate) mod meridian;
pub(crate) mod mesh;
pub(crate) mod pieces;
pub(crate) mod pose;
pub(crate) mod segment;
pub(crate) mod self_crossing;
pub(crate) mod series;
pub(crate) mod simplified;
pub(crate) mod wedge;
