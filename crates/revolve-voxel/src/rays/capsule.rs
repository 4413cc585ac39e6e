//! A simple solid that encloses a body: rays that miss it need no further test.

use nalgebra::Point3;

use crate::{Body, Ray};

/// A cylinder with a hemisphere at each end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Capsule {
    ends: [Point3<f64>; 2],
    radius: f64,
}

impl Capsule {
    /// Returns the capsule along the axis of a body that encloses all its layers.
    pub(crate) fn around(body: &Body) -> Self {
        let (mut from, mut to, mut radius) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for layer in body.layers() {
            let [low, high] = layer.x_range();
            (from, to) = (from.min(low), to.max(high));
            radius = radius.max(layer.r_max());
        }
        let ends = [from, to].map(|x| body.pose().to_lab(&Point3::new(x, 0.0, 0.0)));
        // Larger than any rounding error.
        let size = ends
            .iter()
            .fold(radius, |most, end| most.max(end.coords.amax()));
        let radius = radius + 1e-12 * size;
        Self { ends, radius }
    }

    /// Returns whether a ray intersects the capsule.
    pub(crate) fn meets(&self, ray: &Ray) -> bool {
        let d = ray.direction();
        let [from, to] = self.ends.map(|end| {
            let place = end - ray.origin();
            place - d * place.dot(&d)
        });
        // In projection along the ray: distance to the segment between both ends.
        let along = to - from;
        let length = along.norm_squared();
        let share = match length > 0.0 {
            true => (-from.dot(&along) / length).clamp(0.0, 1.0),
            false => 0.0,
        };
        (from + along * share).norm() <= self.radius
    }
}
