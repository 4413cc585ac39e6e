//! What the views of a gated projection set are: over which time each is averaged, and what comes of it.

use super::settings::Mode;
use super::view_error::ViewError;
use revolve_voxel::RayCounters;

/// The time over which the views of a gated projection set are averaged, and the resolution of the average.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Acquisition {
    pub(crate) mode: Mode,
    /// The cardiac gate, from 0; 0 in other modes than [`Mode::Gated`].
    pub(crate) gate: usize,
    /// Steps per cycle, even.
    pub(crate) points: usize,
}

impl Acquisition {
    /// All views at one phase, with as few steps as there can be for a camera in continuous rotation.
    pub(crate) fn still(phase: f64) -> Self {
        Self {
            mode: Mode::Static { phase },
            gate: 0,
            points: 8,
        }
    }

    /// The cardiac gate with the number of gates.
    pub(crate) fn gate_of(&self) -> Option<[usize; 2]> {
        match self.mode {
            Mode::Gated { gates } => Some([self.gate, gates]),
            Mode::Static { .. } | Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle => None,
        }
    }
}

/// What an exact volume is the mean over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
pub enum TruthOf {
    /// What every view sees: a phase, a whole beat, a gate. All views see the same.
    EachView,
    /// What all views see together, each for its share: they see different parts of the beat, instants or parts of beats, so that no
    /// one heart is behind all of them.
    MeanOfViews,
}

impl TruthOf {
    /// The name of its file, without what all files of a kind have in common.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::EachView => "truth",
            Self::MeanOfViews => "truth-mean-of-views",
        }
    }
}

/// The sinograms of an acquisition and how they came about.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Sinograms {
    /// Line integrals in cm times activity, index order `[view][row][bin]`, bin fastest.
    pub samples: Vec<f32>,
    /// The mean angle in radians from which each view was taken: the camera's own ([`Camera::geometry`](crate::Camera::geometry)), unless it turns and the
    /// view does not see all of its time. What reconstructs has to use these.
    pub angles: Vec<f64>,
    /// Distinct phases that the views see; of means over volumes, distinct volumes.
    pub distinct_phases: usize,
    /// Distinct shapes that those phases need: mirrored phases share one.
    pub distinct_shapes: usize,
    /// Bounds on the errors of the samples. What takes a blur of its own is estimated in up to 16 views, evenly among those taken. The term of time is
    /// `(1 + 5 / N) max |d| / max |s_n|`, with `d = s_n - s_(n/2)` the difference between the rules with all and with half the points and
    /// `N = (sum d^2)^2 / sum d^4` the number of samples that make it up; it is never less than the relative error of the cavity's mean volume.
    pub view_error: ViewError,
    /// Rays cast and skipped.
    pub rays: RayCounters,
}
