//! When views are taken: the time that each of them sees, and from where.

use super::acquisition::Acquisition;
use super::camera::Rotation;
use super::spans;
#[cfg(feature = "scene")]
use crate::text::short;
use crate::{Camera, Cycle};

/// When a view is taken, and from where.
///
/// View `k` of a head has the time from `k T` to `(k + 1) T`, `T` the seconds from the start of a view to the start of the next. A camera
/// that stops stands at the view's nominal angle `theta_k` all that time. One that turns all the time passes it in the middle:
/// `theta(t) = theta_k + ((t - k T) / T - 1/2) step`, so that an instant, which is taken at `t = k T`, is seen from half a step
/// before, and an exposure of `w` seconds from `theta(k T)` to `theta(k T + w)`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct ViewTime {
    /// Seconds from the start of the first view to that of this one: `k T` of view `k` of a head.
    pub start: f64,
    /// Seconds of its time that the view sees: 0 of an instant, of a gate those in which the beat is in it. A camera that stops sees
    /// whole beats in the mean, all of the view's seconds, and of `n` gates each for a share `1 / n` of them, however many beats they are;
    /// of beats that differ, and of a heart that breathes, any camera sees what comes in the view's own time.
    pub window: f64,
    /// Phase of the beat at the start of the view, which is not that of the gate it is sorted into; of a heart that is held at a
    /// phase, that one.
    pub phase: f64,
    /// Mean angle of the camera over the time seen, in radians. What was seen is reconstructed as seen from there.
    pub angle: f64,
}

/// The views of a gate as `report.json` has them, one number a view.
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct ViewReport {
    /// [`ViewTime::start`] in seconds.
    pub start_s: Vec<f64>,
    /// [`ViewTime::window`] in seconds: where a camera that stops sees whole beats in the mean, the seconds of a view.
    pub window_s: Vec<f64>,
    /// [`ViewTime::phase`], at the start of the view, not of the gate.
    pub phase: Vec<f64>,
    /// [`ViewTime::angle`] in degrees, as angles of scenes are.
    pub angle_deg: Vec<f64>,
    /// Distance of the collimator's face from the axis of turning in cm.
    pub radius_cm: Vec<f64>,
    /// Expected counts of a sample of 1, where views were made by a camera of known sensitivity ([`Counting`](crate::Counting)).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub counts_per_unit: Vec<f64>,
}

#[cfg(feature = "scene")]
impl ViewReport {
    pub(crate) fn of(times: &[ViewTime], radii: &[f64]) -> Self {
        let column = |of: fn(&ViewTime) -> f64| times.iter().map(|time| short(of(time))).collect();
        Self {
            start_s: column(|time| time.start),
            window_s: column(|time| time.window),
            phase: column(|time| time.phase),
            angle_deg: column(|time| time.angle.to_degrees()),
            radius_cm: radii.iter().map(|radius| short(*radius)).collect(),
            counts_per_unit: Vec::new(),
        }
    }
}

/// The part of a view's time that counts, in beats: all between two ends that is in a gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimeSeen {
    /// The phase at which it starts, and that plus the beats to its end.
    pub(crate) ends: [f64; 2],
    /// The beats between the two, before rounding.
    pub(crate) beats: f64,
    /// Phases of every beat that count.
    pub(crate) gate: [f64; 2],
}

impl TimeSeen {
    /// Beats seen, and their first moment about beat 0.
    pub(crate) fn moments(&self) -> [f64; 2] {
        let ([beats, moment], [to, moment_to]) =
            (self.up_to(self.ends[0]), self.up_to(self.ends[1]));
        [to - beats, moment_to - moment]
    }

    /// The ends of parts in which equally much is seen.
    pub(crate) fn parts(&self, n: usize) -> Vec<f64> {
        let [a, b] = self.gate;
        let [from, to] = self.ends.map(|end| self.up_to(end)[0]);
        let inner = (1..n).map(|k| {
            let seen = from + (to - from) * k as f64 / n as f64;
            let whole = (seen / (b - a)).floor();
            whole + a + (seen - whole * (b - a))
        });
        let [from, to] = self.ends;
        std::iter::once(from).chain(inner).chain([to]).collect()
    }

