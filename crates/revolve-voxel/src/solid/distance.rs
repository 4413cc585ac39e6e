//! Signed distance to the surface.
//!
//! The nearest point of a surface of revolution lies in the half-plane of the given point. The distance is that to a polyline in
//! the plane, found with a tree of boxes.

use nalgebra::Point3;

use crate::solid::meridian::Meridian;
use crate::solid::segment::Segment;

/// The segment nearest to a point, the position along it, and the squared distance.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    segment: usize,
    along: f64,
    d2: f64,
}

impl Nearest {
    const NONE: Self = Self {
        segment: 0,
        along: 0.0,
        d2: f64::INFINITY,
    };

    /// Stores the segment if it is nearer; returns its squared distance.
    #[inline(always)]
    fn try_segment(&mut self, k: usize, s: &Segment, x: f64, r: f64) -> f64 {
        let (px, pr) = (x - s.x0, r - s.r0);
        let along = (px * s.tx + pr * s.tr).max(0.0).min(s.length);
        let (dx, dr) = (px - along * s.tx, pr - along * s.tr);
        let d2 = dx * dx + dr * dr;
        if d2 < self.d2 {
            *self = Self {
                segment: k,
                along,
                d2,
            };
        }
        d2
    }

    /// Negative inside.
    fn distance(&self, segments: &[Segment], x: f64, r: f64) -> f64 {
        let s = &segments[self.segment];
        let (dx, dr) = (x - s.x0 - self.along * s.tx, r - s.r0 - self.along * s.tr);
        if self.along > 0.0 && self.along < s.length {
            return dr * s.tx - dx * s.tr;
        }
        let normal = if self.along > 0.0 {
            s.end_normal
        } else {
            s.start_normal
        };
        let inside = dx * normal[0] + dr * normal[1] < 0.0;
        self.d2.sqrt() * if inside { -1.0 } else { 1.0 }
    }
}

impl Meridian {
    /// Returns the signed distance of a body point from the surface: negative inside, NaN for a coordinate that is NaN.
    ///
    /// Cost: about the logarithm of the number of segments.
    ///
    /// ```
    /// use revolve_voxel::{Meridian, nalgebra::Point3};
    /// let cylinder = Meridian::new(&[[0.0, 1.0], [4.0, 1.0]])?;
    /// assert_eq!(cylinder.signed_distance(&Point3::new(2.0, 0.6, 0.0)), -0.4);
    /// assert_eq!(cylinder.signed_distance(&Point3::new(7.0, 5.0, 0.0)), 5.0);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        match p.coords.iter().any(|x| x.is_nan()) {
            true => f64::NAN,
            false => self.distance_at(p.x, p.y.hypot(p.z)),
        }
    }

    /// Returns whether the body point is inside the solid.
    #[must_use]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.signed_distance(p) < 0.0
    }

    /// Signed distance in the half-plane.
    pub(crate) fn distance_at(&self, x: f64, r: f64) -> f64 {
        self.nearest(x, r).distance(self.segments(), x, r)
    }

    /// Returns the outward normal (x, r) of the segment nearest to a point of the half-plane.
    pub(crate) fn normal_at(&self, x: f64, r: f64) -> [f64; 2] {
        let segment = &self.segments()[self.nearest(x, r).segment];
        [-segment.tr, segment.tx]
    }

    #[inline(always)]
    fn nearest(&self, x: f64, r: f64) -> Nearest {
        let segments = self.segments();
        let mut nearest = Nearest::NONE;
        self.boxes()
            .search(x, r, nearest.d2, segments.len(), |leaf, _| {
                for k in leaf {
                    nearest.try_segment(k, &segments[k], x, r);
                }
                nearest.d2
            });
        nearest
    }

    /// Appends the segments no farther than `reach` from a point.
    pub(crate) fn segments_within(&self, reach: f64, x: f64, r: f64, list: &mut Vec<u32>) {
        let segments = self.segments();
        let bound = reach * reach;
        self.boxes()
            .search(x, r, bound, segments.len(), |leaf, bound| {
                for k in leaf {
                    let mut one = Nearest::NONE;
                    one.try_segment(k, &segments[k], x, r);
                    if one.d2 <= bound {
                        list.push(k as u32);
                    }
                }
                bound
            });
    }
}
