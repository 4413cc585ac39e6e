//! Elliptic cylinders with activity: containment of a body, and projections.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, length};
use crate::rays::raster::Rays;
use crate::rays::slabs::for_slabs;
use crate::{Attenuator, Body, EllipticCylinder, Meridian, RevolveError, Sample};

/// Vertices of the polygon around a circle about the axis; it extends beyond it by 1 / cos(pi / 256) - 1 = 7.5e-5.
const CORNERS: usize = 256;

impl EllipticCylinder {
    /// Returns the smallest factor by which the cylinder must be scaled about its axis to contain the body; the body is inside if
    /// it is below 1. The result is an upper bound, too large by a relative error of at most 1e-4.
    ///
    /// ```
    /// use revolve_voxel::{Body, EllipticCylinder, Meridian, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?; // of radius 1/2
    /// let torso = EllipticCylinder::new([0.1, 0.0], [0.8, 0.9])?;
    /// let growth = torso.scale_to_contain(&body);
    /// assert!(growth >= 0.6 / 0.8 && growth < 0.6 / 0.8 + 1e-4);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    pub fn scale_to_contain(&self, body: &Body) -> f64 {
        let (centre, semi_axes) = (self.centre(), self.semi_axes());
        // The cross-section is convex, and the body is in the convex hull of the circles through the points of the meridian;
        // polygons around these circles are sufficient.
        let out = 1.0 / (PI / CORNERS as f64).cos();
        let corners: Vec<Vector3<f64>> = (0..CORNERS)
            .map(|k| (TAU * k as f64 / CORNERS as f64).sin_cos())
            .map(|(sin, cos)| body.pose().isometry().rotation * Vector3::new(0.0, cos, sin) * out)
            .collect();
        let segments = body.layers().iter().flat_map(Meridian::segments);
        let points = segments.flat_map(|segment| [segment.start(), segment.end()]);
        let share = |place: Vector3<f64>| {
            let share = [0, 1].map(|k| (place[k] - centre[k]) / semi_axes[k]);
            share[0].hypot(share[1])
        };
        points.fold(0.0, |most: f64, [x, r]| {
            let middle = body.pose().to_lab(&Point3::new(x, 0.0, 0.0)).coords;
            // Most circles are too far inside to matter.
            if share(middle) + r * out / semi_axes[0].min(semi_axes[1]) <= most {
                return most;
            }
            let corners = corners.iter().map(|corner| share(middle + r * corner));
            corners.fold(most, f64::max)
        })
    }

    /// Adds `activity` times the line integrals inside the cylinder to an image `[row][bin]`, with optional attenuation (the
    /// detector lies in the direction of the rays).
    ///
    /// ```
    /// use revolve_voxel::{Attenuator, EllipticCylinder, Medium, ParallelDetector};
    /// let torso = EllipticCylinder::new([1.0, 0.0], [3.0, 2.0])?;
    /// let rays = ParallelDetector::new(3, 1, [1.0, 1.0])?.rays(0.0)?; // along +y at x = -1, 0, 1
    /// let mut seen = [0.0_f64; 3];
    /// torso.project_add(&rays, 0.5, None, &mut seen)?;
    /// assert!((seen[2] - 0.5 * 4.0).abs() < 1e-12);
    /// let medium = Attenuator::new(0.2, Medium::Torso(torso))?;
    /// let mut attenuated = [0.0_f64; 3];
    /// torso.project_add(&rays, 0.5, Some(&medium), &mut attenuated)?;
    /// for (plain, weak) in seen.iter().zip(&attenuated) {
    ///     assert!((weak - 0.5 * (1.0 - (-0.2 * plain / 0.5).exp()) / 0.2).abs() < 1e-12);
    /// }
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong image, [`RevolveError::NotFinite`] for the activity, [`RevolveError::NotPositive`] for
    /// rays along z.
    pub fn project_add<T: Sample>(
        &self,
        rays: &impl Rays,
        activity: f64,
        attenuator: Option<&Attenuator>,
        out: &mut [T],
    ) -> Result<(), RevolveError> {
        finite("activity", activity)?;
        length("image", rays.image_len(), out.len())?;
        rays.check_across()?;
        let n_bins = rays.row_len();
        out.par_chunks_mut((rays.planes().len() + 1) * n_bins)
            .enumerate()
            .for_each(|(row, image)| {
                let mask = rays.mask_of_row(row);
                for bin in 0..n_bins {
                    if mask.is_some_and(|mask| !mask[bin]) {
                        continue;
                    }
                    let ray = rays.line(bin, row);
                    let Some(span) = self.span(&ray) else {
                        continue;
                    };
                    let medium = attenuator.map(|medium| medium.along(&ray));
                    for_slabs(
                        rays.planes(),
                        0.0,
                        [span.enter, span.exit],
                        |slab, [p, q]| {
                            let way = match &medium {
                                None => q - p,
                                Some(medium) => medium.integral(p, q),
                            };
                            image[slab * n_bins + bin] += T::from_f64(activity * way);
                        },
                    );
                }
            });
        Ok(())
    }
}
