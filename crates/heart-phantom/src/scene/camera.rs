//! The section `[camera]` of a scene.

use super::file::exactly;
use crate::{BinSample, Orbit, Rotation};
use serde::{Deserialize, Serialize};

/// The heads of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum HeadsSettings {
    /// One head.
    One,
    /// Two heads at a fixed angle that acquire simultaneously.
    Two {
        /// Angle from the first to the second, degrees.
        angle: f64,
    },
}

impl HeadsSettings {
    /// Returns the number of heads.
    pub(crate) fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two { .. } => 2,
        }
    }

    /// Returns the angle from the first to the last head, degrees.
    pub(crate) fn angle(self) -> f64 {
        match self {
            Self::One => 0.0,
            Self::Two { angle } => angle,
        }
    }
}

/// The rays of a view, `camera.geometry` of a scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum BeamSettings {
    /// Parallel rays.
    #[default]
    Parallel,
    /// A focal line along z opposite a flat detector ([`RayGeometry::fan`](crate::RayGeometry::fan)).
    Fan {
        /// Distance from the focal line to the axis of rotation, cm.
        source_to_isocentre: f64,
        /// Distance from the focal line to the detector, cm.
        source_to_detector: f64,
    },
    /// A source opposite a flat detector ([`RayGeometry::cone`](crate::RayGeometry::cone)).
    Cone {
        /// Distance from the source to the axis of rotation, cm.
        source_to_isocentre: f64,
        /// Distance from the source to the detector, cm.
        source_to_detector: f64,
    },
    /// A JSON file with an array of one 3 x 4 matrix (three arrays of four numbers) per view ([`RayGeometry::from_matrices`](crate::RayGeometry::from_matrices)); a relative
    /// path of a scene that was loaded from a file is relative to the directory of that file.
    // tidy: allow string: a path, as the user writes it
    Matrices(String),
}

/// `[camera]`: geometry and detector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSettings {
    /// Number of views per head.
    pub views: usize,
    /// Arc of a head in degrees, counter-clockwise seen from +z if positive.
    pub arc: f64,
    /// Angle of the first view in degrees.
    pub start: f64,
    /// The heads.
    pub heads: HeadsSettings,
    /// Bins per row.
    pub bins: usize,
    /// Rows, one per slice.
    pub rows: usize,
    /// Pitch of bins and of rows in cm.
    #[serde(deserialize_with = "exactly")]
    pub pitch: [f64; 2],
    /// The definition of a sample; `None` gives bin averages with `[blur]` or `[collimator]`, line integrals otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<BinSample>,
    /// Parallel rays, or the distances of a fan or cone beam, or projection matrices.
    pub geometry: BeamSettings,
    /// Motion between views: step and shoot or continuous.
    pub rotation: Rotation,
    /// Seconds between the starts of consecutive views; step and shoot moves instantaneously.
    pub seconds_per_view: f64,
    /// Distance of the collimator face from the axis in each view, used by `[collimator]` and written to files.
    pub radius: Orbit,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            views: 90,
            arc: 180.0,
            start: 0.0,
            heads: HeadsSettings::One,
            bins: 256,
            rows: 256,
            pitch: [0.0625; 2],
            samples: None,
            geometry: BeamSettings::Parallel,
            rotation: Rotation::StepAndShoot,
            seconds_per_view: 1.0,
            radius: Orbit::Circle(20.0),
        }
    }
}

impl CameraSettings {
    /// Reads a relative path of matrices from the directory of the scene.
    pub(super) fn relative_to(&mut self, directory: &std::path::Path) {
        if let BeamSettings::Matrices(file) = &mut self.geometry {
            *file = directory.join(&*file).to_string_lossy().into_owned();
        }
    }
}
