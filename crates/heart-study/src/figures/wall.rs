//! The heart wall as a solid for rendering: a ring of revolution, complete or cut open, and its intersection with rays.

use heart_phantom::PhantomError;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Curve, Meridian, Pose, Ray, Sector, Shell};

use super::WallState;

/// Within this fraction of the wall from a membrane a point is on it.
const SKIN: f64 = 1e-6;

/// The solid between two membranes in the lab.
#[derive(Debug)]
pub(super) struct Wall {
    solid: Sector,
    shell: Shell,
    outer: Curve,
    /// Outward normals (x, r) at the nodes of the inner and the outer membrane.
    normals: [Curve; 2],
    pose: Pose,
    /// Middle of the wall's extent along the axis.
    pub(super) centre: Point3<f64>,
    /// Radius of a bounding sphere about the centre.
    pub(super) radius: f64,
    /// Length along the axis and largest diameter.
    pub(super) extent: [f64; 2],
}

/// The part of the wall that a ray intersects first.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// The outer membrane.
    Outer {
        /// Material coordinate from base (0) to apex (1).
        material: f64,
        /// Centimetres of meridian per unit of it.
        stretch: f64,
    },
    /// The inner membrane, from the cavity.
    Inner,
    /// The ring at the base (0) or a face of the cut, by the axis of the body nearest to its normal.
    Flat(usize),
}

/// The first intersection of a ray with the wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) part: Part,
    pub(super) point: Point3<f64>,
    /// Outward unit normal, smooth on membranes.
    pub(super) normal: Vector3<f64>,
}

impl Wall {
    /// The part of the wall between two azimuths (from body y to body z), in a pose.
    pub(super) fn new(
        state: &WallState<'_>,
        pose: Pose,
        azimuths: [f64; 2],
    ) -> Result<Self, PhantomError> {
        let halves = [state.inner, state.outer].map(upper_half);
        let [(inner_knots, inner), (outer_knots, outer)] = &halves;
        let around: Vec<_> = outer.iter().chain(inner.iter().rev()).copied().collect();
        let ring = Meridian::ring(&around)?;
        let ([low, high], r_max) = (ring.x_range(), ring.r_max());
        let outer = Curve::polyline(outer_knots, outer)?;
        let normal = |(knots, nodes): &(Vec<f64>, Vec<[f64; 2]>)| {
            Curve::polyline(knots, &node_normals(nodes))
        };
        Ok(Self {
            solid: Sector::new(ring, azimuths, pose)?,
            shell: Shell::new(
                Curve::polyline(inner_knots, inner)?,
                outer.clone(),
                [0.0, 1.0],
            )?,
            outer,
            normals: [normal(&halves[0])?, normal(&halves[1])?],
            pose,
            centre: pose.to_lab(&Point3::new(0.5 * (low + high), 0.0, 0.0)),
            radius: (0.5 * (high - low)).hypot(r_max),
            extent: [high - low, 2.0 * r_max],
        })
    }

    /// Returns the first intersection of the ray through `point` along the unit vector `away`, from any distance before it.
    pub(super) fn met(&self, point: Point3<f64>, away: Vector3<f64>) -> Option<Met> {
        let along = (point - self.centre).dot(&away);
        let nearest = point - along * away;
        if (nearest - self.centre).norm() > self.radius {
            return None;
        }
        let ray = Ray::new(nearest - 2.0 * self.radius * away, away).ok()?;
        let hit = self.solid.first_hit(&ray)?;
        // Slightly under the surface, so that rounding cannot put the point outside.
        let at = (self.pose).to_body(&(hit.point - 1e-9 * self.radius * hit.normal));
        let r = at.y.hypot(at.z);
        let found = self.shell.locate([at.x, r]);
        let smooth = |layer: usize, s: f64| {
            let [n, m] = self.normals[layer].at(s).position;
            let around = if r > 0.0 { m / r } else { 0.0 };
            let normal = Vector3::new(n, around * at.y, around * at.z).normalize();
            self.pose.isometry().rotation * normal
        };
        let (part, normal) = match found {
            Some([layer, s]) if layer > 1.0 - SKIN => {
                let [dx, dr] = self.outer.at(s).first;
                let (material, stretch) = (s, dx.hypot(dr));
                (Part::Outer { material, stretch }, smooth(1, s))
            }
            Some([layer, s]) if layer < SKIN => (Part::Inner, -smooth(0, s)),
            _ => {
                let axis = self.pose.vector_to_body(&hit.normal).iamax();
                (Part::Flat(axis), hit.normal)
            }
        };
        Some(Met {
            part,
            point: hit.point,
            normal,
        })
    }
}

/// The nodes of a full meridian `[x, y]` before y changes sign and the point there on the axis, with their material
/// coordinates: equal steps from the base (0) to the axis (1).
fn upper_half(full: &[[f64; 2]]) -> (Vec<f64>, Vec<[f64; 2]>) {
    // A node on the axis to rounding is the point there.
    let axis = 1e-12 * full.iter().fold(0.0, |most: f64, p| most.max(p[1]));
    let mut nodes: Vec<[f64; 2]> = full.iter().copied().take_while(|p| p[1] > axis).collect();
    let mut knots: Vec<f64> = (0..nodes.len()).map(|k| k as f64).collect();
    if let (Some(a), Some(b)) = (nodes.last().copied(), full.get(nodes.len())) {
        let t = a[1] / (a[1] - b[1].min(0.0));
        nodes.push([a[0] + t * (b[0] - a[0]), 0.0]);
        knots.push(knots.len() as f64 - 1.0 + t);
    }
    let last = knots.last().copied().unwrap_or(1.0);
    knots.iter_mut().for_each(|knot| *knot /= last);
    (knots, nodes)
}

