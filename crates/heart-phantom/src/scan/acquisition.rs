//! When views are taken: at a phase, at instants, over exposures, whole cycles, gates; and what comes of it.

use super::view_error::ViewError;
use revolve_voxel::RayCounters;

/// When each view is taken; from where a turning camera then sees it, [`ViewTime`](crate::ViewTime) says.
///
/// Means over time have an even number of `points` a beat. Before a camera that stands still a sinusoid is sampled at equal steps, at
/// least two, no longer than the beat over `points`: the trapezoidal rule. All else is a mean over volumes: between levels of the
/// volume, half as many as `points` from the smallest to the largest, views are taken as linear, and the weights are the times
/// that the curve itself stays near each level. So nothing that a curve does is missed, however short it is and however often
/// it comes back. While the camera turns, that is done in each of 32 or more arcs of a view.
///
/// Rays that touch the surface see a square root of time, and so both are of order 3/2: the error falls by 2.8 when `points`
/// double. The half of the points gives an error estimate for nothing, [`Sinograms::view_error`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Acquisition {
    /// All views at one phase of the cycle: nothing moves.
    Static {
        /// The phase; 0 is rest in the study's cycle.
        phase: f64,
        /// Steps of the arc that a camera turns through in a view, even; one that stops needs none.
        points: usize,
    },
    /// View `k` is an instant at `t = k T` seconds, `T` the camera's [`interval`](crate::Camera::interval).
    Instants,
    /// View `k` is the mean from `t = k T` to `k T + window` seconds.
    Exposure {
        /// Seconds that a view is exposed, at most `T`.
        window: f64,
        /// Steps a cycle, even.
        points: usize,
    },
    /// Each view is the mean over a whole cycle; of a camera that turns all the time, over all of its time, which is a cycle at least.
    WholeCycle {
        /// Steps a cycle, even.
        points: usize,
    },
    /// Each view is the mean over one gate: the phases from `gate / gates` to `(gate + 1) / gates` of every beat, or of a camera that
    /// turns all the time, of what comes of them in the view's time.
    Gate {
        /// Which gate, from 0.
        gate: usize,
        /// Number of equal gates.
        gates: usize,
        /// Steps a cycle, even.
        points: usize,
    },
}

impl Acquisition {
    /// All views at one phase, with as few steps as there can be for a camera that turns.
    pub const fn still(phase: f64) -> Self {
        Self::Static { phase, points: 8 }
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
