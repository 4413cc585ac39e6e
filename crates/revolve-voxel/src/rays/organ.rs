//! Active and attenuating organs around a body: ellipsoids and elliptic cylinders; later ones replace earlier ones.

use nalgebra::{Point3, Vector3};

use crate::error::{finite, positive};
use crate::{EllipticCylinder, Ray, RevolveError, Span};

/// An ellipsoid with axes along those of the lab.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    centre: [f64; 3],
    semi_axes: [f64; 3],
}

impl Ellipsoid {
    /// An ellipsoid about `centre` with semi-axes along x, y and z, in cm.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`].
    pub fn new(centre: [f64; 3], semi_axes: [f64; 3]) -> Result<Self, RevolveError> {
        for k in 0..3 {
            finite("centre of an organ", centre[k])?;
            positive("semi-axis of an organ", semi_axes[k])?;
        }
        Ok(Self { centre, semi_axes })
    }

    /// Returns the centre (x, y, z).
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        self.centre
    }

    /// Returns the semi-axes along x, y and z.
    #[must_use]
    pub fn semi_axes(&self) -> [f64; 3] {
        self.semi_axes
    }

    /// Returns the segment of a ray inside the ellipsoid.
    #[must_use]
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        // In coordinates in which it is the unit ball; there the squared length of the direction may overflow or underflow.
        let scaled = |v: Vector3<f64>| v.component_div(&Vector3::from(self.semi_axes));
        let (p, v) = (
            scaled(ray.origin() - Point3::from(self.centre)),
            scaled(ray.direction()),
        );
        let size = v.amax();
        let speed = size * (v / size).norm();
        let v = v / speed;
        let middle = -p.dot(&v) / speed;
        let distance = p.cross(&v).norm();
        let half = ((1.0 - distance) * (1.0 + distance)).max(0.0).sqrt() / speed;
        (half > 0.0).then_some(Span {
            enter: middle - half,
            exit: middle + half,
        })
    }
}

/// The shape of an organ.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OrganShape {
    /// An infinite elliptic cylinder along z.
    Cylinder(EllipticCylinder),
    /// An ellipsoid.
    Ellipsoid(Ellipsoid),
}

impl OrganShape {
    /// Returns centre and semi-axes along x, y and z; a cylinder is centred at z = 0 and infinite.
    #[must_use]
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Cylinder(cylinder) => {
                let ([x, y], [a, b]) = (cylinder.centre(), cylinder.semi_axes());
                ([x, y, 0.0], [a, b, f64::INFINITY])
            }
            Self::Ellipsoid(ellipsoid) => (ellipsoid.centre(), ellipsoid.semi_axes()),
        }
    }

    /// Returns whether a point is inside it.
    ///
    /// ```
    /// use revolve_voxel::{EllipticCylinder, OrganShape, nalgebra::Point3};
    /// let torso = OrganShape::Cylinder(EllipticCylinder::new([1.0, 0.0], [16.0, 11.0])?);
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
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        match self {
            Self::Cylinder(cylinder) => cylinder.span(ray),
            Self::Ellipsoid(ellipsoid) => ellipsoid.span(ray),
        }
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
