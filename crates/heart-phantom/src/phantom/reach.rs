//! Extent of all objects: from the axis, along the axis, and towards the camera in each view.

use super::Phantom;
use super::warnings::{span, turned};
use crate::error::PhantomError;
use crate::once::once;
use crate::scan::Facing;
use crate::{Orbit, Rotation, ranges};
use revolve_voxel::{Body, Organ, OrganShape};

/// Returns the extent of the cross-section of an organ or torso, an ellipse, along a direction.
pub(super) fn extent(shape: &OrganShape, [u, v]: [f64; 2]) -> [f64; 2] {
    let ([x, y, _], [a, b, _]) = shape.bounds();
    let (middle, half) = (x * u + y * v, (a * u).hypot(b * v));
    [middle - half, middle + half]
}

impl Phantom {
    /// Returns the distance of the collimator face from the axis of rotation in each view, cm.
    ///
    /// ```
    /// use heart_phantom::{Orbit, Phantom, Scene};
    /// let mut scene = Scene::default().with_size(32);
    /// scene.camera.radius = Orbit::Contour { gap: 1.0 };
    /// let phantom = Phantom::new(scene)?;
    /// let radii = phantom.radii()?;
    /// assert!(radii.len() == 90 && radii.iter().all(|radius| (4.0..9.0).contains(radius)));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// For [`Orbit::Contour`], errors of the solver.
    pub fn radii(&self) -> Result<Vec<f64>, PhantomError> {
        if self.parts.nominal_radii().is_none() {
            self.facing()?;
        }
        Ok(self.known_radii().unwrap_or_default())
    }

    /// Returns these distances, if they are known without a shape of the heart.
    pub(super) fn known_radii(&self) -> Option<Vec<f64>> {
        let known = || Some(self.facing.get()?.iter().map(|view| view.radius).collect());
        self.parts.nominal_radii().or_else(known)
    }

    /// Returns the collimator face and the objects in front of it, for each view.
    pub(super) fn facing(&self) -> Result<&[Facing], PhantomError> {
        let facing = once(&self.facing, || {
            let bodies = self.outermost()?;
            let torso = self.scene().attenuates().and_then(|own| own.torso());
            let sources = self.parts.surroundings.sources();
            let around: Vec<Organ> = torso.iter().chain(sources).copied().collect();
            (0..self.camera().n_views())
                .map(|view_idx| self.facing_of(view_idx, &bodies, &around))
                .collect()
        });
        Ok(facing?)
    }

    /// The view in which the collimator face overlaps an object most deeply.
    pub(super) fn inside(&self) -> Result<Option<(usize, Facing)>, PhantomError> {
        let within = |view: &Facing| view.body - view.radius;
        let worst = (self.facing()?.iter().copied().enumerate())
            .max_by(|(_, a), (_, b)| within(a).total_cmp(&within(b)));
        // Overlaps within rounding do not count.
        Ok(worst.filter(|(_, view)| within(view) > 1e-9 * view.radius))
    }

    fn facing_of(
        &self,
        view_idx: usize,
        bodies: &[Body],
        around: &[Organ],
    ) -> Result<Facing, PhantomError> {
        let camera = self.camera();
        let shares: &[f64] = match camera.rotation() {
            Rotation::StepAndShoot => &[0.5],
            Rotation::Continuous => &[0.0, 0.25, 0.5, 0.75, 1.0],
        };
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut own, mut seen, mut body) = (nothing, nothing, f64::NEG_INFINITY);
        for share in shares {
            let theta = camera.angle(view_idx, *share);
            let turned = (bodies.iter())
                .map(|body| turned(body, theta))
                .collect::<Result<Vec<_>, _>>()?;
            let heart = span(&turned, 1)?;
            own = [own[0].min(heart[0]), own[1].max(heart[1])];
            let (sin, cos) = theta.sin_cos();
            let others = around
                .iter()
                .map(|organ| (extent(&organ.shape, [-sin, cos]), organ.activity > 0.0));
            for ([low, high], active) in others.chain([(heart, true)]) {
                body = body.max(high);
                if active {
                    seen = [seen[0].min(low), seen[1].max(high)];
                }
            }
        }
        let theta = camera.geometry().angles()[view_idx];
        let radius = match self.scene().camera.radius {
            // A radius must be positive.
            Orbit::Contour { gap } => (body + gap).max(ranges::SIZE[0]),
            ref orbit => orbit.radius(view_idx, theta).unwrap_or_default(),
        };
        Ok(Facing {
            radius,
            heart: own,
            seen,
            body,
        })
    }
}
