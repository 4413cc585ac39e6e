//! Signed distance to the surface.

use nalgebra::Point3;

use crate::meridian::Meridian;

/// Signed distance in the half-plane, with its gradient.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distance {
    pub(crate) value: f64,
    pub(crate) gradient: [f64; 2],
}

impl Meridian {
    /// Signed distance of a body point from the surface: negative inside.
    ///
    /// The nearest point of the surface lies in the point's own half-plane, so this is a distance in the plane.
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        self.distance_at(p.x, p.y.hypot(p.z)).value
    }

    /// Is the body point inside the solid?
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.signed_distance(p) < 0.0
    }

    pub(crate) fn distance_at(&self, x: f64, r: f64) -> Distance {
        let mut best = f64::INFINITY;
        let mut nearest = (0, 0.0);
        for (k, s) in self.segments().iter().enumerate() {
            let (px, pr) = (x - s.x0, r - s.r0);
            let along = (px * s.tx + pr * s.tr).clamp(0.0, s.length);
            let (dx, dr) = (px - along * s.tx, pr - along * s.tr);
            let d2 = dx * dx + dr * dr;
            if d2 < best {
                best = d2;
                nearest = (k, along);
            }
        }
        let s = &self.segments()[nearest.0];
        let along = nearest.1;
        let (dx, dr) = (x - s.x0 - along * s.tx, r - s.r0 - along * s.tr);
        let normal = if along <= 0.0 {
            s.start_normal
        } else if along >= s.length {
            s.end_normal
        } else {
            [-s.tr, s.tx]
        };
        let inside = dx * normal[0] + dr * normal[1] < 0.0;
        let d = best.sqrt();
        let sign = if inside { -1.0 } else { 1.0 };
        let gradient = if along > 0.0 && along < s.length {
            [-s.tr, s.tx]
        } else if d > 0.0 {
            [sign * dx / d, sign * dr / d]
        } else {
            let n = normal[0].hypot(normal[1]);
            [normal[0] / n, normal[1] / n]
        };
        Distance {
            value: sign * d,
            gradient,
        }
    }
}
