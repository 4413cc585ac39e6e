//! The heart wall as a solid to look at: rays cast at the exact body, cut open by a wedge if asked.

use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Body, Meridian, Pose, Ray, Span};

use super::profile::{OnProfile, Profile};
use super::{FigureError, WallState};

/// The solid between two membranes, standing in the lab.
#[derive(Debug)]
pub(super) struct Wall {
    body: Body,
    profiles: [Profile; 2],
    centre: Point3<f64>,
    radius: f64,
}

/// Which part of the wall a ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// The outer membrane.
    Outer(OnProfile),
    /// The inner membrane, from the cavity.
    Inner,
    /// The flat ring at the base.
    Base,
    /// A face of the cut, that of the first or second vector.
    Cut(u8),
}

/// Where a ray meets the wall first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) part: Part,
    pub(super) point: Point3<f64>,
    /// Unit normal out of the wall.
    pub(super) normal: Vector3<f64>,
}

impl Wall {
    pub(super) fn new(state: &WallState<'_>, pose: Pose) -> Result<Self, FigureError> {
        let layer = |nodes| Meridian::from_full_curve(nodes).map_err(FigureError::Body);
        let layers = vec![layer(state.inner)?, layer(state.outer)?];
        let [low, high] = layers[1].x_range();
        let centre = pose.to_lab(&Point3::new(0.5 * (low + high), 0.0, 0.0));
        let radius = (0.5 * (high - low)).hypot(layers[1].r_max());
        let profiles = [Profile::new(state.inner), Profile::new(state.outer)];
        let body = Body::new(layers, pose).map_err(FigureError::Body)?;
        Ok(Self {
            body,
            profiles,
            centre,
            radius,
        })
    }

    /// Middle of the outer membrane's extent along the axis.
    pub(super) fn centre(&self) -> Point3<f64> {
        self.centre
    }

    /// Radius of a sphere about the centre that holds the wall.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// Length along the axis and largest diameter of the outer membrane.
    pub(super) fn extent(&self) -> [f64; 2] {
        let [low, high] = self.body.layers()[1].x_range();
        [high - low, 2.0 * self.body.layers()[1].r_max()]
    }

    /// What the ray through `point` along the unit vector `away` meets first, from however far before.
    ///
    /// `wedge` holds two body-frame vectors across the axis; points on the positive side of both are cut away.
    pub(super) fn met(
        &self,
        point: Point3<f64>,
        away: Vector3<f64>,
        wedge: Option<[Vector3<f64>; 2]>,
    ) -> Option<Met> {
        let offset = point - self.centre;
        let nearest = offset - offset.dot(&away) * away;
        if nearest.norm_squared() > self.radius * self.radius {
            return None;
        }
        let ray = Ray::new(point, away).ok()?;
        let outer = self.body.spans(1, &ray).ok()?;
        if outer.is_empty() {
            return None;
        }
        let inner = self.body.spans(0, &ray).ok()?;
        let pose = self.body.pose();
        let (origin, along) = (pose.to_body(&point), pose.vector_to_body(&away));
        let gap = wedge.and_then(|w| wedge_span(w, &origin, &along));
        // Both membranes end in one plane at the base; a hair keeps rounding from leaving a film across the cavity.
        let hair = 1e-7 * self.radius;
        for span in &outer {
            let mut t = span.enter;
            let mut kind = 0;
            // Each pass leaves one of the holes, so there are at most a few.
            loop {
                if t >= span.exit - hair {
                    break;
                }
                if let Some(hole) = inner.iter().find(|h| h.enter - hair <= t && t < h.exit) {
                    (t, kind) = (hole.exit, 1);
                    continue;
                }
                if let Some(hole) = gap.filter(|h| h.enter <= t && t < h.exit) {
                    (t, kind) = (hole.exit, 2);
                    continue;
                }
                let at = origin + t * along;
                let (part, normal) = match kind {
                    0 => self.skin(&at),
                    1 => (Part::Inner, -self.smooth(0, &at)?.1),
                    _ => cut_face(wedge?, &at),
                };
                return Some(Met {
                    part,
                    point: point + t * away,
                    normal: pose.isometry().rotation * normal,
                });
            }
        }
        None
    }

    /// The outside of the outer layer: its membrane, or the base.
    fn skin(&self, at: &Point3<f64>) -> (Part, Vector3<f64>) {
        match self.smooth(1, at) {
            Some((on, normal)) if on.distance < 1e-6 * self.radius => (Part::Outer(on), normal),
            _ => (Part::Base, -Vector3::x()),
        }
    }

    fn smooth(&self, layer: usize, at: &Point3<f64>) -> Option<(OnProfile, Vector3<f64>)> {
        let r = at.y.hypot(at.z);
        let on = self.profiles[layer].at(at.x, r)?;
        let [n, m] = on.normal;
        let around = if r > 0.0 {
            [at.y / r, at.z / r]
        } else {
            [0.0, 0.0]
        };
        Some((on, Vector3::new(n, m * around[0], m * around[1])))
    }
}

