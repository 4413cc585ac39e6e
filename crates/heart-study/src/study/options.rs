//! Options of the study, which are also the arguments of `heart-phantom paper`.

use clap::{ArgAction, Args};
use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{PhantomError, Scene, VolumeRange, check_count, check_value};
use serde::Serialize;

/// Options of the study. The default study takes some seconds on two cores and 350 MB of memory.
///
/// ```
/// let mut small = heart_study::StudyOptions::default();
/// (small.size, small.views) = (16, 8);
/// assert_eq!(small.nodes, 801);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Args)]
#[non_exhaustive]
pub struct StudyOptions {
    /// Voxels along an edge of the volume of 16 cm; bins and rows of the camera: 8 to 1024.
    #[arg(long, default_value_t = Self::default().size, allow_negative_numbers = true)]
    pub size: usize,
    /// Number of views over 180 degrees: 3 to 10000.
    #[arg(long, default_value_t = Self::default().views, allow_negative_numbers = true)]
    pub views: usize,
    /// Largest volume gain of the cavity, 0 to 2 (0.6 is an ejection fraction of 0.375).
    #[arg(long, default_value_t = Self::default().gain, allow_hyphen_values = true)]
    pub gain: f64,
    /// Heart rate in beats per minute: 1 to 1000.
    #[arg(long = "bpm", value_name = "BPM", default_value_t = Self::default().beats_per_minute, allow_hyphen_values = true)]
    pub beats_per_minute: f64,
    /// Nodes per membrane: 11 to 100001.
    #[arg(long, default_value_t = Self::default().nodes, allow_negative_numbers = true)]
    pub nodes: usize,
    /// Whether to draw the figures.
    #[arg(long = "no-figures", action = ArgAction::SetFalse, help = "Omit the figures (numbers, sinograms and volumes are written)")]
    pub figures: bool,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            size: 256,
            views: 90,
            gain: 0.6,
            beats_per_minute: 65.0,
            nodes: 801,
            figures: true,
        }
    }
}

impl StudyOptions {
    /// The scene of the three acquisitions: [`Scene::default`] with the size and accuracy of the options.
    pub(super) fn scene(&self) -> Scene {
        let mut scene = Scene::default().with_size(self.size);
        scene.camera.views = self.views;
        scene.cycle.beats_per_minute = self.beats_per_minute;
        scene.cycle.volume = VolumeRange::Gain(self.gain);
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: self.nodes };
        scene
    }

    /// Limits: memory (a volume of 1024^3 samples is 4 GiB) and valid ranges.
    pub(super) fn validate(&self) -> Result<(), PhantomError> {
        check_count("size", self.size, [8, 1024])?;
        check_count("views", self.views, [3, 10_000])?;
        check_value("gain", self.gain, [0.0, 2.0])?;
        check_value("bpm", self.beats_per_minute, [1.0, 1000.0])?;
        check_count("nodes", self.nodes, [11, 100_001]).map(drop)
    }
}
