//! The rays of a scene that are not parallel.

use super::bytes::read_bytes;
use super::{BeamSettings, CameraSettings};
use crate::RayGeometry;
use crate::error::{PhantomError, check_length};
use revolve_voxel::ParallelDetector;
use std::path::Path;

/// Returns the rays of a camera with its view angles; `None` if they are parallel.
pub(super) fn rays_of(
    camera: &CameraSettings,
    angles: &[f64],
) -> Result<Option<RayGeometry>, PhantomError> {
    let detector = ParallelDetector::new(camera.bins, camera.rows, camera.pitch)?;
    Ok(Some(match &camera.geometry {
        BeamSettings::Parallel => return Ok(None),
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
                camera.views,
            )?;
            RayGeometry::from_matrices(&matrices, detector)?
        }
    }))
}

fn read(path: &Path) -> Result<Vec<[[f64; 4]; 3]>, PhantomError> {
    let bytes = read_bytes(path)?;
    serde_json::from_slice(&bytes).map_err(|error| PhantomError::Read {
        path: path.to_path_buf(),
        source: error.into(),
    })
}
