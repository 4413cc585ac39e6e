//! Where a phantom comes from: a scene, of a file as a rule.

use super::place;
use super::study::Scene;
use crate::error::PhantomError;
use crate::scan::VOXELS;
use std::path::PathBuf;

/// The scene that a phantom was made from.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) scene: Scene,
    /// The file and its text, for errors that are found after it was read.
    pub(crate) file: Option<(PathBuf, String)>,
}

impl Source {
    /// An error that a field of the scene can be blamed for.
    pub(crate) fn refused(&self, error: PhantomError) -> PhantomError {
        let field = match &error {
            PhantomError::Uncovered { .. } => "background.semi_axes".to_owned(),
            PhantomError::NoMaterial { .. } if self.scene.defects.is_empty() => "heart".to_owned(),
            PhantomError::NoMaterial { .. } => "defects".to_owned(),
            PhantomError::NoDefect { defect, .. } => format!("defects.{}", defect + 1),
            PhantomError::Crossed { .. } | PhantomError::Balloon(_) => "heart".to_owned(),
            PhantomError::Membrane(_) => "cycle.volume".to_owned(),
            PhantomError::Quadrature { .. } => "acquisition.accuracy.tolerance".to_owned(),
            PhantomError::Radon(radon::RadonError::ShortArc { .. }) => "camera.arc".to_owned(),
            PhantomError::Radon(_) => "reconstruction".to_owned(),
            // Those of the scene were checked; a model has more.
            PhantomError::OutOfRange { what, .. } if *what == VOXELS => {
                "reconstruction.method".to_owned()
            }
            PhantomError::BinMeans { .. } => "camera.samples".to_owned(),
            PhantomError::DetectorInside { .. } => "camera.radius".to_owned(),
            PhantomError::NothingToCount => "noise.counts.total".to_owned(),
            PhantomError::NotBuilt { what, .. } => match &self.scene.output {
                output if *what == output.volumes.info().name => "output.volumes".to_owned(),
                output if *what == output.projections.info().name => {
                    "output.projections".to_owned()
                }
                _ => "output.write".to_owned(),
            },
            PhantomError::NotMeshed { .. } => "output.mesh_tolerance".to_owned(),
            PhantomError::Solid(_) => "heart".to_owned(),
            _ => return error,
        };
        let (path, text) = self
            .file
            .as_ref()
            .map(|(path, text)| (path.clone(), text))
            .unzip();
        PhantomError::Refused {
            file: path,
            place: text.and_then(|text| place::of_field(text, &field)),
            field,
            source: Box::new(error),
        }
    }
}
