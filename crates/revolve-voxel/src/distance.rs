//! Signed distance to the surface.
//!
//! The nearest point of a surface of revolution lies in the point's own half-plane, so this is a distance to a polyline
//! in the plane, found in a tree of boxes.

use nalgebra::Point3;

use crate::meridian::{Meridian, Segment};

/// Segments to a leaf.
const LEAF: usize = 4;

/// Boxes [x_min, x_max, r_min, r_max] over runs of segments, a complete binary heap with its root at 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BoxTree {
    boxes: Vec<[f64; 4]>,
    first_leaf: usize,
}

const EMPTY: [f64; 4] = [
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

impl BoxTree {
    pub(crate) fn new(segments: &[Segment]) -> Self {
        let join = |a: [f64; 4], b: [f64; 4]| {
            [
                a[0].min(b[0]),
                a[1].max(b[1]),
                a[2].min(b[2]),
                a[3].max(b[3]),
            ]
        };
        let first_leaf = segments.len().div_ceil(LEAF).next_power_of_two();
        let mut boxes = vec![EMPTY; 2 * first_leaf];
        for (k, s) in segments.iter().enumerate() {
            let own = s.bounds();
            let leaf = &mut boxes[first_leaf + k / LEAF];
            *leaf = join(*leaf, own);
        }
        for k in (1..first_leaf).rev() {
            boxes[k] = join(boxes[2 * k], boxes[2 * k + 1]);
        }
        Self { boxes, first_leaf }
    }

    /// Calls `visit` with the segments (of n) in leaves whose boxes meet the given one.
    pub(crate) fn overlapping(&self, with: [f64; 4], n: usize, mut visit: impl FnMut(usize)) {
        let mut stack = vec![1];
        while let Some(k) = stack.pop() {
            let b = &self.boxes[k];
            if b[0] > with[1] || b[1] < with[0] || b[2] > with[3] || b[3] < with[2] {
                continue;
            }
            if k < self.first_leaf {
                stack.push(2 * k + 1);
                stack.push(2 * k);
            } else {
                let first = (k - self.first_leaf) * LEAF;
                (first..(first + LEAF).min(n)).for_each(&mut visit);
            }
        }
    }

    /// Squared distance to a box; infinite to an empty one.
    #[inline(always)]
    fn gap(&self, k: usize, x: f64, r: f64) -> f64 {
        let b = &self.boxes[k];
        let dx = (b[0] - x).max(x - b[1]).max(0.0);
        let dr = (b[2] - r).max(r - b[3]).max(0.0);
        dx * dx + dr * dr
    }

    /// Calls `visit` with the leaves' segments that may be nearer than the square root of `visit`'s last answer.
    #[inline(always)]
    fn search(
        &self,
        x: f64,
        r: f64,
        mut bound: f64,
        n: usize,
        mut visit: impl FnMut(std::ops::Range<usize>, f64) -> f64,
    ) {
        // Depth of a heap of boxes: at most the bits of its length, one pending sibling each.
        let mut stack = [0usize; usize::BITS as usize];
        let mut depth = 1;
        stack[0] = 1;
        while depth > 0 {
            depth -= 1;
            let mut k = stack[depth];
            if self.gap(k, x, r) > bound {
                continue;
            }
            while k < self.first_leaf {
                let (a, b) = (self.gap(2 * k, x, r), self.gap(2 * k + 1, x, r));
                let (near, far, far_gap) = if a <= b {
                    (2 * k, 2 * k + 1, b)
                } else {
                    (2 * k + 1, 2 * k, a)
                };
                if far_gap <= bound {
                    stack[depth] = far;
                    depth += 1;
                }
                k = near;
            }
            if self.gap(k, x, r) <= bound {
                let first = (k - self.first_leaf) * LEAF;
                bound = visit(first..(first + LEAF).min(n), bound);
            }
        }
    }
}

/// The segment nearest a point, how far along it, and the squared distance.
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

    /// Takes the segment if it is nearer; its squared distance.
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
    /// Signed distance of a body point from the surface: negative inside.
    ///
    /// Cost: about the logarithm of the number of segments.
    ///
    /// ```
    /// use revolve_voxel::{Meridian, nalgebra::Point3};
    /// let cylinder = Meridian::new(&[[0.0, 1.0], [4.0, 1.0]])?;
    /// assert_eq!(cylinder.signed_distance(&Point3::new(2.0, 0.6, 0.0)), -0.4);
    /// assert_eq!(cylinder.signed_distance(&Point3::new(7.0, 5.0, 0.0)), 5.0);
    /// # Ok::<(), revolve_voxel::Error>(())
    /// ```
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        self.distance_at(p.x, p.y.hypot(p.z))
    }

    /// Is the body point inside the solid?
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.signed_distance(p) < 0.0
    }

    /// Signed distance in the half-plane.
    pub(crate) fn distance_at(&self, x: f64, r: f64) -> f64 {
        let segments = self.segments();
        let mut nearest = Nearest::NONE;
        self.boxes()
            .search(x, r, nearest.d2, segments.len(), |leaf, _| {
                for k in leaf {
                    nearest.try_segment(k, &segments[k], x, r);
                }
                nearest.d2
            });
        nearest.distance(segments, x, r)
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
