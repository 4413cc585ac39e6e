//! What the study is asked for.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{PhantomError, Scene, VolumeRange};

/// What to compute.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOptions {
    /// Voxels along an edge of the volume, bins and rows of the camera; the field of view is 16 cm
    /// whatever their number. Default 256.
    pub size: usize,
    /// Views over 180 degrees. Default 90.
    pub views: usize,
    /// Volume gain of the cavity at the height of the cycle. Default 0.6.
    pub gain: f64,
    /// Heart rate. Default 65.
    pub beats_per_minute: f64,
    /// Nodes of a membrane. Default 801.
    pub nodes: usize,
    /// Threads; all cores if `None`. Does not change the results.
    pub threads: Option<usize>,
    /// Whether to draw the figures.
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
            threads: None,
            figures: true,
        }
    }
}

impl StudyOptions {
    /// The scene that the three acquisitions are modes of: [`Scene::default`], as large and as fine as is asked for.
    pub(super) fn scene(&self) -> Scene {
        let mut scene = Scene::default().with_size(self.size);
        scene.camera.views = self.views;
        scene.cycle.beats_per_minute = self.beats_per_minute;
        scene.cycle.volume = VolumeRange::Gain(self.gain);
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: self.nodes };
        scene
    }

    /// The limits are those of memory (a volume of 1024^3 samples is 4 GiB) and of sense.
    pub(super) fn validate(&self) -> Result<(), PhantomError> {
        check_count("size", self.size, 8, 1024)?;
        check_count("views", self.views, 1, 10_000)?;
        check("gain", self.gain, 0.0, 2.0)?;
        check("bpm", self.beats_per_minute, 1.0, 1000.0)?;
        check_count("nodes", self.nodes, 11, 100_001)?;
        if let Some(threads) = self.threads {
            check_count("threads", threads, 1, 4096)?;
        }
        Ok(())
    }
}

fn check(what: &'static str, given: f64, least: f64, most: f64) -> Result<(), PhantomError> {
    let refused = PhantomError::OutOfRange {
        what,
        given,
        least,
        most,
    };
    // A NaN fails both comparisons.
    (given >= least && given <= most)
        .then_some(())
        .ok_or(refused)
}

fn check_count(
    what: &'static str,
    given: usize,
    least: usize,
    most: usize,
) -> Result<(), PhantomError> {
    let refused = PhantomError::Count {
        what,
        given,
        least,
        most,
    };
    (least..=most).contains(&given).then_some(()).ok_or(refused)
}
