//! The model of the heart: membranes, wall, volume over the cycle, activity, and surroundings.

pub(crate) mod activity;
mod around;
pub(crate) mod attenuation;
mod base;
pub(crate) mod breathing;
pub(crate) mod chest;
pub(crate) mod cycle;
pub(crate) mod defect;
pub(crate) mod heart;
pub(crate) mod material;
pub(crate) mod rhythm;
pub(crate) mod shape;
mod shape_cache;
pub(crate) mod strain;
mod surroundings;
pub(crate) mod twist;
mod velocity;
pub(crate) mod volume_curve;

pub(crate) use around::Reach;
pub(crate) use breathing::RespiratoryMotion;
pub(crate) use cycle::wrap;
pub(crate) use defect::{Placed, bytes_of_defects, without_overlap};
pub(crate) use rhythm::Rhythm;
pub(crate) use shape::MESH_VOLUME;
pub(crate) use surroundings::Surroundings;
pub(crate) use volume_curve::Height;
