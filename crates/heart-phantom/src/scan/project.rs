//! What a view shows of one shape of the heart: line integrals of all that there is.

use super::views::Scan;
use crate::HeartShape;
use crate::error::PhantomError;
use revolve_voxel::{Body, ParallelRays, RayCounters, Sector};

impl Scan<'_> {
    /// Adds `weight` times the line integrals of all that there is, with the heart in this shape, as a body that stands where it does now,
    /// and its defects.
    pub(super) fn project(
        &self,
        (shape, body, defects): (&HeartShape, &Body, &[(usize, Sector, f64)]),
        rays: &ParallelRays,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let [cavity, wall] = self.activity.of(shape);
        // The torso is everywhere, the heart what differs from it.
        let around = (self.background).map_or(0.0, |background| background.concentration);
        let activity = [cavity - around, wall - around];
        let attenuator = (self.attenuation.as_ref())
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
        if let Some(organs) = self.organs.filter(|organs| organs.is_active()) {
            organs.project_around_add(body, rays, weight, attenuator.as_ref(), target)?;
        }
        Ok(done)
    }
}
