//! Validation of acquisitions and estimates of their work.

use super::acquisition::{Acquisition, TruthOf};
use super::levels::Interpolation;
use super::settings::{Mode, Rotation};
use crate::error::{PhantomError, check, check_count};
use crate::model::RespiratoryMotion;
use crate::ranges;
use crate::{Camera, Cycle};

/// What [`Acquisition::validate`] counts: each is a projection of the heart.
pub(crate) const POINTS: &str = "quadrature points of all views";
/// Largest number of points of all views.
const MAX_POINTS_OF_ALL: usize = 1 << 24;
/// Largest number of heartbeats and breaths of all views: each is divided into intervals. It is the number in a day.
const MOST_CYCLES: usize = 120_000;
/// Fewest and most steps per cycle for a tolerance.
pub(crate) const STEPS: [usize; 2] = [8, ranges::STEPS[1]];
/// Smallest number of arcs of a whole view in continuous rotation.
const ARCS: f64 = 32.0;
/// Smaller fractions of a cycle are rounding.
const NO_TIME: f64 = 1e-9;

impl Acquisition {
    /// Whether all views have the same phases with the same weights.
    pub(crate) fn same_for_all_views(&self, cycle: &Cycle, camera: &Camera) -> bool {
        if self.in_real_time(cycle) {
            return false;
        }
        match self.mode {
            Mode::Static { .. } => true,
            Mode::WholeCycle | Mode::Gated { .. } => camera.rotation() == Rotation::StepAndShoot,
            Mode::Instants | Mode::Exposure { .. } => false,
        }
    }

    /// Whether views are acquired in real time, regardless of the rotation.
    pub(crate) fn in_real_time(&self, cycle: &Cycle) -> bool {
        match self.mode {
            // Without a heartbeat, R-R intervals have no effect.
            Mode::Static { .. } => cycle.breathing().is_some(),
            _ => cycle.in_real_time(),
        }
    }

    /// Returns the time average that the ground truth represents.
    pub(crate) fn truth_of(&self, cycle: &Cycle, camera: &Camera) -> TruthOf {
        if self.in_real_time(cycle) {
            return TruthOf::MeanOfViews;
        }
        let beats = self.lasts(camera) / cycle.period();
        let whole = beats >= 1.0 && (beats - beats.round()).abs() <= NO_TIME;
        let start = |view_idx| self.window(cycle, camera, view_idx)[0];
        let same = |view_idx| start(view_idx) == start(0);
        if self.same_for_all_views(cycle, camera) || whole || (1..camera.n_views()).all(same) {
            TruthOf::EachView
        } else {
            TruthOf::MeanOfViews
        }
    }

    /// Returns the number of arcs of a whole view in continuous rotation.
    pub(super) fn arcs(&self) -> f64 {
        match self.mode {
            Mode::Static { .. } => self.points[0] as f64,
            // As many as there are levels between smallest and largest volume, for a similar spacing.
            _ => (0.25 * self.points[0] as f64).max(ARCS),
        }
    }

    /// Validates the acquisition before any work. `rotation` is that of the camera, or step and shoot for results that do not depend on its angles.
    pub(crate) fn validate(
        &self,
        cycle: &Cycle,
        camera: &Camera,
        rotation: Rotation,
    ) -> Result<(), PhantomError> {
        if let Mode::Static { phase } = self.mode {
            check("phase", phase, ranges::PHASE)?;
        }
        if let (Mode::WholeCycle, Rotation::Continuous) = (self.mode, camera.rotation())
            && !self.in_real_time(cycle)
        {
            let what = "interval of a turning camera";
            check(what, camera.interval(), [cycle.period(), 1e9])?;
        }
        if self.in_real_time(cycle) {
            let views = camera.n_views() as f64 * self.lasts(camera);
            let breaths = |motion: &RespiratoryMotion| views / motion.breathing().period;
            let cycles = views / cycle.period() + cycle.breathing().map_or(0.0, breaths);
            let what = "heartbeats and breaths during all views";
            check_count(what, cycles as usize, [0, MOST_CYCLES])?;
        }
        if let Some(view_idx) = self.unseen(cycle, camera) {
            let [gate, _] = self.gate;
            return Err(PhantomError::EmptyView { gate, view_idx });
        }
        let points = self.points_of_all(cycle, camera, rotation);
        check_count(POINTS, points as usize, [0, MAX_POINTS_OF_ALL]).map(drop)
    }

    /// Returns the first view during which the gate, or an accepted beat, does not occur.
    fn unseen(&self, cycle: &Cycle, camera: &Camera) -> Option<usize> {
        let may_miss = match self.in_real_time(cycle) {
            true => self.lasts(camera) > 0.0,
            // Every beat contains the gate.
            false => {
                matches!(self.mode, Mode::Gated { .. })
                    && camera.rotation() == Rotation::Continuous
                    && camera.interval() < cycle.period()
            }
        };
        let misses = |view_idx: &usize| self.seconds(cycle, camera, *view_idx)[0] == 0.0;
        (0..camera.n_views()).find(|view_idx| may_miss && misses(view_idx))
    }

    /// Returns an upper limit on the points of all views, before equal points are merged, with those of the coarse rule: in
    /// continuous rotation half as many again.
    pub(crate) fn points_of_all(&self, cycle: &Cycle, camera: &Camera, rotation: Rotation) -> f64 {
        let n_views = match self.same_for_all_views(cycle, camera) {
            true => 1,
            false => camera.n_views(),
        };
        let [points, of_breath] = self.points.map(|points| points as f64);
        let [levels, rows] = [points, of_breath].map(|points| 0.5 * points + 1.0);
        let (beats, arcs) = (self.lasts(camera) / cycle.period(), 2.0 * self.arcs());
        // Levels crossed during the view, and all levels; with respiration pairs of levels, of which a path crosses two rows.
        let (crossed, all) = match cycle.breathing() {
            None => (points * (1.0 + beats), levels),
            Some(motion) => {
                let breaths = self.lasts(camera) / motion.breathing().period;
                let crossed = 2.0 * (points + of_breath) * (1.0 + beats + breaths);
                (crossed, levels * rows)
            }
        };
        let of_view = match (self.mode, rotation) {
            (Mode::Instants, _) => 0.0,
            (Mode::Static { .. }, Rotation::StepAndShoot) if cycle.breathing().is_none() => 0.0,
            (_, Rotation::StepAndShoot) => crossed.min(all),
            // Each level from each angle.
            (mode, Rotation::Continuous) if self.interpolation == Interpolation::Polynomial => {
                let is_static = matches!(mode, Mode::Static { .. });
                let states = match cycle.breathing() {
                    Some(_) => all,
                    None if is_static => 1.0,
                    None => levels,
                };
                levels * states
            }
            (Mode::Static { .. }, Rotation::Continuous) if cycle.breathing().is_none() => {
                2.0 * points
            }
            (_, Rotation::Continuous) => 1.5 * (crossed + arcs).min(arcs * all),
        };
        n_views as f64 * of_view
    }
}
