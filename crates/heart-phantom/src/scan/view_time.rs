//! When views are taken: the time that each of them sees, and from where.

use super::acquisition::Acquisition;
use super::camera::Rotation;
use super::settings::Mode;
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

impl Acquisition {
    /// Seconds from the start of a view to its end.
    pub(super) fn lasts(&self, camera: &Camera) -> f64 {
        match self.mode {
            Mode::Instants => 0.0,
            Mode::Exposure { seconds } => seconds,
            Mode::Static { .. } | Mode::WholeCycle | Mode::Gated { .. } => camera.interval(),
        }
    }

    /// Start and end of a view in seconds, from the start of the first view or, of a regular cycle, from that of the beat in which the
    /// view begins. A camera that stands still averages over one such beat.
    pub(super) fn window(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> [f64; 2] {
        let start = camera.view_start(view_idx);
        if self.in_real_time(cycle) {
            return [start, start + self.lasts(camera)];
        }
        match (self.mode, camera.rotation()) {
            (Mode::Static { .. }, _) => [0.0, camera.interval()],
            (Mode::WholeCycle | Mode::Gated { .. }, Rotation::StepAndShoot) => {
                [0.0, cycle.period()]
            }
            _ => {
                let start = cycle.phase(start) * cycle.period();
                [start, start + self.lasts(camera)]
            }
        }
    }

    /// Seconds that a view covers, and the moment in their middle after its start.
    pub(super) fn seconds(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> [f64; 2] {
        let lasts = self.lasts(camera);
        match (self.mode, camera.rotation()) {
            _ if self.in_real_time(cycle) => {}
            (Mode::Gated { .. }, Rotation::Continuous) => {}
            (Mode::Gated { gates }, Rotation::StepAndShoot) => {
                return [lasts / gates as f64, 0.5 * lasts];
            }
            _ => return [lasts, 0.5 * lasts],
        }
        let [start, end] = self.window(cycle, camera, view_idx);
        let [seconds, middle] = spans::seen(&spans::between(*self, cycle, [start, end]), start);
        [seconds, middle - start]
    }

    /// When and from where a view is taken.
    pub(crate) fn view_time(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> ViewTime {
        let start = camera.view_start(view_idx);
        ViewTime {
            start,
            window: self.seconds(cycle, camera, view_idx)[0],
            phase: match self.mode {
                Mode::Static { phase } => phase,
                _ => cycle.phase(start),
            },
            angle: self.angle(cycle, camera, view_idx),
        }
    }

    /// The mean angle of the camera over the time that a view covers.
    pub(crate) fn angle(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> f64 {
        let share = match camera.rotation() {
            Rotation::StepAndShoot => 0.5,
            Rotation::Continuous => self.seconds(cycle, camera, view_idx)[1] / camera.interval(),
        };
        camera.angle(view_idx, share)
    }
}