/// Where a line runs on the positive side of both vectors.
fn wedge_span(
    wedge: [Vector3<f64>; 2],
    origin: &Point3<f64>,
    along: &Vector3<f64>,
) -> Option<Span> {
    let mut span = Span {
        enter: f64::NEG_INFINITY,
        exit: f64::INFINITY,
    };
    for side in wedge {
        let (height, slope) = (origin.coords.dot(&side), along.dot(&side));
        if slope > 0.0 {
            span.enter = span.enter.max(-height / slope);
        } else if slope < 0.0 {
            span.exit = span.exit.min(-height / slope);
        } else if height <= 0.0 {
            return None;
        }
    }
    (span.enter < span.exit).then_some(span)
}

/// The face of the wedge that a point lies on, its normal towards the part cut away.
fn cut_face([a, b]: [Vector3<f64>; 2], at: &Point3<f64>) -> (Part, Vector3<f64>) {
    if at.coords.dot(&a).abs() <= at.coords.dot(&b).abs() {
        (Part::Cut(0), a)
    } else {
        (Part::Cut(1), b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Half an ellipse from the base at x = 0 to the apex at x = a, of radius b at the base.
    fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
        (0..=400)
            .map(|i| FRAC_PI_2 * (1.0 - f64::from(i) / 200.0))
            .map(|t| [a * t.cos(), b * t.sin()])
            .collect()
    }

    fn wall() -> Wall {
        let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
        let state = WallState {
            title: "",
            inner: &inner,
            outer: &outer,
        };
        Wall::new(&state, Pose::identity()).unwrap()
    }

    #[test]
    fn the_outside_is_met_with_the_normal_of_the_ellipse() {
        let wall = wall();
        for k in 1..20 {
            let x = 0.5 * f64::from(k);
            let met = wall
                .met(Point3::new(x, 0.0, 50.0), -Vector3::z(), None)
                .unwrap();
            let z = 3.0 * (1.0 - x * x / 100.0f64).sqrt();
            // 400 chords of a half ellipse: sagitta h^2 / 8 times the curvature, below 2e-4.
            assert!((met.point - Point3::new(x, 0.0, z)).norm() < 2e-4);
            let normal = Vector3::new(x / 100.0, 0.0, z / 9.0).normalize();
            // Normals are interpolated between nodes 0.08 apart and right to second order.
            assert!(
                (met.normal - normal).norm() < 2e-3,
                "{} {normal}",
                met.normal
            );
            let Part::Outer(on) = met.part else {
                panic!("{:?}", met.part)
            };
            let angle = (x / 10.0).asin();
            assert!((on.material - angle / FRAC_PI_2).abs() < 1e-4);
        }
    }

    #[test]
    fn the_cavity_is_open_at_the_base_and_the_ring_is_not() {
        let wall = wall();
        let met = wall
            .met(Point3::new(-50.0, 0.0, 0.01), Vector3::x(), None)
            .unwrap();
        assert!(matches!(met.part, Part::Inner));
        assert!((met.point.x - 8.0).abs() < 1e-3 && (met.normal + Vector3::x()).norm() < 0.1);
        let met = wall
            .met(Point3::new(-50.0, 2.5, 0.0), Vector3::x(), None)
            .unwrap();
        assert!(matches!(met.part, Part::Base) && met.point.x.abs() < 1e-12);
        assert_eq!(met.normal, -Vector3::x());
    }

    #[test]
    fn a_wedge_opens_the_wall() {
        let wall = wall();
        let wedge = [-Vector3::y(), Vector3::z()];
        // Down through the quarter cut away, into the wall's face at z = 0.
        let met = wall
            .met(Point3::new(1.0, -2.5, 50.0), -Vector3::z(), Some(wedge))
            .unwrap();
        assert!(matches!(met.part, Part::Cut(1)) && met.point.z.abs() < 1e-12);
        assert_eq!(met.normal, Vector3::z());
        // From the front, into the wall's face at y = 0.
        let met = wall
            .met(Point3::new(1.0, -50.0, 2.5), Vector3::y(), Some(wedge))
            .unwrap();
        assert!(matches!(met.part, Part::Cut(0)) && met.point.y.abs() < 1e-12);
        assert_eq!(met.normal, -Vector3::y());
        // Nearer the axis it falls through the cavity to the far side of the inner membrane.
        let met = wall
            .met(Point3::new(1.0, -0.5, 50.0), -Vector3::z(), Some(wedge))
            .unwrap();
        assert!(matches!(met.part, Part::Inner) && met.point.z < -1.8 && met.normal.z > 0.9);
        // The other quarters stay.
        let met = wall
            .met(Point3::new(1.0, 0.5, 50.0), -Vector3::z(), Some(wedge))
            .unwrap();
        assert!(matches!(met.part, Part::Outer(_)));
    }

    #[test]
    fn the_pose_carries_points_and_normals() {
        let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
        let state = WallState {
            title: "",
            inner: &inner,
            outer: &outer,
        };
        let pose = Pose::axis_along_z(5.0).unwrap();
        let wall = Wall::new(&state, pose).unwrap();
        let met = wall
            .met(Point3::new(0.0, 0.0, 50.0), -Vector3::z(), None)
            .unwrap();
        assert!((met.point - Point3::new(0.0, 0.0, 5.0)).norm() < 1e-9);
        assert!((met.normal - Vector3::z()).norm() < 1e-2);
        assert!((wall.centre() - Point3::origin()).norm() < 1e-9);
    }
}
