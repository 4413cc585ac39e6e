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
pub(super) fn upper_half(full: &[[f64; 2]]) -> (Vec<f64>, Vec<[f64; 2]>) {
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
