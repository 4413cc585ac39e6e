//! The rays of a scene that are not parallel.

use super::bytes::read_bytes;
use super::{BeamSettings, Scene};
use crate::error::{PhantomError, check_length};
use crate::{Camera, RayGeometry};
use std::path::Path;

/// Returns a camera with the rays of its scene.
pub(super) fn with_rays(scene: &Scene, camera: Camera) -> Result<Camera, PhantomError> {
    let (detector, angles) = (*camera.detector(), camera.geometry().angles());
    let rays = match &scene.camera.geometry {
        BeamSettings::Parallel => return Ok(camera),
        BeamSettings::Fan {
            source_to_isocentre,
            source_to_detector,
        } => {
            let distances = [*source_to_isocentre, *source_to_detector];
            RayGeometry::fan(distances, angles, detector)?
        }
        BeamSettings::Cone {
            source_to_isocentre,
            source_to_detector,
        } => {
            let distances = [*source_to_isocentre, *source_to_detector];
            RayGeometry::cone(distances, angles, detector)?
        }
        BeamSettings::Matrices(file) => {
            let matrices = read(Path::new(file))?;
            check_length(
                "projection matrices, one per view",
                matrices.len(),
                scene.camera.views,
            )?;
            RayGeometry::from_matrices(&matrices, detector)?
        }
    };
    camera.along(rays)
}

fn read(path: &Path) -> Result<Vec<[[f64; 4]; 3]>, PhantomError> {
    let bytes = read_bytes(path)?;
    serde_json::from_slice(&bytes).map_err(|error| PhantomError::Read {
        path: path.to_path_buf(),
        source: error.into(),
    })
}
