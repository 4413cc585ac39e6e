//! Times and angles of views.

use super::acquisition::Acquisition;
use super::settings::{Mode, Rotation};
use super::spans;
use crate::text::short;
use crate::{Camera, Cycle};

/// Time and angle of a view.
///
/// View `k` of a head has the interval from `k T` to `(k + 1) T`, where `T` is the time between starts. With step and shoot the camera stays at
/// the nominal angle `theta_k`. With continuous rotation it passes `theta_k` at the middle: `theta(t) = theta_k + ((t - k T) / T - 1/2) step`.
/// An instant at `t = k T` is half a step before `theta_k`; an exposure of `w` seconds lasts from `theta(k T)` to `theta(k T + w)`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ViewTime {
    /// Start of the view in seconds after the first view: `k T` for view `k` of a head.
    pub start: f64,
    /// Acquisition time within the interval, seconds. 0 for an instant; for a gate the time in that gate. With step and shoot and regular beats,
    /// views are averages over whole cycles: a whole view has `T`, each of `n` gates `T / n`. With variable R-R intervals or respiration it is
    /// the actual time in the view's interval.
    pub window: f64,
    /// Cardiac phase at the start of the view, not that of its gate; the given phase of a static scene.
    pub phase: f64,
    /// Camera angle averaged over the acquisition time, radians: the angle for reconstruction.
    pub angle: f64,
}

/// Times and angles of the views of a gate in `report.json`, one value per view.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct ViewReport {
    /// [`ViewTime::start`] in seconds.
    pub start_s: Vec<f64>,
    /// [`ViewTime::window`] in seconds.
    pub window_s: Vec<f64>,
    /// [`ViewTime::phase`], at the start of the view, not that of the gate.
    pub phase: Vec<f64>,
    /// [`ViewTime::angle`] in degrees.
    pub angle_deg: Vec<f64>,
    /// Distance of the collimator face from the axis of rotation, cm.
    pub radius_cm: Vec<f64>,
    /// Expected counts per unit sample, if the sensitivity of the camera is given ([`Counting`](crate::Counting)).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub counts_per_unit: Vec<f64>,
}

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
    /// Returns the duration of a view, seconds.
    pub(super) fn lasts(&self, camera: &Camera) -> f64 {
        match self.mode {
            Mode::Instants => 0.0,
            Mode::Exposure { seconds } => seconds,
            Mode::Static { .. } | Mode::WholeCycle | Mode::Gated { .. } => camera.interval(),
        }
    }

    /// Returns start and end of a view in seconds after the first view, or for a regular cycle after the start of the beat in which the view
    /// begins. With step and shoot the average is over one such beat.
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

    /// Returns the acquisition time of a view, and the time of its middle after the start, seconds.
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

    /// Returns time and angle of a view.
    pub(crate) fn view_time(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> ViewTime {
        let start = camera.view_start(view_idx);
        ViewTime {
            start,
            window: self.seconds(cycle, camera, view_idx)[0],
            phase: (self.mode.static_phase()).unwrap_or_else(|| cycle.phase(start)),
            angle: self.angle(cycle, camera, view_idx),
        }
    }

    /// Returns the camera angle averaged over the acquisition time of a view.
    fn angle(&self, cycle: &Cycle, camera: &Camera, view_idx: usize) -> f64 {
        let share = match camera.rotation() {
            Rotation::StepAndShoot => 0.5,
            Rotation::Continuous => self.seconds(cycle, camera, view_idx)[1] / camera.interval(),
        };
        camera.angle(view_idx, share)
    }
}
