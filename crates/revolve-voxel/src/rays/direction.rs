//! Directions of lines with their coordinates.

use nalgebra::{Point3, Vector3};

use crate::solid::meridian::Meridian;
use crate::solid::segment::ROUNDING;

/// One direction of lines in a body frame.
///
/// A line of direction (c, s e1) is `x = -s w + c t` (from the body's middle), `y = c w + s t` (along e1), `z = q`
/// (along e2): its coordinates are w and |q|, for the body is its own mirror image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direction {
    pub(crate) c: f64,
    pub(crate) s: f64,
    pub(crate) e1: [f64; 2],
    pub(crate) mid: f64,
    pub(crate) inv_c: f64,
    pub(crate) inv_sc: f64,
    /// Sign of c, never zero.
    pub(crate) along: f64,
    /// Bound on the rounding error of the position of a line.
    pub(crate) near: f64,
    /// Shift up the axis for lines in the plane of a face.
    pub(crate) beyond: f64,
    /// Extension of a cone beyond its planes; lines perpendicular to the axis are not bounded by planes.
    pub(crate) slack: f64,
    /// Parameter of a vertex plane from `w + s x` instead of x, without cancellation.
    pub(crate) steep: bool,
}

impl Direction {
    /// The direction of lines through the solid of a meridian, from a unit direction in the body frame; `farthest` is the largest
    /// coordinate of rays and pose from which positions are computed.
    pub(crate) fn new(meridian: &Meridian, farthest: f64, direction: &Vector3<f64>) -> Self {
        let across = (direction.y * direction.y + direction.z * direction.z).sqrt();
        let e1 = [direction.y / across, direction.z / across];
        Self::of_parts(meridian, farthest, [direction.x, across], e1)
    }

    /// The direction (c, s e1), with c^2 + s^2 = 1 and any e1 for s = 0.
    #[inline(always)]
    pub(crate) fn of_parts(
        meridian: &Meridian,
        farthest: f64,
        [mut c, mut s]: [f64; 2],
        e1: [f64; 2],
    ) -> Self {
        if c.abs() <= ROUNDING {
            (c, s) = (0.0, 1.0);
        } else if s <= ROUNDING {
            (c, s) = (c.signum(), 0.0);
        }
        let near = ROUNDING * (meridian.size() + farthest);
        Self {
            c,
            s,
            e1: if s > 0.0 { e1 } else { [1.0, 0.0] },
            mid: meridian.mid(),
            inv_c: 1.0 / c,
            inv_sc: 1.0 / (s * c),
            along: if c < 0.0 { -1.0 } else { 1.0 },
            near,
            beyond: if c == 0.0 { near } else { 0.0 },
            slack: if c == 0.0 { f64::INFINITY } else { near },
            steep: s >= c.abs(),
        }
    }

    /// (w, q, t) of a body point.
    #[inline(always)]
    pub(crate) fn coordinates(&self, p: &Point3<f64>) -> [f64; 3] {
        self.slopes(&Vector3::new(p.x - self.mid, p.y, p.z))
    }

    /// Change of (w, q, t) along a body vector.
    #[inline(always)]
    pub(crate) fn slopes(&self, v: &Vector3<f64>) -> [f64; 3] {
        let y = v.y * self.e1[0] + v.z * self.e1[1];
        let q = v.z * self.e1[0] - v.y * self.e1[1];
        [self.c * y - self.s * v.x, q, self.c * v.x + self.s * y]
    }
}
