//! A bounding-box tree over the segments of a meridian, for nearest-segment and range queries.

use crate::solid::segment::Segment;

/// Segments per leaf.
pub(crate) const LEAF: usize = 4;

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

    /// Returns the box of all segments.
    pub(crate) fn whole(&self) -> [f64; 4] {
        self.boxes[1]
    }

    /// Returns boxes that together contain all segments, at most so many, a power of two; those without a segment have radii below zero.
    pub(crate) fn level(&self, most: usize) -> &[[f64; 4]] {
        let n = self.first_leaf.min(most);
        &self.boxes[n..2 * n]
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
    pub(crate) fn gap(&self, k: usize, x: f64, r: f64) -> f64 {
        let b = &self.boxes[k];
        let dx = (b[0] - x).max(x - b[1]).max(0.0);
        let dr = (b[2] - r).max(r - b[3]).max(0.0);
        dx * dx + dr * dr
    }

    /// Calls `visit` with the segments of leaves that may be nearer than the square root of the last result of `visit`.
    #[inline(always)]
    pub(crate) fn search(
        &self,
        x: f64,
        r: f64,
        mut bound: f64,
        n: usize,
        mut visit: impl FnMut(std::ops::Range<usize>, f64) -> f64,
    ) {
        // Depth of a heap of boxes: at most the number of bits of its length, with one pending sibling each.
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
