//! Acquisitions: the time over which the projections of a gated set are averaged, and their results.

use super::levels::Interpolation;
use super::settings::Mode;
use super::view_error::ViewError;
use crate::Camera;
use revolve_voxel::RayCounters;

/// Largest rotation during a view in radians for which views behind a response are polynomials in the angle; with more, these need more angles than the
/// linear rule has arcs (measured at 30 to 180 degrees).
const MOST_TURN: f64 = 0.7;

/// The averaging time of the projections of a gated set, and the resolution of the average.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Acquisition {
    pub(crate) mode: Mode,
    /// The cardiac and the respiratory gate, from 0; 0 without gating.
    pub(crate) gate: [usize; 2],
    /// Steps per cycle and per respiratory cycle, even.
    pub(crate) points: [usize; 2],
    pub(crate) interpolation: Interpolation,
}

impl Acquisition {
    /// Returns an acquisition at one phase, with the fewest steps for continuous rotation.
    pub(crate) fn still(phase: f64) -> Self {
        Self::new(Mode::Static { phase }, 0, 8)
    }

    /// A gated projection set with as many steps per cycle and per respiratory cycle, by linear interpolation.
    pub(crate) fn new(mode: Mode, gate: usize, points: usize) -> Self {
        Self {
            mode,
            gate: [gate % mode.n_gates(), gate / mode.n_gates()],
            points: [points; 2],
            interpolation: Interpolation::Linear,
        }
    }

    /// The same with linear interpolation, which has no negative weights, and other steps.
    pub(crate) fn linear(self, points: [usize; 2]) -> Self {
        Self {
            points,
            interpolation: Interpolation::Linear,
            ..self
        }
    }

    /// The same with the polynomial rule, if samples are behind a response and the camera rotates little during a view.
    pub(crate) fn behind(self, responds: bool, camera: &Camera) -> Self {
        let interpolation = match responds && camera.turn() <= MOST_TURN {
            true => Interpolation::Polynomial,
            false => self.interpolation,
        };
        Self {
            interpolation,
            ..self
        }
    }
}

/// The time average that a voxelised ground truth represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TruthOf {
    /// The time of every view: a phase, a whole cycle or a gate, the same for all views.
    EachView,
    /// The time average of each view, averaged over the views with equal weights. Views cover different parts of the cycle (instants or
    /// incomplete cycles), so that no single heart corresponds to all of them.
    MeanOfViews,
}

impl TruthOf {
    /// Returns the file name without the common part of its kind.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::EachView => "truth",
            Self::MeanOfViews => "truth-mean-of-views",
        }
    }
}

/// The projections of an acquisition, with errors and counters. [`Phantom::geometry`](crate::Phantom::geometry) has their angles.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Sinograms {
    /// Samples in cm times activity, line integrals or those of an image behind a response, index order `[view][row][bin]`, bin fastest.
    pub samples: Vec<f32>,
    /// Number of distinct shapes of the heart; mirrored phases share a shape.
    pub distinct_shapes: usize,
    /// Estimated errors of the samples. The time term is `c (1 + 5 / N) max |d| / max |s_n|`. Here `d = s_n - s_(n/2)` is the difference between
    /// the rules with all and with half the nodes, `N = (sum d^2)^2 / sum d^4` the effective number of samples, and c is 1 for line integrals, 0.35
    /// behind a response. The term is at least the relative error of the average cavity volume; [`ViewError::time`] contains the limit for line
    /// integrals.
    pub view_error: ViewError,
    /// Number of rays cast and skipped.
    pub rays: RayCounters,
}