/// Outward unit normals of a half meridian at its nodes; at the last, on the axis, along it.
fn node_normals(nodes: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let last = nodes.len() - 1;
    let normal = |k: usize| {
        let (a, b) = (nodes[k.saturating_sub(1)], nodes[(k + 1).min(last)]);
        let (dx, dr) = if k == last {
            (0.0, -1.0)
        } else {
            (b[0] - a[0], b[1] - a[1])
        };
        let length = dx.hypot(dr).max(f64::MIN_POSITIVE);
        [-dr / length, dx / length]
    };
    (0..=last).map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// Half an ellipse from the base at x = 0 to the apex at x = a, of radius b at the base.
    fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
        (0..=400)
            .map(|i| FRAC_PI_2 * (1.0 - f64::from(i) / 200.0))
            .map(|t| [a * t.cos(), b * t.sin()])
            .collect()
    }

    fn wall(azimuths: [f64; 2]) -> Wall {
        let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
        let state = WallState {
            title: "",
            inner: &inner,
            outer: &outer,
        };
        Wall::new(&state, Pose::identity(), azimuths).unwrap()
    }

    #[test]
    fn an_apex_on_the_axis_to_rounding_is_one_node() {
        for apex in [1e-16, 0.0, -1e-16] {
            let full = [
                [0.0, 3.0],
                [6.0, 2.0],
                [10.0, apex],
                [6.0, -2.0],
                [0.0, -3.0],
            ];
            let (knots, nodes) = upper_half(&full);
            assert_eq!(nodes.len(), 3);
            assert!((nodes[2][0] - 10.0).abs() < 1e-12 && nodes[2][1] == 0.0);
            assert!((knots[1] - 0.5).abs() < 1e-12 && knots[2] == 1.0);
        }
    }

    #[test]
    fn the_outer_surface_has_the_normal_of_the_ellipse() {
        let wall = wall([0.0, TAU]);
        for k in 1..20 {
            let x = 0.5 * f64::from(k);
            let met = wall.met(Point3::new(x, 0.0, 50.0), -Vector3::z()).unwrap();
            let z = 3.0 * (1.0 - x * x / 100.0f64).sqrt();
            // 400 chords of a half ellipse: sagitta h^2 / 8 times the curvature, below 2e-4.
            assert!((met.point - Point3::new(x, 0.0, z)).norm() < 2e-4);
            let normal = Vector3::new(x / 100.0, 0.0, z / 9.0).normalize();
            // Normals are interpolated between nodes 0.08 apart, accurate to second order.
            assert!(
                (met.normal - normal).norm() < 2e-3,
                "{} {normal}",
                met.normal
            );
            let Part::Outer { material, .. } = met.part else {
                panic!("{:?}", met.part)
            };
            let angle = (x / 10.0).asin();
            assert!((material - angle / FRAC_PI_2).abs() < 1e-4);
        }
    }

    #[test]
    fn the_cavity_is_open_at_the_base_and_the_ring_is_not() {
        let wall = wall([0.0, TAU]);
        let met = wall
            .met(Point3::new(-50.0, 0.0, 0.01), Vector3::x())
            .unwrap();
        assert!(matches!(met.part, Part::Inner));
        assert!((met.point.x - 8.0).abs() < 1e-3 && (met.normal + Vector3::x()).norm() < 0.1);
        let met = wall
            .met(Point3::new(-50.0, 2.5, 0.0), Vector3::x())
            .unwrap();
        assert!(matches!(met.part, Part::Flat(0)) && met.point.x.abs() < 1e-12);
        assert!((met.normal + Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn a_wedge_opens_the_wall() {
        // All but the quarter of negative y and positive z.
        let wall = wall([PI, 2.5 * PI]);
        // Down through the quarter cut away, into the wall's face at z = 0.
        let met = wall
            .met(Point3::new(1.0, -2.5, 50.0), -Vector3::z())
            .unwrap();
        assert!(matches!(met.part, Part::Flat(2)) && met.point.z.abs() < 1e-12);
        assert!((met.normal - Vector3::z()).norm() < 1e-12);
        // From the front, into the wall's face at y = 0.
        let met = wall
            .met(Point3::new(1.0, -50.0, 2.5), Vector3::y())
            .unwrap();
        assert!(matches!(met.part, Part::Flat(1)) && met.point.y.abs() < 1e-12);
        assert!((met.normal + Vector3::y()).norm() < 1e-12);
        // Nearer the axis it falls through the cavity to the far side of the inner membrane.
        let met = wall
            .met(Point3::new(1.0, -0.5, 50.0), -Vector3::z())
            .unwrap();
        assert!(matches!(met.part, Part::Inner) && met.point.z < -1.8 && met.normal.z > 0.9);
        // The other quarters stay.
        let met = wall
            .met(Point3::new(1.0, 0.5, 50.0), -Vector3::z())
            .unwrap();
        assert!(matches!(met.part, Part::Outer { .. }));
    }

    #[test]
    fn the_pose_transforms_points_and_normals() {
        let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(10.0, 3.0));
        let state = WallState {
            title: "",
            inner: &inner,
            outer: &outer,
        };
        let pose = Pose::axis_along_z(5.0).unwrap();
        let wall = Wall::new(&state, pose, [0.0, TAU]).unwrap();
        let met = wall
            .met(Point3::new(0.0, 0.0, 50.0), -Vector3::z())
            .unwrap();
        assert!((met.point - Point3::new(0.0, 0.0, 5.0)).norm() < 1e-9);
        assert!((met.normal - Vector3::z()).norm() < 1e-2);
        assert!((wall.centre - Point3::origin()).norm() < 1e-9);
    }
}
