//! Phantoms of scenes.

use super::Phantom;
use crate::error::PhantomError;
use crate::scene::{Scene, Source};
use std::path::{Path, PathBuf};

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
            PhantomError::NotBuilt { .. } | PhantomError::OutOfRange { .. } => {
                source.refused(error)
            }
            error => error,
        })?;
        phantom.source = Some(source);
        Ok(phantom)
    }
}
