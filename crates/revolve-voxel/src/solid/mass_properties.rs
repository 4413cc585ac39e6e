//! Volume, surface, centroid and inertia in closed form.

use std::f64::consts::PI;
use std::ops::Sub;

use crate::solid::segment::Segment;

/// Exact integrals over a solid of revolution of density 1, in its body frame.
///
/// The difference of an outer and an inner solid gives a shell, except for `surface`: see [`Body::region_measures`](crate::Body::region_measures).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MassProperties {
    /// Volume, pi times the integral of r^2 dx.
    pub volume: f64,
    /// Area of the surface, including closing discs.
    pub surface: f64,
    /// First moment about x = 0: the integral of x over the solid.
    pub first_moment: f64,
    /// Integral of x^2 over the solid. The moment of inertia about a line through the centroid perpendicular to the axis is
    /// `polar_inertia / 2 + second_moment - first_moment^2 / volume`.
    pub second_moment: f64,
    /// Moment of inertia about the axis: the integral of y^2 + z^2.
    pub polar_inertia: f64,
}

impl MassProperties {
    /// Returns the axial coordinate of the centroid (on the axis).
    #[must_use]
    pub fn centroid(&self) -> f64 {
        self.first_moment / self.volume
    }

    /// Signed volume under a path from axis to axis, or inside a closed one: positive with the solid on its right.
    pub(crate) fn signed_volume(path: &[[f64; 2]]) -> f64 {
        let mut sum = 0.0;
        for p in path.windows(2) {
            let ([x0, r0], [x1, r1]) = (p[0], p[1]);
            sum += (x1 - x0) * (r0 * r0 + r0 * r1 + r1 * r1);
        }
        PI / 3.0 * sum
    }

    /// Area of the flat faces that two solids have in common, with both on the same side.
    pub(crate) fn common_faces(a: &[Segment], b: &[Segment], reach: f64) -> f64 {
        let flat = |s: &&Segment| s.x0 == s.x1;
        let mut sum = 0.0;
        for a in a.iter().filter(flat) {
            let near =
                |b: &&Segment| (a.x0 - b.x0).abs() <= reach && (a.r1 > a.r0) == (b.r1 > b.r0);
            for b in b.iter().filter(flat).filter(near) {
                let ([_, _, a0, a1], [_, _, b0, b1]) = (a.bounds(), b.bounds());
                let (low, high) = (a0.max(b0), a1.min(b1));
                sum += PI * (high * high - low * low) * f64::from(u8::from(high > low));
            }
        }
        sum
    }

    pub(crate) fn of(segments: &[Segment]) -> Self {
        let mut m = Self {
            volume: 0.0,
            surface: 0.0,
            first_moment: 0.0,
            second_moment: 0.0,
            polar_inertia: 0.0,
        };
        for s in segments {
            let dx = s.x1 - s.x0;
            let (a, b) = (s.r0, s.r1);
            // With r = a (1-u) + b u: integrals of r^2, r^2 u, r^2 u^2, r^4 over u in [0, 1].
            let i0 = (a * a + a * b + b * b) / 3.0;
            let i1 = (a * a + 2.0 * a * b + 3.0 * b * b) / 12.0;
            let i2 = (a * a + 3.0 * a * b + 6.0 * b * b) / 30.0;
            let r4 = (a.powi(4) + a.powi(3) * b + a * a * b * b + a * b.powi(3) + b.powi(4)) / 5.0;
            m.volume += PI * dx * i0;
            m.surface += PI * (a + b) * s.length;
            m.first_moment += PI * dx * (s.x0 * i0 + dx * i1);
            m.second_moment += PI * dx * (s.x0 * s.x0 * i0 + 2.0 * s.x0 * dx * i1 + dx * dx * i2);
            m.polar_inertia += 0.5 * PI * dx * r4;
        }
        m
    }
}

impl Sub for MassProperties {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self {
            volume: self.volume - o.volume,
            surface: self.surface - o.surface,
            first_moment: self.first_moment - o.first_moment,
            second_moment: self.second_moment - o.second_moment,
            polar_inertia: self.polar_inertia - o.polar_inertia,
        }
    }
}
