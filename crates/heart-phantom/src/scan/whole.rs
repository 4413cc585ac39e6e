//! What there is to see, and how: all that views and volumes are made from.

use super::acquisition::Acquisition;
use super::depth::Depth;
use super::time_rule::TimeRule;
use crate::error::PhantomError;
use crate::model::{Activity, Attenuation, Background, Defect, Placed};
use crate::{Camera, Cycle, Heart, HeartShape, Twist};
use revolve_voxel::{Organs, Pose};
use std::sync::Arc;

/// An acquisition of which any part can be taken, each with the bits that it has in the whole.
#[derive(Clone)]
pub(crate) struct Scan<'a> {
    pub(crate) heart: &'a Heart,
    pub(crate) camera: &'a Camera,
    pub(crate) cycle: &'a Cycle,
    pub(crate) acquisition: Acquisition,
    pub(crate) activity: Activity,
    pub(crate) attenuation: Option<Attenuation>,
    pub(crate) defects: &'a [Defect],
    /// How the wall is twisted at end-systole.
    pub(crate) twist: Option<&'a Twist>,
    pub(crate) background: Option<Background>,
    pub(crate) organs: Option<&'a Organs>,
    /// How far the defects' layers may be from where they are, cm.
    pub(crate) tolerance: f64,
    /// Response and averages over bins, if samples are more than line integrals; then `camera` is the one on whose sub-bins they are computed.
    pub(crate) depth: Option<&'a Depth>,
}

/// A volume of the cavity at a place of the breath, and how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lasting {
    pub(crate) gain: f64,
    pub(crate) breath: f64,
    /// Share of the time of all views.
    pub(crate) share: f64,
}

impl Scan<'_> {
    /// The defects in each of some distinct shapes, all of which the background surrounds: from it they are taken away.
    pub(crate) fn placed(&self, shapes: &[Arc<HeartShape>]) -> Result<Placed, PhantomError> {
        if let Some(background) = &self.background {
            let mut standing = vec![*self.heart.pose()];
            if self.cycle.breathing().is_some() {
                standing.extend([self.pose(0.5)?, self.pose(1.0)?]);
            }
            for pose in standing {
                background.check_surrounds(shapes, pose)?;
            }
        }
        let twist = |gain: f64| {
            let twist = self.twist?;
            Some(twist.scaled(self.cycle.emptied(gain)))
        };
        Placed::new(self.heart, (self.defects, twist), self.tolerance, shapes)
    }

    /// Where something is taken away that is there, as much as there is, rounding may leave less than nothing: of what is around the heart, of
    /// its wall, or of weakened lines and of slabs, whose wall is what the outer membrane holds less what the inner one does. Chords as they
    /// are round to no less than nothing.
    pub(crate) fn no_negatives(&self, samples: &mut [f32]) {
        let replaced = self.background.is_some() || self.organs.is_some();
        let weakened = self.attenuation.is_some() || self.depth.is_some();
        if replaced || weakened || !self.defects.is_empty() {
            samples
                .iter_mut()
                .for_each(|sample| *sample = sample.max(0.0));
        }
    }

    /// Where the heart stands when the breath has come so far.
    pub(crate) fn pose(&self, breath: f64) -> Result<Pose, PhantomError> {
        self.cycle.moved(self.heart.pose(), breath)
    }

    /// The points over which views are averaged.
    pub(super) fn quadrature(&self) -> TimeRule<'_> {
        TimeRule::new(self.acquisition, self.cycle, self.camera)
    }
}
