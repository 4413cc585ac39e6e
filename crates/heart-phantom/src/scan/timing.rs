//! What an acquisition may ask for, and how much work that is.

use super::acquisition::{Acquisition, TruthOf};
use super::camera::Rotation;
use crate::error::{PhantomError, check, check_count};
use crate::model::Height;
use crate::ranges;
use crate::{Camera, Cycle};

/// Most quadrature points a cycle.
const MAX_POINTS: usize = 65536;
/// Most points of all views together: each is a view of the heart.
const MAX_POINTS_OF_ALL: usize = 1 << 24;
/// Fewest and most steps a cycle that a tolerance is met with.
pub(crate) const STEPS: [usize; 2] = [8, ranges::STEPS[1]];
/// Arcs of a whole view of a turning camera, at least.
const ARCS: usize = 32;
/// A time of this share of a beat is rounding.
pub(crate) const NO_TIME: f64 = 1e-9;

impl Acquisition {
    /// Whether all views see the same phases with the same weights.
    pub(crate) fn same_for_all_views(&self, cycle: &Cycle, camera: &Camera) -> bool {
        if self.in_real_time(cycle) {
            return false;
        }
        match self {
            Acquisition::Static { .. } => true,
            Acquisition::WholeCycle { .. } | Acquisition::Gate { .. } => {
                camera.rotation() == Rotation::StepAndShoot
            }
            Acquisition::Instants | Acquisition::Exposure { .. } => false,
        }
    }

    /// Whether views see what comes in their own time, whatever the camera does.
    pub(crate) fn in_real_time(&self, cycle: &Cycle) -> bool {
        match self {
            // A heart that does not beat has no beats that differ.
            Acquisition::Static { .. } => cycle.breathing().is_some(),
            _ => cycle.in_real_time(),
        }
    }

    /// What its exact volume is the mean over.
    pub fn truth_of(&self, cycle: &Cycle, camera: &Camera) -> TruthOf {
        if self.in_real_time(cycle) {
            return TruthOf::MeanOfViews;
        }
        let first = self.seen(cycle, camera, 0);
        let whole = first.beats >= 1.0 && (first.beats - first.beats.round()).abs() <= NO_TIME;
        let same = |view_idx| self.seen(cycle, camera, view_idx).ends[0] == first.ends[0];
        if self.same_for_all_views(cycle, camera) || whole || (1..camera.n_views()).all(same) {
            TruthOf::EachView
        } else {
            TruthOf::MeanOfViews
        }
    }

    /// Whether views are means over levels of volume, and not over steps of time.
    pub(crate) fn by_volume(&self, cycle: &Cycle, camera: &Camera) -> bool {
        match *self {
            Acquisition::Static { .. } | Acquisition::Instants => return false,
            Acquisition::Exposure { window, .. } if window / cycle.period() <= NO_TIME => {
                return false;
            }
            Acquisition::Exposure { .. }
            | Acquisition::WholeCycle { .. }
            | Acquisition::Gate { .. } => {}
        }
        if self.in_real_time(cycle) {
            return true;
        }
        camera.rotation() != Rotation::StepAndShoot || *cycle.height() != Height::Sinusoid
    }

    /// Steps a cycle, or of the arc of a heart that is still; none where nothing is averaged.
    pub(crate) fn points(&self) -> usize {
        match *self {
            Acquisition::Instants => 0,
            Acquisition::Static { points, .. }
            | Acquisition::Exposure { points, .. }
            | Acquisition::WholeCycle { points }
            | Acquisition::Gate { points, .. } => points,
        }
    }

