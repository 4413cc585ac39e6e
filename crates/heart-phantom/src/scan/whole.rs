//! The complete input of projections and ground truth.

use super::acquisition::Acquisition;
use super::imaging::Imaging;
use super::time_rule::TimeRule;
use crate::error::PhantomError;
use crate::model::{Placed, Surroundings};
use crate::{
    Activity, Attenuation, Background, Camera, Cycle, Defect, Heart, HeartShape, Rotation, Twist,
};
use nalgebra::Point3;
use revolve_voxel::{Organs, Pose};
use std::f64::consts::PI;
use std::sync::{Arc, Mutex};

/// The projected part of an acquisition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Projected {
    All,
    /// The change by the heart relative to its surroundings.
    Heart,
    /// The surroundings as if there were no heart.
    Surroundings,
}

/// An acquisition of which any part can be computed, bitwise identical to the same part of the whole.
#[derive(Clone)]
pub(crate) struct Scan<'a> {
    pub(crate) heart: &'a Heart,
    pub(crate) camera: &'a Camera,
    pub(crate) cycle: &'a Cycle,
    pub(crate) acquisition: Acquisition,
    pub(crate) activity: Activity,
    pub(crate) attenuation: Option<Attenuation>,
    pub(crate) defects: &'a [Defect],
    /// The defects of shapes that the heart keeps.
    pub(crate) placed: &'a Mutex<Placed>,
    /// Twist of the wall at end-systole.
    pub(crate) twist: Option<&'a Twist>,
    pub(crate) background: Option<Background>,
    pub(crate) organs: Option<&'a Organs>,
    /// The same objects around the heart, as projections need them.
    pub(crate) surroundings: &'a Surroundings,
    /// Response and bin averages, unless samples are line integrals.
    pub(crate) imaging: Option<&'a Imaging>,
    pub(crate) projected: Projected,
}

/// A shape and a respiratory position with the fraction of time that they represent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lasting {
    pub(crate) gain: f64,
    pub(crate) breath: f64,
    /// Fraction of the time of all views.
    pub(crate) share: f64,
}

impl Scan<'_> {
    /// Returns the defects in each shape. Checks that the background surrounds all shapes, because they are subtracted from it.
    pub(crate) fn placed(&self, shapes: &[Arc<HeartShape>]) -> Result<Placed, PhantomError> {
        if let Some(background) = &self.background {
            let mut poses = vec![*self.heart.pose()];
            if self.cycle.breathing().is_some() {
                poses.extend([self.pose(0.5)?, self.pose(1.0)?]);
            }
            for pose in poses {
                background.check_surrounds(shapes, pose)?;
            }
        }
        let twist = |gain: f64| Some(self.twist?.scaled(self.cycle.emptied(gain)));
        let defects = (self.defects, twist);
        Placed::new(self.heart, defects, shapes, self.placed)
    }

    /// Clamps negative rounding residue to zero. Subtraction leaves such residue: of the surroundings, of the wall, or of attenuated lines
    /// and slabs, where the wall is outer minus inner membrane. Chords themselves are never negative, but the change by the heart may be.
    pub(crate) fn no_negatives(&self, samples: &mut [f32]) {
        if self.projected != Projected::Heart {
            let samples = samples.iter_mut();
            samples.for_each(|sample| *sample = sample.max(0.0));
        }
    }

    /// Returns the pose at a respiratory position.
    pub(crate) fn pose(&self, breath: f64) -> Result<Pose, PhantomError> {
        self.cycle.moved(self.heart.pose(), breath)
    }

    /// Returns the quadrature of the views.
    pub(super) fn quadrature(&self) -> TimeRule<'_> {
        self.rule(self.camera.rotation())
    }

    /// The same volumes and respiratory fractions, without the angles of the camera.
    pub(super) fn rule_of_states(&self) -> TimeRule<'_> {
        self.rule(Rotation::StepAndShoot)
    }

    fn rule(&self, rotation: Rotation) -> TimeRule<'_> {
        let middle = Point3::new(0.5 * self.heart.length(), 0.0, 0.0);
        let at = |breath| self.pose(breath).map(|pose| pose.to_lab(&middle));
        let shift = match (self.cycle.breathing(), at(0.0), at(1.0)) {
            (Some(_), Ok(from), Ok(to)) => (to - from).norm(),
            _ => 0.0,
        };
        let volume = self.heart.pair().inner().start_measures().volume;
        let radius = (0.75 / PI * volume).cbrt();
        let (acquisition, cycle, camera) = (self.acquisition, self.cycle, self.camera);
        TimeRule::new(acquisition, cycle, camera, rotation, shift / radius)
    }
}
