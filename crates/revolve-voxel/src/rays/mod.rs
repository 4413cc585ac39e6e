//! Rays through solids: chords, detectors and attenuation.

mod around;
pub(crate) mod attenuation;
pub(crate) mod capsule;
pub(crate) mod chord;
pub(crate) mod cone;
pub(crate) mod cylinder;
pub(crate) mod detector;
pub(crate) mod direction;
pub(crate) mod organ;
mod project;
pub(crate) mod ray;
pub(crate) mod silhouette;
pub(crate) mod single;
pub(crate) mod slabs;
pub(crate) mod torso;
