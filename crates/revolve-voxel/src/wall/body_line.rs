//! A line relative to the axis of a body: most rings that it misses are found without intersections.

use nalgebra::{Point3, Vector3};

use crate::solid::wedge::Wedge;
use crate::{Pose, Ray};

/// Margin of a bounding box, relative to the distance and size of the ring; more than rounding of a square root near zero.
const MARGIN: f64 = 1e-7;

/// A line in the frame of a body.
#[derive(Debug)]
pub(crate) struct BodyLine {
    /// Origin, direction, and the rounding of the origin.
    pub(crate) parts: (Point3<f64>, Vector3<f64>, f64),
    per_x: f64,
    /// Distance of its origin from that of the body, and the parameter of the point closest to the axis.
    distance: f64,
    closest: f64,
    /// The squared radius is `a + 2 b t + c t^2`.
    square: [f64; 3],
}

impl BodyLine {
    pub(crate) fn new(pose: &Pose, ray: &Ray) -> Self {
        let (origin, along) = (
            pose.to_body(&ray.origin()),
            pose.vector_to_body(&ray.direction()),
        );
        let product = |a: &Vector3<f64>, b: &Vector3<f64>| a.y * b.y + a.z * b.z;
        let [b, c] = [&origin.coords, &along].map(|other| product(&along, other));
        Self {
            parts: (origin, along, pose.rounding(&ray.origin())),
            per_x: 1.0 / along.x,
            distance: origin.coords.norm(),
            closest: -b / c,
            square: [product(&origin.coords, &origin.coords), b, c],
        }
    }

    /// Returns the range of parameters in a range of x; `None` if all radii there are outside a range of r, by more than rounding.
    #[inline]
    pub(crate) fn within(&self, [x0, x1, least, most]: [f64; 4]) -> Option<[f64; 2]> {
        let near = MARGIN * (self.distance + most + x0.abs().max(x1.abs()));
        let ends = [x0 - near, x1 + near].map(|x| (x - self.parts.0.x) * self.per_x);
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let [a, b, c] = self.square;
        let square = |t: f64| a + t * (2.0 * b + t * c);
        let (inner, outer) = ((least - near).max(0.0), most + near);
        let misses = square(self.closest.max(low).min(high)) > outer * outer
            || square(low).max(square(high)) < inner * inner;
        (!misses).then_some([low, high])
    }

    /// Returns the intervals inside a wedge; `None` if none overlaps the range of parameters of [`within`](Self::within).
    #[inline]
    pub(crate) fn inside(&self, ring: [f64; 4], wedge: &Wedge) -> Option<[Option<[f64; 2]>; 2]> {
        let [low, high] = self.within(ring)?;
        let (origin, along, near) = &self.parts;
        let held = wedge.stretches(origin, along, *near);
        let overlaps = |[from, to]: &[f64; 2]| *from < high && low < *to;
        held.iter().flatten().any(overlaps).then_some(held)
    }
}
