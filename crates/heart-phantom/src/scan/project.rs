//! Projections of all objects for one shape of the heart: line integrals, and images behind a response.

use super::whole::{Projected, Scan};
use crate::HeartShape;
use crate::error::PhantomError;
use revolve_voxel::{Assembly, Body, Lines, RayCounters, Sector, Shown};
use std::ops::Range;

/// A shape of the heart, its body in its pose, and its defects.
pub(super) type Placement<'a> = (&'a HeartShape, &'a Body, &'a [(usize, Sector, f64)]);

impl Scan<'_> {
    /// Returns the rays of a view at an angle through the centres of the bins of some rows.
    pub(super) fn rays(
        &self,
        (view_idx, theta): (usize, f64),
        rows: &Range<usize>,
    ) -> Result<Lines, PhantomError> {
        let detector = self.camera.detector();
        let lines = match self.camera.ray_geometry() {
            Some(geometry) => geometry.lines_on(detector, view_idx)?,
            None => detector.rays(theta)?,
        };
        Ok(lines.rows(rows.clone())?)
    }

    /// Adds `weight` times the line integrals of the change by the heart with its defects.
    pub(super) fn project(
        &self,
        heart: Placement<'_>,
        at: (usize, f64),
        rows: &Range<usize>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let rays = &self.rays(at, rows)?;
        let Some(around) = self.surroundings.even() else {
            let assembly = self.assembly(heart)?;
            return Ok(assembly.project_add(rays, Shown::Change, weight, target)?);
        };
        let (shape, body, defects) = heart;
        let [cavity, wall] = self.activity.of(shape);
        let activity = [cavity - around, wall - around];
        let mut done = body.project_add(rays, &activity, weight, target)?;
        for (_, sector, factor) in defects {
            let sector = sector.with_pose(*body.pose());
            done = done + sector.project_add(rays, weight * factor * wall, target)?;
        }
        Ok(done)
    }

    /// Returns the heart in its surroundings.
    pub(super) fn assembly<'a>(
        &'a self,
        (shape, body, defects): Placement<'a>,
    ) -> Result<Assembly<'a>, PhantomError> {
        let (activity, around) = (self.activity.of(shape), self.surroundings);
        let sectors = (defects.iter())
            .map(|(_, sector, factor)| (sector.with_pose(*body.pose()), factor * activity[1]))
            .collect();
        let assembly = (around.alone()).with_body(body, &activity, around.heart)?;
        Ok(assembly.with_sectors(sectors)?)
    }

    /// Whether the surroundings contain activity that is the same for all shapes of the heart.
    pub(crate) fn has_surroundings(&self) -> bool {
        self.projected != Projected::Heart && self.surroundings.is_active()
    }

    /// Adds `weight` times the line integrals of the surroundings without the heart; they are the same for all its shapes.
    pub(super) fn project_surroundings(
        &self,
        at: (usize, f64),
        rows: &Range<usize>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let rays = self.rays(at, rows)?;
        let alone = self.surroundings.alone();
        Ok(alone.project_add(&rays, Shown::Organs, weight, target)?)
    }
}
