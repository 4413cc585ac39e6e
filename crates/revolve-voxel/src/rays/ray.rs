//! Rays, spans and hits.

use nalgebra::{Point3, Vector3};

use crate::RevolveError;
use crate::error::finite;

/// A straight line, origin and unit direction; the parameter `t` is a signed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    origin: Point3<f64>,
    direction: Vector3<f64>,
}

impl Ray {
    /// A ray through `origin` along `direction`, which is normalised.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for a NaN or infinite component, [`RevolveError::NoDirection`] for zero.
    pub fn new(origin: Point3<f64>, direction: Vector3<f64>) -> Result<Self, RevolveError> {
        for v in origin.iter() {
            finite("ray origin", *v)?;
        }
        for v in direction.iter() {
            finite("ray direction", *v)?;
        }
        // Scale first: the square of a tiny or huge component would under- or overflow.
        let scale = direction.amax();
        if scale == 0.0 {
            return Err(RevolveError::NoDirection);
        }
        Ok(Self {
            origin,
            direction: (direction / scale).normalize(),
        })
    }

    /// A ray along a unit vector, which is not validated.
    #[inline(always)]
    pub(crate) fn of_unit(origin: Point3<f64>, direction: Vector3<f64>) -> Self {
        Self { origin, direction }
    }

    /// The point at parameter zero.
    #[must_use]
    pub fn origin(&self) -> Point3<f64> {
        self.origin
    }

    /// The unit direction.
    #[must_use]
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// The point at distance `t` along the ray.
    #[must_use]
    pub fn at(&self, t: f64) -> Point3<f64> {
        self.origin + self.direction * t
    }
}

/// An interval of ray parameter inside a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Parameter of entry.
    pub enter: f64,
    /// Parameter of exit.
    pub exit: f64,
}

impl Span {
    /// Length of the span.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.exit - self.enter
    }
}

/// A point where a ray intersects a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// The point, in the ray's frame.
    pub point: Point3<f64>,
    /// Outward unit normal, in the ray's frame.
    pub normal: Vector3<f64>,
}