    /// Checks everything before any work.
    pub(crate) fn validate(&self, cycle: &Cycle, camera: &Camera) -> Result<(), PhantomError> {
        match *self {
            Acquisition::Static { phase, .. } => check("phase", phase, [-1e9, 1e9]).map(drop)?,
            Acquisition::Exposure { window, .. } => {
                check("window", window, [0.0, camera.interval()]).map(drop)?;
            }
            Acquisition::Instants | Acquisition::WholeCycle { .. } => {}
            Acquisition::Gate { gate, gates, .. } => {
                check_count("gates", gates, [1, MAX_POINTS])?;
                check_count("gate", gate, [0, gates - 1])?;
            }
        }
        if !matches!(self, Acquisition::Instants) {
            let points = check_count("quadrature points", self.points(), [2, MAX_POINTS])?;
            if !points.is_multiple_of(2) {
                return Err(PhantomError::Odd {
                    what: "quadrature points",
                    given: points,
                });
            }
        }
        if let (Acquisition::WholeCycle { .. }, Rotation::Continuous) = (self, camera.rotation())
            && !self.in_real_time(cycle)
        {
            let what = "interval of a turning camera";
            check(what, camera.interval(), [cycle.period(), 1e9])?;
        }
        if let Some(view_idx) = self.unseen(cycle, camera) {
            let gate = match *self {
                Acquisition::Gate { gate, .. } => gate,
                _ => 0,
            };
            return Err(PhantomError::Unseen { gate, view_idx });
        }
        let points = self.points_of_all(cycle, camera);
        let what = "quadrature points of all views";
        check_count(what, points as usize, [0, MAX_POINTS_OF_ALL]).map(drop)
    }

    /// The first view in whose time the gate does not come, or nothing that counts.
    fn unseen(&self, cycle: &Cycle, camera: &Camera) -> Option<usize> {
        if self.in_real_time(cycle) {
            let lasts = match *self {
                Acquisition::Instants => false,
                Acquisition::Exposure { window, .. } => window > 0.0,
                _ => true,
            };
            let sees = |view_idx: &usize| self.seconds(cycle, camera, *view_idx)[0] > 0.0;
            return (0..camera.n_views()).find(|view_idx| lasts && !sees(view_idx));
        }
        let seen = |view_idx: &usize| self.seen(cycle, camera, *view_idx).moments()[0];
        match (self, camera.rotation()) {
            // No longer than a beat at most, or it comes in every view.
            (Acquisition::Gate { .. }, Rotation::Continuous)
                if camera.interval() < cycle.period() =>
            {
                (0..camera.n_views()).find(|view_idx| seen(view_idx) <= NO_TIME)
            }
            _ => None,
        }
    }

    /// Points of all views together, before equal ones are merged.
    pub(crate) fn points_of_all(&self, cycle: &Cycle, camera: &Camera) -> f64 {
        let n_views = if self.same_for_all_views(cycle, camera) {
            1
        } else {
            camera.n_views()
        };
        let beats = self.seen(cycle, camera, 0).beats;
        let points = self.points() as f64;
        if self.in_real_time(cycle) {
            // All pairs of levels at most; a way through them meets two rows of them.
            let breaths =
                camera.interval() / cycle.breathing().map_or(f64::MAX, |b| b.breathing().period);
            let pairs = (0.5 * points + 1.0) * (0.5 * points + 1.0);
            let ways = 4.0 * points * (1.0 + camera.interval() / cycle.period() + breaths);
            let arcs = match camera.rotation() {
                Rotation::StepAndShoot => 0.0,
                Rotation::Continuous => 8.0 * arcs(self.points()) as f64,
            };
            return n_views as f64 * (ways.min(pairs) + arcs);
        }
        let of_view = match (self, camera.rotation()) {
            (Acquisition::Instants, _) | (Acquisition::Static { .. }, Rotation::StepAndShoot) => {
                return 0.0;
            }
            (Acquisition::Static { .. }, Rotation::Continuous) => points,
            // Each arc sees what the beat goes through in it, and never more than all levels.
            (_, Rotation::Continuous) => {
                let arcs = arcs(self.points()) as f64;
                arcs * (0.5 * points).min(beats * points / arcs + 2.0)
            }
            // Whole beats share their phases, the rest has its own.
            (_, Rotation::StepAndShoot) => points * beats.min(2.0),
        };
        n_views as f64 * of_view
    }
}

/// An even number of at least this many steps, and at least 2.
pub(crate) fn even(steps: f64) -> usize {
    // Not more than 2^16 a beat: `validate` has seen the points.
    (2.0 * (steps / 2.0 - NO_TIME).ceil().max(1.0)).min(1e9) as usize
}

/// Arcs of a whole view of a turning camera: as many as a beat has levels, for about the same way from one to the next.
pub(crate) fn arcs(points: usize) -> usize {
    even(0.25 * points as f64).max(ARCS)
}
