//! A scene: what beats, what looks at it, what is made of it. Types, and their TOML file.

mod check;
mod check_time;
mod fault;
mod place;
mod sections;
mod template;

pub use crate::settings::{Accuracy, Counts, Mode, Noise, Output, Product};
pub(crate) use place::of_field as place_of;
pub use sections::{
    AcquisitionSettings, ActivitySettings, ArcSettings, AttenuationSettings, BackgroundSettings,
    BalloonSettings, BlurSettings, CameraSettings, CycleSettings, DefectSettings,
    DiscretisationSettings, HeartSettings, Law, MediumSettings, PixelRange, PoseSettings,
    ReconstructionSettings, RotationSettings, TruthSettings, WindowSettings,
};

use crate::error::PhantomError;
use crate::text::{shown, shown_path};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// No scene is longer; a device may be.
const MOST_BYTES: u64 = 1 << 24;

/// Everything that determines a study. [`Default`] is that of Rohmer et al. 2006, with one cycle a view.
///
/// A scene is data and computes nothing; [`Phantom`](crate::Phantom) does, when asked. Lengths in cm, times in seconds, angles
/// in degrees (in all other types they are radians), volumes in mL.
///
/// ```
/// use heart_phantom::scene::{BlurSettings, CameraSettings, Counts, Mode, Noise, Scene};
/// let camera = CameraSettings { views: 60, ..CameraSettings::default() };
/// let scene = Scene::default()
///     .with_camera(camera)
///     .with_mode(Mode::Gated { gates: 8 })
///     .with_blur(BlurSettings { fwhm: 0.8 })
///     .with_noise(Noise { counts: Counts::Total(1e6), seed: 1 });
/// // The same from a file; what is left out is the default.
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
    /// The two balloons.
    pub heart: HeartSettings,
    /// Heart rate and volume curve.
    pub cycle: CycleSettings,
    /// Where the heart stands.
    pub pose: PoseSettings,
    /// What cavity and wall hold.
    pub activity: ActivitySettings,
    /// What surrounds the heart; `None` for nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundSettings>,
    /// Pieces of the wall with another activity.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub defects: Vec<DefectSettings>,
    /// What weakens the rays; `None` for nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attenuation: Option<AttenuationSettings>,
    /// Views and detector.
    pub camera: CameraSettings,
    /// Resolution of the detector; `None` for lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blur: Option<BlurSettings>,
    /// Counts; `None` for their means.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// When the views are taken.
    pub acquisition: AcquisitionSettings,
    /// Filtered back-projection.
    pub reconstruction: ReconstructionSettings,
    /// The exact volumes.
    pub truth: TruthSettings,
    /// What `heart-phantom run` writes.
    pub output: Output,
}

impl Scene {
    /// Reads a scene and checks it; what is left out is the default.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] with line, column and field, what was given and what would be right.
    pub fn from_toml(text: &str) -> Result<Self, PhantomError> {
        Self::parse(text).map_err(|error| PhantomError::Scene(Box::new(error)))
    }

