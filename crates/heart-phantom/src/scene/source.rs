//! Errors after validation, attributed to a field of the scene.

#[cfg(feature = "scene")]
use super::place;
use crate::Phantom;
use crate::error::PhantomError;
use crate::scan::VOXELS;

impl Phantom {
    /// Attributes an error to a field of the scene, if possible.
    pub(crate) fn refused(&self, error: PhantomError) -> PhantomError {
        let field = match &error {
            PhantomError::Uncovered { .. } => "background.semi_axes".to_owned(),
            PhantomError::NoMaterial { .. } if self.scene().defects.is_empty() => {
                "heart".to_owned()
            }
            PhantomError::NoMaterial { .. } => "defects".to_owned(),
            PhantomError::NoDefect { defect, .. } => format!("defects.{}", defect + 1),
            PhantomError::Crossed { .. } | PhantomError::Balloon(_) => "heart".to_owned(),
            PhantomError::Membrane(_) => "cycle.volume".to_owned(),
            PhantomError::Tolerance { .. } => "acquisition.accuracy.tolerance".to_owned(),
            PhantomError::Radon(radon::RadonError::ShortArc { .. }) => "camera.arc".to_owned(),
            PhantomError::Radon(_) => "reconstruction".to_owned(),
            // The reconstruction model of a contour orbit.
            PhantomError::OutOfRange { what, .. } if *what == VOXELS => {
                "reconstruction.method".to_owned()
            }
            PhantomError::OutOfRange { what, .. } if what.contains("collimator's blur") => {
                "collimator".to_owned()
            }
            PhantomError::Scatter(_) => "scatter".to_owned(),
            PhantomError::Memory { .. } => "camera".to_owned(),
            PhantomError::Uneven { .. } => "collimator".to_owned(),
            PhantomError::DetectorInside { .. } => "camera.radius".to_owned(),
            PhantomError::NoCounts => "noise.counts.total".to_owned(),
            PhantomError::SourceInside { .. } => "camera.geometry".to_owned(),
            PhantomError::NotMeshed { .. } => "output.mesh_tolerance".to_owned(),
            PhantomError::Solid(_) => "heart".to_owned(),
            _ => return error,
        };
        #[cfg(feature = "scene")]
        let (file, place) = match &self.file {
            Some((path, text)) => (Some(path.clone()), place::of_field(text, &field)),
            None => (None, None),
        };
        #[cfg(not(feature = "scene"))]
        let (file, place) = (None, None);
        PhantomError::Rejected {
            file,
            place,
            field,
            source: Box::new(error),
        }
    }
}
