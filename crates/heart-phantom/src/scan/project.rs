//! Line integrals of all objects for one shape of the heart.

use super::whole::{Projected, Scan};
use crate::HeartShape;
use crate::error::PhantomError;
use crate::model::Attenuation;
use revolve_voxel::{
    Attenuator, Body, Lines, Medium, Organs, ParallelDetector, ParallelRays, Ray, RayCounters,
    Rays, Sector,
};
use std::ops::Range;
use std::sync::Arc;

/// The rays of a view: number, angle, planes between slabs, rows, and positions in each bin.
#[derive(Clone, Copy)]
pub(super) struct Aim<'a> {
    pub(super) view_idx: usize,
    pub(super) theta: f64,
    pub(super) planes: &'a [f64],
    /// From which bin to which.
    pub(super) bins: [usize; 2],
    pub(super) rows: &'a Range<usize>,
    /// Positions from the centre of the bin in units of its sides; their average is added.
    pub(super) places: &'a [[f64; 2]],
    /// The projected bins, `[row][bin]` of the rows; `None` for all.
    pub(super) mask: Option<&'a Arc<[bool]>>,
}

/// The ray through the centre of each bin.
pub(super) const CENTRE: &[[f64; 2]] = &[[0.0; 2]];

/// The rays of a view.
pub(super) enum ViewRays {
    Parallel(ParallelRays),
    Lines(Lines),
}

impl ViewRays {
    pub(super) fn ray(&self, bin: usize, row: usize) -> Option<Ray> {
        match self {
            Self::Parallel(rays) => rays.ray(bin, row),
            Self::Lines(lines) => lines.ray(bin, row),
        }
    }
}

/// A shape of the heart, its body in its pose, and its defects.
pub(super) type Placement<'a> = (&'a HeartShape, &'a Body, &'a [(usize, Sector, f64)]);

