//! What the camera sees: sinograms of the heart at rest, of instants, exposures, whole cycles, gates.

use crate::activity::Activity;
use crate::error::PhantomError;
use crate::scan::Scan;
use crate::{Camera, Cycle, Heart};
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
/// double. The half of the points gives an error estimate for nothing, [`Sinograms::quadrature_error`].
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
    /// View `k` is an instant at `t = k * interval` seconds.
    Instants {
        /// Seconds from a view to the next.
        interval: f64,
    },
    /// View `k` is the mean from `t = k * interval` to `k * interval + window` seconds.
    Exposure {
        /// Seconds from a view to the next.
        interval: f64,
        /// Seconds that a view is exposed, at most `interval`.
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

    /// Solves the shapes that the views need, so that nothing is left to solve when they are taken; no more than the heart keeps.
    ///
    /// # Errors
    /// As [`acquire`](acquire()).
    pub fn solve(&self, heart: &Heart, camera: &Camera, cycle: &Cycle) -> Result<(), PhantomError> {
        let none = Activity::from([0.0; 2]);
        let times = Scan::plain(heart, camera, cycle, *self, none).times()?;
        let gains = times.iter().map(|(gain, _)| *gain);
        let kept: Vec<f64> = gains.take(heart.most_shapes()).collect();
        heart.shapes(&kept).map(drop)
    }
}

/// The sinograms of an acquisition and how they came about.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Sinograms {
    /// Line integrals in cm times activity, index order `[view][row][bin]`, bin fastest.
    pub samples: Vec<f32>,
    /// The mean angle in radians from which each view was taken: the camera's own ([`Camera::geometry`]), unless it turns and the
    /// view does not see all of its time. What reconstructs has to use these.
    pub angles: Vec<f64>,
    /// Distinct phases that the views see; of means over volumes, distinct volumes.
    pub distinct_phases: usize,
    /// Distinct shapes that those phases need: mirrored phases share one.
    pub distinct_shapes: usize,
    /// For averages an estimate of the relative error in the Euclidean norm over all samples, that bounds it from above:
    /// `(1 + 5 / N) |d| / |s_n|`, `d = s_n - s_(n/2)` the difference between the rules with all and with half the points. At order 3/2
    /// that is 1.8 times the error; where few samples make up the difference it says little of itself, and
    /// `N = (sum d^2)^2 / sum d^4` counts them. Never less than the relative error of the cavity's mean volume by equal steps (root
    /// mean square over the views), which the curve alone tells.
    pub quadrature_error: Option<f64>,
    /// Rays cast and skipped.
    pub rays: RayCounters,
}

/// Takes all views of an acquisition; `activity` is that of the cavity and of the wall.
///
/// Line integrals are those of the exact body, no voxels are involved. Equal shapes are solved
/// once; the result has the same bits for any number of threads. `progress` is called with the
/// number of views done.
///
/// # Errors
/// [`PhantomError::Count`] or [`PhantomError::Odd`] unless the number of steps is even and at most 65536;
/// [`PhantomError::OutOfRange`] for a time, phase or activity without sense, an interval other than a turning camera's own among
/// them; [`PhantomError::Unseen`] for a gate that does not come in some view; what solving the shapes can return.
pub fn acquire(
    heart: &Heart,
    camera: &Camera,
    cycle: &Cycle,
    acquisition: Acquisition,
    activity: impl Into<Activity>,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Sinograms, PhantomError> {
    let scan = Scan::plain(heart, camera, cycle, acquisition, activity.into());
    scan.rows(0..camera.n_views(), 0..camera.n_rows(), progress)
}
