//! Where a phantom comes from: a scene, of a file as a rule.

use crate::Phantom;
use crate::error::PhantomError;
use crate::scene::{Scene, place_of};
use std::path::{Path, PathBuf};

/// The scene that a phantom was made from.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) scene: Scene,
    /// The file and its text, for errors that are found after it was read.
    file: Option<(PathBuf, String)>,
}

impl Phantom {
    /// Checks the scene and makes ready; no shape is solved, no ray cast.
    ///
    /// # Errors
    /// [`PhantomError::Scene`]; [`PhantomError::Membrane`] if the discretised balloons make no pair; [`PhantomError::Refused`] for an
    /// output of the feature `files` in a build without it.
    #[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
    pub fn new(scene: Scene) -> Result<Self, PhantomError> {
        Self::of_scene(scene, None)
    }

    /// The phantom of a scene file.
    ///
    /// # Errors
    /// As [`Scene::load`] and [`Phantom::new`].
    #[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        let (scene, text) = Scene::read(path)?;
        Self::of_scene(scene, Some((path.to_path_buf(), text)))
    }

    fn of_scene(scene: Scene, file: Option<(PathBuf, String)>) -> Result<Self, PhantomError> {
        let parts = scene.parts()?;
        let source = Source { scene, file };
        let mut phantom = Self::from_parts(parts).map_err(|error| match error {
            PhantomError::NotBuilt { .. } => source.refused(error),
            error => error,
        })?;
        phantom.source = Some(source);
        Ok(phantom)
    }
}

impl Source {
    /// An error that a field of the scene can be blamed for.
    pub(crate) fn refused(&self, error: PhantomError) -> PhantomError {
        let field = match &error {
            PhantomError::Uncovered { .. } => "background.semi_axes".to_owned(),
            PhantomError::NoMaterial { .. } => "defects".to_owned(),
            PhantomError::NoDefect { defect, .. } => format!("defects.{}", defect + 1),
            PhantomError::Crossed { .. } | PhantomError::Balloon(_) => "heart".to_owned(),
            PhantomError::Membrane(_) => "cycle.volume".to_owned(),
            PhantomError::Quadrature { .. } => "acquisition.accuracy.tolerance".to_owned(),
            PhantomError::Radon(radon::RadonError::ShortArc { .. }) => "camera.arc".to_owned(),
            PhantomError::Radon(_) => "reconstruction".to_owned(),
            PhantomError::NothingToCount => "noise.counts.total".to_owned(),
            PhantomError::NotBuilt { what, .. } => match &self.scene.output {
                output if *what == output.volumes.name() => "output.volumes".to_owned(),
                output if *what == output.projections.name() => "output.projections".to_owned(),
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
            place: text.and_then(|text| place_of(text, &field)),
            field,
            source: Box::new(error),
        }
    }
}
