//! Errors after validation, attributed to a field of the scene.

use super::place;
use crate::Phantom;
use crate::error::PhantomError;
use crate::model::MESH_VOLUME;
use crate::scan::{GROUND_TRUTH, VOXELS};

impl Phantom {
    /// Attributes an error to a field of the scene, if possible.
    pub(crate) fn refused(&self, error: PhantomError) -> PhantomError {
        let has_defects = !self.scene().defects.is_empty();
        let section = match &error {
            PhantomError::Uncovered { .. } => "background.semi_axes",
            PhantomError::NoMaterial { .. } if has_defects => "defects",
            PhantomError::NoDefect { .. } => "defects",
            PhantomError::NoMaterial { .. }
            | PhantomError::Crossed { .. }
            | PhantomError::Balloon(_)
            | PhantomError::Solid(_) => "heart",
            PhantomError::Membrane(_) => "cycle.volume",
            PhantomError::Tolerance { term, .. } if *term == GROUND_TRUTH => "truth.tolerance",
            PhantomError::Tolerance { term, .. } if *term == MESH_VOLUME => "output.mesh_tolerance",
            PhantomError::Tolerance { .. } => "acquisition.accuracy.tolerance",
            PhantomError::Radon(radon::RadonError::ShortArc { .. }) => "camera.arc",
            PhantomError::Radon(_) => "reconstruction",
            // The reconstruction model of a contour orbit.
            PhantomError::OutOfRange { what, .. } if *what == VOXELS => "reconstruction.method",
            PhantomError::OutOfRange { what, .. } if what.contains("collimator's blur") => {
                "collimator"
            }
            PhantomError::Scatter(_) => "scatter",
            PhantomError::Memory { .. } => "camera",
            PhantomError::DetectorInside { .. } => "camera.radius",
            PhantomError::NoCounts => "noise.counts.total",
            PhantomError::SourceInside { .. } => "camera.geometry",
            _ => return error,
        };
        let field = match &error {
            PhantomError::NoDefect { defect, .. } => format!("{section}.{}", defect + 1),
            _ => section.to_owned(),
        };
        let (file, place) = match &self.file {
            Some((path, text)) => (Some(path.clone()), place::of_field(text, &field)),
            None => (None, None),
        };
        PhantomError::Rejected {
            file,
            place,
            field,
            source: Box::new(error),
        }
    }
}
