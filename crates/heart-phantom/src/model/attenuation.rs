//! Attenuation between the heart and the detector.

use crate::scene::exactly;
use revolve_voxel::{Organ, OrganShape};

/// `[attenuation]`: a uniform medium.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attenuation {
    /// Attenuation coefficient of the medium in 1/cm.
    pub coefficient: f64,
    /// The medium.
    pub medium: Medium,
}

/// The attenuating volume.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Medium {
    /// Cavity and wall; organs have their own coefficients.
    Heart,
    /// A stationary, infinite elliptic cylinder along z.
    Torso {
        /// Position of the axis, `[x, y]` in cm.
        #[serde(deserialize_with = "exactly")]
        centre: [f64; 2],
        /// Semi-axes along x and y in cm.
        #[serde(deserialize_with = "exactly")]
        semi_axes: [f64; 2],
    },
}

impl Attenuation {
    /// Returns the torso of a validated scene as an organ; `None` if the heart attenuates.
    pub(crate) fn torso(&self) -> Option<Organ> {
        match self.medium {
            Medium::Heart => None,
            Medium::Torso { centre, semi_axes } => Some(Organ {
                shape: OrganShape::cylinder(centre, semi_axes).ok()?,
                activity: 0.0,
                attenuation: self.coefficient,
            }),
        }
    }
}