    /// The same from phase 0 of beat 0 on.
    fn up_to(&self, end: f64) -> [f64; 2] {
        let [a, b] = self.gate;
        let whole = end.floor();
        let part = (end - whole - a).clamp(0.0, b - a);
        let of_whole = 0.5 * whole * ((whole - 1.0) * (b - a) + (b * b - a * a));
        [
            whole * (b - a) + part,
            of_whole + part * (whole + a + 0.5 * part),
        ]
    }
}

impl Acquisition {
    /// In real time, how many seconds a view sees, and the moment in their middle.
    pub(super) fn seconds(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> [f64; 2] {
        let start = camera.view_start(view_idx);
        spans::seen(&spans::of_view(*self, cycle, camera, view_idx), start)
    }

    /// What a view sees of the beat.
    pub(crate) fn seen(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> TimeSeen {
        let whole = [0.0, 1.0];
        let interval = camera.interval();
        let from = |seconds: f64, gate: [f64; 2]| {
            let phase = cycle.phase(camera.view_start(view_idx));
            let beats = seconds / cycle.period();
            TimeSeen {
                ends: [phase, phase + beats],
                beats,
                gate,
            }
        };
        // The beat itself, once, for a camera that waits; all of the view's time for one that turns.
        let of_beats = |gate: [f64; 2]| match camera.rotation() {
            Rotation::Continuous => from(interval, gate),
            Rotation::StepAndShoot => TimeSeen {
                ends: gate,
                beats: gate[1] - gate[0],
                gate,
            },
        };
        match *self {
            Self::Static { phase, .. } => TimeSeen {
                ends: [phase; 2],
                beats: 0.0,
                gate: whole,
            },
            Self::Instants => from(0.0, whole),
            Self::Exposure { window, .. } => from(window, whole),
            Self::WholeCycle { .. } => of_beats(whole),
            Self::Gate { gate, gates, .. } => {
                of_beats([gate, gate + 1].map(|g| g as f64 / gates as f64))
            }
        }
    }

    /// When and from where a view is taken.
    pub(crate) fn view_time(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> ViewTime {
        let interval = camera.interval();
        let start = camera.view_start(view_idx);
        let [beats, _] = self.seen(cycle, camera, view_idx).moments();
        ViewTime {
            start,
            window: match self.in_real_time(cycle) {
                true => self.seconds(cycle, camera, view_idx)[0],
                false => match (self, camera.rotation()) {
                    (Self::Static { .. } | Self::WholeCycle { .. }, _) => interval,
                    (Self::Instants, _) => 0.0,
                    (&Self::Exposure { window, .. }, _) => window,
                    (Self::Gate { .. }, Rotation::StepAndShoot) => interval * beats,
                    (Self::Gate { .. }, Rotation::Continuous) => beats * cycle.period(),
                },
            },
            phase: match *self {
                Self::Static { phase, .. } => phase,
                _ => cycle.phase(start),
            },
            angle: self.angle(cycle, camera, view_idx),
        }
    }

    /// The mean angle of the camera over the time that a view sees.
    pub(crate) fn angle(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> f64 {
        if camera.rotation() == Rotation::StepAndShoot {
            return camera.angle(view_idx, 0.5);
        }
        if self.in_real_time(cycle) {
            let start = camera.view_start(view_idx);
            let [_, middle] = self.seconds(cycle, camera, view_idx);
            return camera.angle(view_idx, (middle - start) / camera.interval());
        }
        let share = match *self {
            Self::Static { .. } | Self::WholeCycle { .. } => 0.5,
            Self::Instants => 0.0,
            Self::Exposure { window, .. } => 0.5 * window / camera.interval(),
            Self::Gate { .. } => {
                let seen = self.seen(cycle, camera, view_idx);
                let [beats, moment] = seen.moments();
                (moment / beats - seen.ends[0]) * cycle.period() / camera.interval()
            }
        };
        camera.angle(view_idx, share)
    }
}