impl Scan<'_> {
    /// Returns the attenuation, if any coefficient is positive; otherwise views are bitwise identical to line integrals.
    fn medium(&self) -> Option<&Attenuation> {
        let organs = self.organs.iter().flat_map(|organs| organs.as_slice());
        let around = organs.fold(0.0, |most: f64, organ| most.max(organ.attenuation));
        (self.attenuation.as_ref()).filter(|own| own.coefficient.max(around) > 0.0)
    }

    /// Returns the rays of a view, one set per position in the bins.
    pub(super) fn rays<'b>(
        &'b self,
        aim: &'b Aim<'b>,
    ) -> impl Iterator<Item = Result<ViewRays, PhantomError>> + 'b {
        let detector = self.camera.detector();
        let (pitch, mut offset) = (detector.pitch(), detector.offset());
        let [from, to] = aim.bins;
        offset[0] += 0.5 * ((from + to) as f64 - detector.n_bins() as f64) * pitch[0];
        aim.places.iter().map(move |place| {
            let at = [0, 1].map(|axis| offset[axis] + place[axis] * pitch[axis]);
            let raster = ParallelDetector::new(to - from, detector.n_rows(), pitch)?;
            let raster = raster.with_offset(at)?;
            if let Some(geometry) = self.camera.ray_geometry() {
                let lines = geometry.lines_on(&raster, aim.view_idx)?;
                let lines = lines.rows(aim.rows.clone())?;
                return Ok(ViewRays::Lines(match aim.mask {
                    Some(mask) => lines.with_mask(Arc::clone(mask))?,
                    None => lines,
                }));
            }
            let rays = raster.rays(aim.theta)?;
            let rays = rays.with_planes(aim.planes)?.rows(aim.rows.clone())?;
            Ok(ViewRays::Parallel(match aim.mask {
                Some(mask) => rays.with_mask(Arc::clone(mask))?,
                None => rays,
            }))
        })
    }

    /// Adds `weight` times the line integrals of the difference between heart with defects and its surroundings
    /// ([`Self::project_surroundings`]).
    pub(super) fn project(
        &self,
        heart: Placement<'_>,
        aim: &Aim<'_>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let weight = weight / aim.places.len() as f64;
        let mut done = RayCounters::default();
        for rays in self.rays(aim) {
            done = done
                + match &rays? {
                    ViewRays::Parallel(rays) => self.project_once(heart, rays, weight, target)?,
                    ViewRays::Lines(lines) => self.project_once(heart, lines, weight, target)?,
                };
        }
        Ok(done)
    }

    fn project_once(
        &self,
        (shape, body, defects): Placement<'_>,
        rays: &impl Rays,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let [cavity, wall] = self.activity.of(shape);
        // The torso is everywhere; the heart adds the difference.
        let around = (self.background).map_or(0.0, |background| background.concentration);
        let activity = [cavity - around, wall - around];
        let attenuator = (self.medium())
            .map(|medium| medium.of(body, self.organs))
            .transpose()?;
        if let (Some(background), false) = (&self.background, self.is_background_fixed()) {
            let (torso, amount) = (background.torso()?, weight * background.concentration);
            torso.project_add(rays, amount, attenuator.as_ref(), target)?;
        }
        let mut done = match &attenuator {
            None => body.project_add(rays, &activity, weight, target)?,
            Some(medium) => body.project_attenuated_add(rays, &activity, weight, medium, target)?,
        };
        for (_, sector, factor) in defects {
            let sector = sector.with_pose(*body.pose());
            let difference = weight * factor * wall;
            done = done + sector.project_add(rays, difference, attenuator.as_ref(), target)?;
        }
        if let Some(organs) = self.active_organs() {
            let own = self.medium().map(|medium| medium.coefficient);
            done = done + organs.project_replaced_add(body, rays, weight, own, target)?;
        }
        Ok(done)
    }

    fn active_organs(&self) -> Option<&Organs> {
        self.organs.filter(|organs| organs.is_active())
    }

    /// Whether the heart changes the projection of what is behind it.
    pub(super) fn changes_behind(&self) -> bool {
        self.active_organs().is_some() && self.medium().is_some()
    }

    /// Whether no shape of the heart changes the background beside it: the heart does not attenuate other than the torso.
    pub(super) fn is_background_fixed(&self) -> bool {
        self.medium().is_none_or(|medium| medium.torso().is_some())
    }

    /// Whether there is anything active that is the same for all shapes of the heart.
    pub(crate) fn has_surroundings(&self) -> bool {
        if self.projected == Projected::Heart {
            return false;
        }
        (self.background.is_some() && self.is_background_fixed()) || self.active_organs().is_some()
    }

    /// Adds `weight` times the line integrals of the surroundings without the heart; they are the same for all its shapes.
    pub(super) fn project_surroundings(
        &self,
        aim: &Aim<'_>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<(), PhantomError> {
        let weight = weight / aim.places.len() as f64;
        let medium = self.medium();
        let torso = medium.and_then(|medium| Some((medium.coefficient, medium.torso()?)));
        let attenuator = torso
            .map(|(mu, torso)| Attenuator::new(mu, Medium::Torso(torso)))
            .transpose()?;
        for rays in self.rays(aim) {
            match &rays? {
                ViewRays::Parallel(rays) => {
                    self.surroundings_once(rays, weight, attenuator.as_ref(), target)?;
                }
                ViewRays::Lines(lines) => {
                    self.surroundings_once(lines, weight, attenuator.as_ref(), target)?;
                }
            }
        }
        Ok(())
    }

    fn surroundings_once(
        &self,
        rays: &impl Rays,
        weight: f64,
        attenuator: Option<&Attenuator<'_>>,
        target: &mut [f32],
    ) -> Result<(), PhantomError> {
        if let Some(background) = self.background.filter(|_| self.is_background_fixed()) {
            let (torso, amount) = (background.torso()?, weight * background.concentration);
            torso.project_add(rays, amount, attenuator, target)?;
        }
        if let Some(organs) = self.active_organs() {
            organs.project_add(rays, weight, self.medium().is_some(), target)?;
        }
        Ok(())
    }
}
