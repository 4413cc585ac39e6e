//! What a view shows of one shape of the heart: line integrals of all that there is.

use super::whole::Scan;
use crate::HeartShape;
use crate::error::PhantomError;
use crate::model::Attenuation;
use revolve_voxel::{Attenuator, Body, Medium, Organs, ParallelRays, RayCounters, Sector};
use std::ops::Range;
use std::sync::Arc;

/// The rays of a view: angle, planes between slabs, rows, and places in each bin.
#[derive(Clone, Copy)]
pub(super) struct Aim<'a> {
    pub(super) theta: f64,
    pub(super) planes: &'a [f64],
    pub(super) rows: &'a Range<usize>,
    /// From the centre of the bin in units of its sides; the mean over all is added.
    pub(super) places: &'a [[f64; 2]],
    /// `[row][bin]` of the rows: the bins that are projected, if not all.
    pub(super) mask: Option<&'a Arc<[bool]>>,
}

/// The ray through the centre of each bin.
pub(super) const CENTRE: &[[f64; 2]] = &[[0.0; 2]];

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
        aim.places.iter().map(move |place| {
            let at = [0, 1].map(|axis| offset[axis] + place[axis] * pitch[axis]);
            let rays = detector.with_offset(at)?.rays(aim.theta)?;
            let rays = rays.with_planes(aim.planes)?.rows(aim.rows.clone())?;
            Ok(match aim.mask {
                Some(mask) => rays.with_mask(Arc::clone(mask))?,
                None => rays,
            })
        })
    }

    /// Adds `weight` times the line integrals of what the heart in this shape, with its defects, adds to its surroundings
    /// ([`Self::project_surroundings`]).
    pub(super) fn project(
        &self,
        heart: Standing<'_>,
        aim: &Aim<'_>,
        weight: f64,
        target: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        let weight = weight / aim.places.len() as f64;
        let mut done = RayCounters::default();
        for rays in self.rays(aim) {
            done = done + self.project_once(heart, &rays?, weight, target)?;
        }
        Ok(done)
    }

    fn project_once(
        &self,
        (shape, body, defects): Standing<'_>,
        rays: &ParallelRays,
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
        if let (Some(background), false) = (&self.background, self.is_background_fixed()) {
            let (torso, amount) = (background.torso()?, weight * background.concentration);
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
        if let Some(organs) = self.active_organs() {
            let own = self.medium().map(|medium| medium.coefficient);
            done = done + organs.project_replaced_add(body, rays, weight, own, target)?;
        }
        Ok(done)
    }

    fn active_organs(&self) -> Option<&Organs> {
        self.organs.filter(|organs| organs.is_active())
    }

    /// Whether no shape of the heart changes the background beside it: the heart does not attenuate other than the torso.
    fn is_background_fixed(&self) -> bool {
        self.medium().is_none_or(|medium| medium.torso().is_some())
    }

    /// Whether there is anything active that is the same for all shapes of the heart.
    pub(super) fn has_surroundings(&self) -> bool {
        (self.background.is_some() && self.is_background_fixed()) || self.active_organs().is_some()
    }

    /// Adds `weight` times the line integrals of what surrounds the heart, as if there were no heart: they are the same for all its shapes.
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
        let background = self.background.filter(|_| self.is_background_fixed());
        for rays in self.rays(aim) {
            let rays = rays?;
            if let Some(background) = &background {
                let (torso, amount) = (background.torso()?, weight * background.concentration);
                torso.project_add(&rays, amount, attenuator.as_ref(), target)?;
            }
            if let Some(organs) = self.active_organs() {
                organs.project_add(&rays, weight, medium.is_some(), target)?;
            }
        }
        Ok(())
    }
}
