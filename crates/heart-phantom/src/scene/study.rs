//! A scene as data.

use super::motion::{PointSettings, TwistSettings};
use super::sections::{
    AcquisitionSettings, BlurSettings, CameraSettings, CollimatorSettings, CycleSettings,
    HeartSettings, OrganSettings, PoseSettings, ReconstructionSettings, TruthSettings,
};
use crate::{
    Activity, Attenuation, Background, Beats, Breathing, Chest, Counting, Defect, Medium, Mode,
    Noise, Output,
};
#[cfg(feature = "scene")]
use serde::{Deserialize, Serialize};

/// Everything that determines a study. [`Default`] is that of Rohmer et al. 2006, with one cycle a view.
///
/// A scene is data and computes nothing; [`Phantom`](crate::Phantom) does, when asked. Lengths in cm, times in seconds, angles
/// in degrees (in all other types they are radians), volumes in mL.
///
/// ```
/// use heart_phantom::scene::{BlurSettings, Counts, Mode, Noise, Scene};
/// let mut scene = Scene::default().with_mode(Mode::Gated { gates: 8 });
/// scene.camera.views = 60;
/// scene.blur = Some(BlurSettings { fwhm: 0.8 });
/// scene.noise = Some(Noise { counts: Counts::Total(1e6), seed: 1 });
/// // The same from a file; what is left out is the default.
/// let text = "[camera]\nviews = 60\n[blur]\nfwhm = 0.8\n[noise]\ncounts = { total = 1e6 }\nseed = 1\n\
///     [acquisition]\nmode = { gated = { gates = 8 } }\n";
/// assert_eq!(Scene::from_toml(text)?, scene);
/// assert_eq!(Scene::from_toml(&scene.to_toml())?, scene);
/// let error = Scene::from_toml("[camera]\nviews = -3\n").unwrap_err();
/// assert!(error.to_string().starts_with("line 2, column 9: camera.views"));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct Scene {
    /// The two balloons.
    pub heart: HeartSettings,
    /// Heart rate and volume curve.
    pub cycle: CycleSettings,
    /// Beats that differ in length; `None` for a regular beat.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub beats: Option<Beats>,
    /// Where the heart stands.
    pub pose: PoseSettings,
    /// How it moves with the breath; `None` for a breath that is held.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub breathing: Option<Breathing>,
    /// What cavity and wall hold.
    pub activity: Activity,
    /// What surrounds the heart; `None` for nothing.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub background: Option<Background>,
    /// Trunk, lungs, liver and spine of an adult around the heart, before all other organs.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub chest: Option<Chest>,
    /// What is around the heart, in the place of a background: each replaces those before it.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub organs: Vec<OrganSettings>,
    /// Pieces of the wall with another activity.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub defects: Vec<Defect>,
    /// How the wall is twisted at end-systole; `None` for a wall that is not.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub twist: Option<TwistSettings>,
    /// Material points whose motion the report has.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub points: Vec<PointSettings>,
    /// What weakens the rays; `None` for nothing.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub attenuation: Option<Attenuation>,
    /// Views and detector.
    pub camera: CameraSettings,
    /// Resolution of the detector; `None` for lines.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub blur: Option<BlurSettings>,
    /// Resolution that depends on depth; `None` for lines.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub collimator: Option<CollimatorSettings>,
    /// Counts; `None` for their means.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub noise: Option<Noise>,
    /// What a sample is in counts; `None` if that is not known.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub counting: Option<Counting>,
    /// When the views are taken.
    pub acquisition: AcquisitionSettings,
    /// Volumes from views.
    pub reconstruction: ReconstructionSettings,
    /// The exact volumes.
    pub truth: TruthSettings,
    /// What `heart-phantom run` writes.
    pub output: Output,
}

impl Scene {
    /// What the heart attenuates: in a chest as soft tissue does, if nothing else is said.
    pub(super) fn attenuates(&self) -> Option<Attenuation> {
        let soft = Attenuation {
            coefficient: Chest::SOFT_TISSUE,
            medium: Medium::Heart,
        };
        self.attenuation.or(self.chest.map(|_| soft))
    }

    /// The same with views taken at other times.
    pub fn with_mode(mut self, mode: Mode) -> Self {
        self.acquisition.mode = mode;
        self
    }

    /// The same with `n` bins, rows and pixels a side in the same field of view.
    pub fn with_size(mut self, n: usize) -> Self {
        let field = self.camera.bins as f64 * self.camera.pitch[0];
        self.camera.bins = n;
        self.camera.rows = n;
        self.camera.pitch = [field / n as f64; 2];
        self.reconstruction.pixels = None;
        self.reconstruction.pixel = None;
        self
    }
}
