//! Rays through solids: chords, detectors and attenuation.

pub(crate) mod assembly;
mod cast;
pub(crate) mod chord;
pub(crate) mod cone;
pub(crate) mod detector;
pub(crate) mod direction;
pub(crate) mod lines;
pub(crate) mod organ;
pub(crate) mod points;
mod project;
pub(crate) mod ray;
pub(crate) mod silhouette;
pub(crate) mod single;
pub(crate) mod slabs;
