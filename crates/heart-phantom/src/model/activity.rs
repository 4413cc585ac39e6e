//! Activity of cavity, wall and background: a concentration, or a conserved total.

use crate::HeartShape;
use crate::error::PhantomError;
use crate::scene::exactly;
use nalgebra::Point3;
use revolve_voxel::{Organ, OrganShape, Pose};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The activity of a region.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Uptake {
    /// Activity per cm^3, the same at every phase; the total is proportional to the volume.
    Concentration(f64),
    /// Total activity of the region, conserved; the concentration is inversely proportional to the volume.
    Total(f64),
}

impl Uptake {
    /// Returns the activity per cm^3 of a region of the given volume; 0 without volume.
    #[must_use]
    pub fn concentration(&self, volume: f64) -> f64 {
        match *self {
            Self::Concentration(concentration) => concentration,
            Self::Total(total) if volume > 0.0 => total / volume,
            Self::Total(_) => 0.0,
        }
    }
}

/// `[background]`: activity around the heart, in an elliptic cylinder along z, without ends, that contains the heart at every phase.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Background {
    /// Activity per cm^3.
    pub concentration: f64,
    /// Axis of the cylinder, `[x, y]` in cm.
    #[serde(deserialize_with = "exactly")]
    pub centre: [f64; 2],
    /// Semi-axes along x and y in cm.
    #[serde(deserialize_with = "exactly")]
    pub semi_axes: [f64; 2],
}

impl Background {
    /// Returns it as an organ.
    pub(crate) fn organ(&self) -> Result<Organ, PhantomError> {
        Ok(Organ {
            shape: OrganShape::cylinder(self.centre, self.semi_axes)?,
            activity: self.concentration,
            attenuation: 0.0,
        })
    }

    /// Whether the cylinder contains a box.
    fn holds(&self, [low, high]: &[Point3<f64>; 2]) -> bool {
        let farthest = [0, 1].map(|k| {
            let [from, to] = [low, high].map(|corner| (corner[k] - self.centre[k]).abs());
            from.max(to) / self.semi_axes[k]
        });
        farthest[0].hypot(farthest[1]) < 1.0
    }

    /// Returns whether the background contains all shapes in a pose.
    pub(crate) fn check_surrounds(
        &self,
        shapes: &[Arc<HeartShape>],
        pose: Pose,
    ) -> Result<(), PhantomError> {
        if self.concentration == 0.0 {
            return Ok(());
        }
        let torso = self.organ()?.shape;
        let distinct: BTreeMap<u64, &Arc<HeartShape>> = (shapes.iter())
            .map(|shape| (shape.gain().to_bits(), shape))
            .collect();
        distinct.into_values().try_for_each(|shape| {
            let body = shape.body().with_pose(pose);
            let boxes = (0..body.layers().len()).map(|layer| body.bounding_box(layer));
            if boxes
                .collect::<Result<Vec<_>, _>>()?
                .iter()
                .all(|own| self.holds(own))
            {
                return Ok(());
            }
            let (gain, times) = (shape.gain(), torso.scale_to_contain(&body));
            match times < 1.0 {
                true => Ok(()),
                false => Err(PhantomError::Uncovered { gain, times }),
            }
        })
    }
}

/// Activity of the cavity and of the wall; by default 1 per cm^3 in the wall only.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Activity {
    /// Activity of the cavity.
    pub cavity: Uptake,
    /// Activity of the wall, before defects are applied.
    pub wall: Uptake,
}

impl Default for Activity {
    fn default() -> Self {
        [0.0, 1.0].into()
    }
}

impl Activity {
    /// Concentrations of cavity and wall in a shape.
    #[must_use]
    pub fn of(&self, shape: &HeartShape) -> [f64; 2] {
        let [inner, outer] = shape.volumes();
        [
            self.cavity.concentration(inner),
            self.wall.concentration(outer - inner),
        ]
    }
}

impl From<[f64; 2]> for Activity {
    /// Concentrations of cavity and wall.
    fn from([cavity, wall]: [f64; 2]) -> Self {
        Self {
            cavity: Uptake::Concentration(cavity),
            wall: Uptake::Concentration(wall),
        }
    }
}
