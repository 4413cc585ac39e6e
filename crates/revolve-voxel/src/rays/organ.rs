//! Active and attenuating organs around a body: ellipsoids and elliptic cylinders; later ones replace earlier ones.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use crate::error::{finite, positive};
use crate::solid::segment::ROUNDING;
use crate::{Body, Meridian, Ray, RevolveError, Span};

/// Vertices of the polygon around a circle about the axis; it extends beyond it by 1 / cos(pi / 256) - 1 = 7.5e-5.
const CORNERS: usize = 256;

/// The shape of an organ: an ellipsoid with axes along those of the lab, or an infinite elliptic cylinder along z, such as a torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrganShape {
    centre: [f64; 3],
    /// That along z is infinite for a cylinder.
    semi_axes: [f64; 3],
    /// Their reciprocals.
    inverse: Vector3<f64>,
}

impl OrganShape {
    /// An ellipsoid about `centre` with semi-axes along x, y and z, in cm.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`].
    pub fn ellipsoid(centre: [f64; 3], semi_axes: [f64; 3]) -> Result<Self, RevolveError> {
        for k in 0..3 {
            finite("centre of an organ", centre[k])?;
            positive("semi-axis of an organ", semi_axes[k])?;
        }
        Ok(Self::about(centre, semi_axes))
    }

    fn about(centre: [f64; 3], semi_axes: [f64; 3]) -> Self {
        Self {
            centre,
            semi_axes,
            inverse: Vector3::from(semi_axes).map(f64::recip),
        }
    }

    /// An infinite cylinder with its axis through `centre` (x, y) and semi-axes along x and y, in cm.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`].
    pub fn cylinder(centre: [f64; 2], semi_axes: [f64; 2]) -> Result<Self, RevolveError> {
        for k in 0..2 {
            finite("centre of the torso", centre[k])?;
            positive("semi-axis of the torso", semi_axes[k])?;
        }
        let ([x, y], [a, b]) = (centre, semi_axes);
        Ok(Self::about([x, y, 0.0], [a, b, f64::INFINITY]))
    }

    /// Returns centre and semi-axes along x, y and z; a cylinder is centred at z = 0 and infinite.
    #[must_use]
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (self.centre, self.semi_axes)
    }

    pub(crate) fn is_cylinder(&self) -> bool {
        self.semi_axes[2] == f64::INFINITY
    }

    /// Returns whether a point is inside it.
    ///
    /// ```
    /// use revolve_voxel::{OrganShape, nalgebra::Point3};
    /// let torso = OrganShape::cylinder([1.0, 0.0], [16.0, 11.0])?;
    /// assert!(torso.contains(&Point3::new(16.9, 0.0, 99.0)) && !torso.contains(&Point3::new(17.1, 0.0, 0.0)));
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        let (centre, semi_axes) = self.bounds();
        let square = |k: usize| ((point[k] - centre[k]) / semi_axes[k]).powi(2);
        (0..3).map(square).sum::<f64>() < 1.0
    }

    /// Returns the segment of a ray inside it; `None` for a ray along a cylinder, which has no ends.
    #[must_use]
    #[inline]
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        if self.is_cylinder() && across(&ray.direction()) == 0.0 {
            return None;
        }
        // In coordinates in which it is the unit ball; the direction is divided by its largest component, whose square may overflow or underflow.
        let p = (ray.origin() - Point3::from(self.centre)).component_mul(&self.inverse);
        let v = ray.direction().component_mul(&self.inverse);
        let size = v.amax();
        let per_size = size.recip();
        let v = v * per_size;
        let square = v.norm_squared();
        let per_square = per_size / square;
        let middle = -p.dot(&v) * per_square;
        let half = (square - p.cross(&v).norm_squared()).max(0.0).sqrt() * per_square;
        (half > 0.0).then_some(Span {
            enter: middle - half,
            exit: middle + half,
        })
    }

    /// Returns the smallest factor by which a cylinder must be scaled about its axis to contain the body; the body is inside if
    /// it is below 1. The height of an ellipsoid is ignored. The result is an upper bound, too large by a relative error of at most 1e-4.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, OrganShape, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?; // of radius 1/2
    /// let torso = OrganShape::cylinder([0.1, 0.0], [0.8, 0.9])?;
    /// let growth = torso.scale_to_contain(&body);
    /// assert!(growth >= 0.6 / 0.8 && growth < 0.6 / 0.8 + 1e-4);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn scale_to_contain(&self, body: &Body) -> f64 {
        let (centre, semi_axes) = self.bounds();
        // The cross-section is convex, and the body is in the convex hull of the circles through the points of the meridian;
        // polygons around these circles are sufficient.
        let out = 1.0 / (PI / CORNERS as f64).cos();
        let corners: Vec<Vector3<f64>> = (0..CORNERS)
            .map(|k| (TAU * k as f64 / CORNERS as f64).sin_cos())
            .map(|(sin, cos)| body.pose().isometry().rotation * Vector3::new(0.0, cos, sin) * out)
            .collect();
        let segments = body.layers().iter().flat_map(Meridian::segments);
        let points = segments.flat_map(|segment| [segment.start(), segment.end()]);
        let square = |place: Vector3<f64>| {
            let share = [0, 1].map(|k| (place[k] - centre[k]) / semi_axes[k]);
            share[0] * share[0] + share[1] * share[1]
        };
        let middle = |x: f64| body.pose().to_lab(&Point3::new(x, 0.0, 0.0)).coords;
        let reach = out / semi_axes[0].min(semi_axes[1]);
        let bound = |[x, r]: [f64; 2]| square(middle(x)).sqrt() + r * reach;
        let of_circle = |[x, r]: [f64; 2]| {
            let (middle, corners) = (middle(x), corners.iter());
            let squares = corners.map(|corner| square(middle + r * corner));
            squares.fold(0.0, f64::max).sqrt()
        };
        // After the circle with the largest bound, most are too far inside to matter.
        let farthest = points
            .clone()
            .max_by(|a, b| bound(*a).total_cmp(&bound(*b)));
        let most = farthest.map_or(0.0, of_circle);
        points.fold(most, |most, circle| match bound(circle) <= most {
            true => most,
            false => most.max(of_circle(circle)),
        })
    }
}

/// An organ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Organ {
    /// Shape.
    pub shape: OrganShape,
    /// Activity per cm^3.
    pub activity: f64,
    /// Attenuation in 1/cm.
    pub attenuation: f64,
}

/// Organs; later ones replace earlier ones where they overlap ([`Assembly`](crate::Assembly)).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Organs(Vec<Organ>);

impl Organs {
    /// Organs in the order of replacement.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::Negative`] for an activity or an attenuation.
    pub fn new(organs: Vec<Organ>) -> Result<Self, RevolveError> {
        for organ in &organs {
            for (what, given) in [
                ("activity of an organ", organ.activity),
                ("attenuation of an organ", organ.attenuation),
            ] {
                if finite(what, given)? < 0.0 {
                    return Err(RevolveError::Negative { what, given });
                }
            }
        }
        Ok(Self(organs))
    }

    /// Returns whether any organ contains activity.
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.0.iter().any(|organ| organ.activity > 0.0)
    }

    /// Returns all organs.
    #[must_use]
    pub fn as_slice(&self) -> &[Organ] {
        &self.0
    }
}

/// Returns the component of a unit direction perpendicular to a torso; `None` if it is parallel up to rounding.
pub(crate) fn across(d: &Vector3<f64>) -> f64 {
    let across = (d.x * d.x + d.y * d.y).sqrt();
    if across > ROUNDING { across } else { 0.0 }
}