    /// Reads a scene from a file.
    ///
    /// # Errors
    /// [`PhantomError::Read`] if the file cannot be read or has more than 16 MiB; [`PhantomError::Scene`] that names the file besides.
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        Ok(Self::read(path)?.0)
    }

    /// A scene and the text that it was read from.
    pub(crate) fn read(path: &Path) -> Result<(Self, String), PhantomError> {
        let read = |path| {
            let mut bytes = Vec::new();
            let file = File::open(path)?;
            file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
            if bytes.len() as u64 > MOST_BYTES {
                return Err(io::ErrorKind::FileTooLarge.into());
            }
            Ok(bytes)
        };
        let bytes = read(path).map_err(|source| PhantomError::Read {
            path: path.to_path_buf(),
            source,
        })?;
        let parsed = match String::from_utf8(bytes) {
            Ok(text) => Self::parse(&text).map(|scene| (scene, text)),
            Err(error) => Err(place::not_text(error.as_bytes(), error.utf8_error())),
        };
        parsed.map_err(|mut error| {
            error.file = Some(path.to_path_buf());
            PhantomError::Scene(Box::new(error))
        })
    }

    /// The scene as a file with a comment on each field; [`Scene::from_toml`] gives the same scene back.
    pub fn to_toml(&self) -> String {
        template::write(self)
    }

    /// Checks a scene that was put together in Rust.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] with the field, what was given and what would be right.
    pub fn check(&self) -> Result<(), PhantomError> {
        check::scene(self).map_err(|fault| PhantomError::Scene(Box::new(fault)))
    }

    /// The same with other balloons.
    pub fn with_heart(mut self, heart: HeartSettings) -> Self {
        self.heart = heart;
        self
    }

    /// The same with another cycle.
    pub fn with_cycle(mut self, cycle: CycleSettings) -> Self {
        self.cycle = cycle;
        self
    }

    /// The same with another pose.
    pub fn with_pose(mut self, pose: PoseSettings) -> Self {
        self.pose = pose;
        self
    }

    /// The same with another activity.
    pub fn with_activity(mut self, activity: ActivitySettings) -> Self {
        self.activity = activity;
        self
    }

    /// The same with activity around the heart.
    pub fn with_background(mut self, background: BackgroundSettings) -> Self {
        self.background = Some(background);
        self
    }

    /// The same with one more piece of the wall that has another activity.
    pub fn with_defect(mut self, defect: DefectSettings) -> Self {
        self.defects.push(defect);
        self
    }

    /// The same with something that weakens the rays.
    pub fn with_attenuation(mut self, attenuation: AttenuationSettings) -> Self {
        self.attenuation = Some(attenuation);
        self
    }

    /// The same with another camera.
    pub fn with_camera(mut self, camera: CameraSettings) -> Self {
        self.camera = camera;
        self
    }

    /// The same with views taken at other times.
    pub fn with_mode(mut self, mode: Mode) -> Self {
        self.acquisition.mode = mode;
        self
    }

    /// The same with the time of the views sampled in another way.
    pub fn with_accuracy(mut self, accuracy: Accuracy) -> Self {
        self.acquisition.accuracy = accuracy;
        self
    }

    /// The same with a detector of finite resolution.
    pub fn with_blur(mut self, blur: BlurSettings) -> Self {
        self.blur = Some(blur);
        self
    }

    /// The same with counts.
    pub fn with_noise(mut self, noise: Noise) -> Self {
        self.noise = Some(noise);
        self
    }

    /// The same with another reconstruction.
    pub fn with_reconstruction(mut self, reconstruction: ReconstructionSettings) -> Self {
        self.reconstruction = reconstruction;
        self
    }

    /// The same with other exact volumes.
    pub fn with_truth(mut self, truth: TruthSettings) -> Self {
        self.truth = truth;
        self
    }

    /// The same with other results to write.
    pub fn with_output(mut self, output: Output) -> Self {
        self.output = output;
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

    fn parse(text: &str) -> Result<Self, SceneError> {
        let scene: Self = toml::from_str(text).map_err(|error| place::syntax(text, &error))?;
        check::scene(&scene).map_err(|mut fault| {
            fault.place = place::of_field(text, &fault.field);
            fault
        })?;
        Ok(scene)
    }
}

/// Where in which file, before a message.
pub(crate) fn place_in(file: Option<&Path>, place: Option<[usize; 2]>) -> String {
    match (file.map(shown_path), place) {
        (Some(file), Some([line, column])) => format!("{file}:{line}:{column}: "),
        (Some(file), None) => format!("{file}: "),
        (None, Some([line, column])) => format!("line {line}, column {column}: "),
        (None, None) => String::new(),
    }
}

/// What is wrong with a scene, and where. Shown on one line, with escapes for what a terminal would not show; what stands in the
/// file is cut where it is long.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SceneError {
    /// The file, if it came from one.
    pub file: Option<PathBuf>,
    /// Line and column, from 1; `None` for a scene without a text, or a field that its text leaves out.
    pub place: Option<[usize; 2]>,
    /// The field, such as `camera.views`, or `defects.1.s` of the first section `[[defects]]` (they count from 1, as their labels do);
    /// empty where the text is no TOML.
    // tidy: allow string: the path of a field in the file
    pub field: String,
    /// What stands there; empty where nothing does, or a name that means nothing.
    // tidy: allow string: the user's own text
    pub given: String,
    /// What would be right.
    // tidy: allow string: ranges, lists and the parser's words
    pub wanted: String,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&place_in(self.file.as_deref(), self.place))?;
        let [field, given, wanted] =
            [&self.field, &self.given, &self.wanted].map(|text| shown(text));
        match (field.as_str(), given.as_str()) {
            ("", "") => write!(f, "{wanted}"),
            ("", given) => write!(f, "`{given}`: {wanted}"),
            (field, "") => write!(f, "{field}: {wanted}"),
            (field, given) => write!(f, "{field} is {given}; {wanted}"),
        }
    }
}

impl std::error::Error for SceneError {}
