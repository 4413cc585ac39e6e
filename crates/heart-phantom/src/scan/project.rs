//! What a view shows of one shape of the heart: line integrals of all that there is.

use super::whole::Scan;
use crate::HeartShape;
use crate::error::PhantomError;
use crate::model::Attenuation;
use revolve_voxel::{Body, Capsule, ParallelRays, RayCounters, Sector};
use std::ops::Range;

/// The rays of a view: from where, through which planes, in which rows.
pub(super) struct Aim<'a> {
    pub(super) theta: f64,
    pub(super) planes: &'a [f64],
    pub(super) rows: &'a Range<usize>,
}

/// A shape of the heart, as a body that stands where it does now, and its defects.
type Standing<'a> = (&'a HeartShape, &'a Body, &'a [(usize, Sector, f64)]);

impl Scan<'_> {
    /// What weakens the rays, if anything does: where all coefficients are zero, views have the bits of lines.
    fn medium(&self) -> Option<&Attenuation> {
        let organs = self.organs.iter().flat_map(|organs| organs.as_slice());
        let around = organs.fold(0.0, |most: f64, organ| most.max(organ.attenuation));
        (self.attenuation.as_ref()).filter(|own| own.coefficient.max(around) > 0.0)
    }

    /// The rays of a view, one set for each place that they have in their bins.
    fn rays<'b>(
        &'b self,
        aim: &'b Aim<'b>,
    ) -> impl Iterator<Item = Result<ParallelRays, PhantomError>> + 'b {
        let detector = self.camera.detector();
        let (pitch, offset) = (detector.pitch(), detector.offset());
        self.lattice.iter().map(move |place| {
            let at = [0, 1].map(|axis| offset[axis] + place[axis] * pitch[axis]);
            let rays = detector.with_offset(at)?.rays(aim.theta)?;
            Ok(rays.with_planes(aim.planes)?.rows(aim.rows.clone())?)
        })
    }

    /// Adds `weight` times the line integrals of all that there is, with the heart in this shape and its defects; but for organs along
    /// rays that pass `capsule` by ([`Self::project_past`]).
    pub(super) fn project(
        &self,
        heart: Standing<'_>,
        aim: &Aim<'_>,
        capsule: Option<&Capsule>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let weight = weight / self.lattice.len() as f64;
        let mut done = RayCounters::default();
        for rays in self.rays(aim) {
            done = done + self.project_once(heart, &rays?, capsule, weight, target)?;
        }
        Ok(done)
    }

    fn project_once(
        &self,
        (shape, body, defects): Standing<'_>,
        rays: &ParallelRays,
        capsule: Option<&Capsule>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let [cavity, wall] = self.activity.of(shape);
        // The torso is everywhere, the heart what differs from it.
        let around = (self.background).map_or(0.0, |background| background.concentration);
        let activity = [cavity - around, wall - around];
        let attenuator = (self.medium())
            .map(|medium| medium.of(body, self.organs))
            .transpose()?;
        if let Some(background) = &self.background {
            let (torso, amount) = (background.torso, weight * background.concentration);
            torso.project_add(rays, amount, attenuator.as_ref(), target)?;
        }
        let mut done = match &attenuator {
            None => body.project_add(rays, &activity, weight, target)?,
            Some(medium) => body.project_attenuated_add(rays, &activity, weight, medium, target)?,
        };
        for (_, sector, factor) in defects {
            let sector = sector.standing(*body.pose());
            let difference = weight * factor * wall;
            done = done + sector.project_add(rays, difference, attenuator.as_ref(), target)?;
        }
        if let (Some(organs), Some(capsule)) = (self.organs, capsule) {
            let own = self.medium().map(|medium| medium.coefficient);
            done = done + organs.project_around_add(body, capsule, rays, weight, own, target)?;
        }
        Ok(done)
    }

    /// Adds `weight` times the line integrals of organs along the rays that pass by a capsule in which the heart is: they are the same
    /// in all its shapes.
    pub(super) fn project_past(
        &self,
        aim: &Aim<'_>,
        capsule: &Capsule,
        weight: f64,
        target: &mut [f32],
    ) -> Result<(), PhantomError> {
        let Some(organs) = self.organs else {
            return Ok(());
        };
        let weight = weight / self.lattice.len() as f64;
        for rays in self.rays(aim) {
            let weakened = self.medium().is_some();
            organs.project_past_add(capsule, &rays?, weight, weakened, target)?;
        }
        Ok(())
    }
}
