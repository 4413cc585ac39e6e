//! A simple solid that encloses others: rays that miss it need no further test.

use nalgebra::Point3;

use crate::{Body, Ray};

/// A cylinder with a hemisphere at each end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    ends: [Point3<f64>; 2],
    radius: f64,
}

impl Capsule {
    /// Returns a capsule that encloses all bodies, along the axis of the first; `None` without a body.
    ///
    /// ```
    /// use revolve_voxel::nalgebra::{Point3, Vector3};
    /// use revolve_voxel::{Body, Capsule, Meridian, Pose, Ray};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?;
    /// let capsule = Capsule::around([&body]).expect("one body");
    /// let along_y = |x: f64| Ray::new(Point3::new(x, 0.0, 0.0), Vector3::y());
    /// assert!(capsule.meets(&along_y(0.49)?) && !capsule.meets(&along_y(0.51)?));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn around<'a>(bodies: impl IntoIterator<Item = &'a Body>) -> Option<Self> {
        let mut bodies = bodies.into_iter().peekable();
        let pose = *bodies.peek()?.pose();
        let (origin, axis) = (pose.to_lab(&Point3::origin()), pose.axis());
        let (mut from, mut to, mut radius) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for body in bodies {
            for layer in body.layers() {
                let widest = layer.r_max();
                // A tilted disc extends along the first axis by its radius at most.
                let tilt = body.pose().axis().cross(&axis).norm();
                for x in layer.x_range() {
                    let place = body.pose().to_lab(&Point3::new(x, 0.0, 0.0)) - origin;
                    let along = place.dot(&axis);
                    from = from.min(along - tilt * widest);
                    to = to.max(along + tilt * widest);
                    radius = radius.max((place - axis * along).norm() + widest);
                }
            }
        }
        let ends = [from, to].map(|along| origin + axis * along);
        // Larger than any rounding error.
        let size = ends
            .iter()
            .fold(radius, |most, end| most.max(end.coords.amax()));
        let radius = radius + 1e-12 * size;
        Some(Self { ends, radius })
    }

    /// Returns whether a ray intersects the capsule.
    #[must_use]
    pub fn meets(&self, ray: &Ray) -> bool {
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
