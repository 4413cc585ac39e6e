//! The scene.

use super::camera::CameraSettings;
use super::motion::PointSettings;
use super::sections::{
    AcquisitionSettings, BlurSettings, CollimatorSettings, CycleSettings, HeartSettings,
    OrganSettings, PoseSettings, ReconstructionSettings, ScatterSettings, TruthSettings,
};
use crate::{
    Activity, Attenuation, Background, Beats, Breathing, Chest, Counting, Defect, Medium, Mode,
    Noise, Output, Twist,
};
use serde::{Deserialize, Serialize};

/// The complete description of a study. [`Default`] is that of Rohmer et al. 2006, with projections averaged over one cycle.
///
/// A scene is data; [`Phantom`](crate::Phantom) computes. Lengths in cm, times in seconds, volumes in mL, angles in degrees (all other
/// types use radians).
///
/// ```
/// use heart_phantom::scene::BlurSettings;
/// use heart_phantom::{Counts, Mode, Noise, Scene};
/// let mut scene = Scene::default().with_mode(Mode::Gated { gates: 8 });
/// scene.camera.views = 60;
/// scene.blur = Some(BlurSettings { fwhm: 0.8 });
/// scene.noise = Some(Noise { counts: Counts::Total(1e6), seed: 1 });
/// // The same from a file; omitted fields have their defaults.
/// let text = "[camera]\nviews = 60\n[blur]\nfwhm = 0.8\n[noise]\ncounts = { total = 1e6 }\nseed = 1\n\
///     [acquisition]\nmode = { gated = { gates = 8 } }\n";
/// assert_eq!(Scene::from_toml(text)?, scene);
/// assert_eq!(Scene::from_toml(&scene.to_toml())?, scene);
/// let error = Scene::from_toml("[camera]\nviews = -3\n").unwrap_err();
/// assert!(error.to_string().starts_with("line 2, column 9: camera.views"));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// The two membranes.
    pub heart: HeartSettings,
    /// Heart rate and volume curve.
    pub cycle: CycleSettings,
    /// Variable R-R intervals; `None` for regular beats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beats: Option<Beats>,
    /// Position and orientation of the heart.
    pub pose: PoseSettings,
    /// Respiratory motion of the heart; `None` for a breath-hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub breathing: Option<Breathing>,
    /// Activity of cavity and wall.
    pub activity: Activity,
    /// Torso around the heart; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<Background>,
    /// Torso, lungs, liver and spine of an adult, before all other organs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chest: Option<Chest>,
    /// Organs around the heart, instead of a background; each replaces earlier ones.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub organs: Vec<OrganSettings>,
    /// Parts of the wall with another activity.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub defects: Vec<Defect>,
    /// Twist of the wall at end-systole; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twist: Option<Twist>,
    /// Material points whose motion is reported.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointSettings>,
    /// Attenuation; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attenuation: Option<Attenuation>,
    /// Geometry and detector.
    pub camera: CameraSettings,
    /// Depth-independent resolution of the detector; `None` for perfect resolution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blur: Option<BlurSettings>,
    /// Depth-dependent resolution; `None` for perfect resolution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collimator: Option<CollimatorSettings>,
    /// Scattered photons in the projections; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatter: Option<ScatterSettings>,
    /// Poisson noise; `None` gives expected values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Calibration from samples to counts; `None` if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counting: Option<Counting>,
    /// Timing of the projections.
    pub acquisition: AcquisitionSettings,
    /// Volumes from projections.
    pub reconstruction: ReconstructionSettings,
    /// Voxelised ground truth.
    pub truth: TruthSettings,
    /// The output of `heart-phantom run`.
    pub output: Output,
}

impl Scene {
    /// Returns the attenuation; that of soft tissue by default in a chest.
    pub(crate) fn attenuates(&self) -> Option<Attenuation> {
        let soft = Attenuation {
            coefficient: Chest::SOFT_TISSUE,
            medium: Medium::Heart,
        };
        self.attenuation.or(self.chest.map(|_| soft))
    }

    /// Whether the detector has a response, of constant width or that of a collimator.
    pub(crate) fn has_response(&self) -> bool {
        self.collimator.is_some() || self.blur.is_some()
    }

    /// Replaces the acquisition mode.
    #[must_use]
    pub fn with_mode(mut self, mode: Mode) -> Self {
        self.acquisition.mode = mode;
        self
    }

    /// Sets bins and rows to `n`, and the pitch of both so that rows keep their length; a different pitch of the rows is replaced.
    /// Removes `reconstruction.pixels` and `reconstruction.pixel`: slices then have `n` by `n` pixels of that pitch.
    #[must_use]
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
