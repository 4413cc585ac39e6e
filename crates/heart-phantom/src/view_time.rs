//! When views are taken: the time that each of them sees, and from where.

use crate::acquire::Acquisition;
use crate::camera::Rotation;
use crate::{Camera, Cycle};
use serde::Serialize;

/// When a view is taken, and from where.
///
/// View `k` has the time from `k T` to `(k + 1) T`, `T` the seconds from the start of a view to the start of the next. A camera
/// that stops stands at the view's nominal angle `theta_k` all that time. One that turns all the time passes it in the middle:
/// `theta(t) = theta_k + ((t - k T) / T - 1/2) step`, so that an instant, which is taken at `t = k T`, is seen from half a step
/// before, and an exposure of `w` seconds from `theta(k T)` to `theta(k T + w)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ViewTime {
    /// Seconds from the start of the first view to that of this one, `k T`.
    pub start: f64,
    /// Seconds of its time that the view sees: 0 of an instant, of a gate those in which the beat is in it. A camera that stops sees
    /// whole beats in the mean, and of `n` gates each for a share `1 / n`.
    pub window: f64,
    /// Phase of the beat at the start; of a heart that is held at a phase, that one.
    pub phase: f64,
    /// Mean angle of the camera over the time seen, in radians. What was seen is reconstructed as seen from there.
    pub angle: f64,
}

/// The part of a view's time that counts, in beats: all between two ends that is in a gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// The phase at which it starts, and that plus the beats to its end.
    pub(crate) ends: [f64; 2],
    /// Phases of every beat that count.
    pub(crate) gate: [f64; 2],
}

impl Seen {
    /// Beats seen, and their first moment about beat 0.
    pub(crate) fn moments(&self) -> [f64; 2] {
        let [a, b] = self.gate;
        let up_to = |end: f64| {
            let whole = end.floor();
            let part = (end - whole - a).clamp(0.0, b - a);
            let beats = whole * (b - a) + part;
            let of_whole = 0.5 * whole * ((whole - 1.0) * (b - a) + (b * b - a * a));
            [beats, of_whole + part * (whole + a + 0.5 * part)]
        };
        let ([beats, moment], [to, moment_to]) = (up_to(self.ends[0]), up_to(self.ends[1]));
        [to - beats, moment_to - moment]
    }
}

impl Acquisition {
    /// What a view sees of the beat.
    pub(crate) fn seen(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> Seen {
        let from = |interval: f64, seconds: f64| {
            let phase = cycle.phase(view_idx as f64 * interval);
            [phase, phase + seconds / cycle.period()]
        };
        let (ends, gate) = match *self {
            Self::Static { phase } => ([phase; 2], [0.0, 1.0]),
            Self::Instants { interval } => (from(interval, 0.0), [0.0, 1.0]),
            Self::Exposure {
                interval, window, ..
            } => (from(interval, window), [0.0, 1.0]),
            Self::WholeCycle { .. } => ([0.0, 1.0], [0.0, 1.0]),
            Self::Gate { gate, gates, .. } => {
                let ends = [gate, gate + 1].map(|g| g as f64 / gates as f64);
                (ends, ends)
            }
        };
        match (self, camera.rotation()) {
            (Self::WholeCycle { .. } | Self::Gate { .. }, Rotation::Continuous { interval }) => {
                Seen {
                    ends: from(interval, interval),
                    gate,
                }
            }
            _ => Seen { ends, gate },
        }
    }

    /// When and from where a view is taken; `interval` seconds after the one before it.
    pub(crate) fn view_time(
        &self,
        cycle: &Cycle,
        camera: &Camera,
        interval: f64,
        view_idx: usize,
    ) -> ViewTime {
        let start = view_idx as f64 * interval;
        let seen = self.seen(cycle, camera, view_idx);
        let [beats, moment] = seen.moments();
        let (window, share) = match (self, camera.rotation()) {
            (Self::Static { .. } | Self::WholeCycle { .. }, _) => (interval, 0.5),
            (Self::Instants { .. }, _) => (0.0, 0.0),
            (&Self::Exposure { window, .. }, _) if window > 0.0 => {
                (window, 0.5 * window / interval)
            }
            (Self::Exposure { .. }, _) => (0.0, 0.0),
            (Self::Gate { .. }, Rotation::StepAndShoot) => (interval * beats, 0.5),
            (Self::Gate { .. }, Rotation::Continuous { .. }) => {
                let per_view = interval / cycle.period();
                let share = (moment / beats - seen.ends[0]) / per_view;
                (beats * cycle.period(), share)
            }
        };
        ViewTime {
            start,
            window,
            phase: match *self {
                Self::Static { phase } => phase,
                _ => cycle.phase(start),
            },
            angle: camera.angle(view_idx, share),
        }
    }
}
