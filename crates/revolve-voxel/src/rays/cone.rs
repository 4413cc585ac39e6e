//! Closed-form intersection of lines with a face of a solid: a part of a cone between two planes perpendicular to the axis. For one
//! line or several at a time.

use crate::rays::direction::Direction;
use crate::solid::chains::Vertex;

/// Number of lines processed together.
pub(crate) const LANES: usize = 8;

/// A face through which a line enters or leaves a solid: a cone between two planes, or one plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Face<'a> {
    /// For a cone; unused for a plane.
    vertex: &'a Vertex,
    planes: [f64; 2],
}

impl<'a> Face<'a> {
    /// The cone of a vertex, between two planes or unbounded.
    pub(crate) fn cone(vertex: &'a Vertex, planes: [f64; 2]) -> Self {
        Self { vertex, planes }
    }

    /// The plane at x: a cone bounded there on both sides.
    pub(crate) fn plane(vertex: &'a Vertex, x: f64) -> Self {
        Self {
            vertex,
            planes: [x; 2],
        }
    }
}

/// Up to [`LANES`] lines with the faces of entry and exit and associated data.
#[derive(Debug, Clone, Default)]
pub(crate) struct Batch<T> {
    len: usize,
    w: [f64; LANES],
    q: [f64; LANES],
    faces: [Faces; 2],
    of: [T; LANES],
}

/// Faces in lanes.
#[derive(Debug, Clone, Default)]
struct Faces {
    x: [f64; LANES],
    r: [f64; LANES],
    tx: [f64; LANES],
    tr: [f64; LANES],
    planes: [[f64; LANES]; 2],
}

impl Faces {
    #[inline(always)]
    fn set(&mut self, lane: usize, face: &Face<'_>) {
        self.x[lane] = face.vertex.x;
        self.r[lane] = face.vertex.r;
        self.tx[lane] = face.vertex.tx;
        self.tr[lane] = face.vertex.tr;
        self.planes[0][lane] = face.planes[0];
        self.planes[1][lane] = face.planes[1];
    }

    #[inline(always)]
    fn vertex(&self, lane: usize) -> Vertex {
        Vertex {
            x: self.x[lane],
            r: self.r[lane],
            tx: self.tx[lane],
            tr: self.tr[lane],
        }
    }

    #[inline(always)]
    fn planes(&self, lane: usize) -> [f64; 2] {
        [self.planes[0][lane], self.planes[1][lane]]
    }
}

impl<T: Copy> Batch<T> {
    /// Adds the line (w, q) to a batch that is not full; returns its lane.
    #[inline(always)]
    pub(crate) fn push(&mut self, [w, q]: [f64; 2], [entry, exit]: &[Face<'_>; 2], of: T) -> usize {
        let lane = self.len % LANES;
        self.w[lane] = w;
        self.q[lane] = q;
        self.faces[0].set(lane, entry);
        self.faces[1].set(lane, exit);
        self.of[lane] = of;
        self.len = lane + 1;
        lane
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len == LANES
    }

    /// Empties the batch of lines, each with its direction; returns the data of each line with the parameters of entry and exit.
    #[inline(always)]
    pub(crate) fn drain(
        &mut self,
        direction: impl Fn(usize) -> Direction,
    ) -> impl Iterator<Item = (T, [f64; 2])> {
        let mut ends = [[0.0; LANES]; 2];
        let [entry, exit] = &self.faces;
        // Includes unused lanes, which are ignored.
        for lane in 0..LANES {
            let vertices = [entry, exit].map(|faces| faces.vertex(lane));
            let faces = [
                Face::cone(&vertices[0], entry.planes(lane)),
                Face::cone(&vertices[1], exit.planes(lane)),
            ];
            let [enter, leave] = direction(lane).ends([self.w[lane], self.q[lane]], &faces);
            (ends[0][lane], ends[1][lane]) = (enter, leave);
        }
        let len = std::mem::take(&mut self.len);
        (0..len).map(move |lane| (self.of[lane], ends.map(|t| t[lane])))
    }
}

impl Direction {
    /// Returns the parameters of entry and exit of the line (w, q) through two faces, in this order.
    #[inline(always)]
    pub(crate) fn ends(&self, [w, q]: [f64; 2], [entry, exit]: &[Face<'_>; 2]) -> [f64; 2] {
        let enter = self.enter(w, q, entry.vertex, entry.planes);
        let leave = self.leave(w, q, exit.vertex, exit.planes);
        [enter, ordered(enter, leave).1]
    }

    #[inline(always)]
    fn enter(&self, w: f64, q: f64, vertex: &Vertex, planes: [f64; 2]) -> f64 {
        let Cone { a, b, d, root } = Cone::new(self, w, q, vertex);
        let (over, under) = if b >= 0.0 {
            (-b - root, a)
        } else {
            (d, root - b)
        };
        self.between(w, planes, over / under)
    }

    #[inline(always)]
    fn leave(&self, w: f64, q: f64, vertex: &Vertex, planes: [f64; 2]) -> f64 {
        let Cone { a, b, d, root } = Cone::new(self, w, q, vertex);
        let (over, under) = if b > 0.0 {
            (d, -b - root)
        } else {
            (root - b, a)
        };
        self.between(w, planes, over / under)
    }

    /// Clamps the parameter between those of two planes. A line along a generator of the cone has no defined crossing (t is NaN):
    /// any point of the segment is valid.
    #[inline(always)]
    fn between(&self, w: f64, planes: [f64; 2], t: f64) -> f64 {
        let shift = if self.steep {
            -self.c * w / self.s
        } else {
            self.s * w * self.inv_c
        };
        let at = |x: f64| {
            if self.steep {
                (w + self.s * x) * self.inv_sc + shift
            } else {
                x * self.inv_c + shift
            }
        };
        // Finite, because a line that meets a plane inside is not parallel to it.
        let (low, high) = ordered(at(planes[0]), at(planes[1]));
        let t = if t > low { t } else { low };
        if t < high { t } else { high }
    }
}

/// `a t^2 + 2 b t + d`, negative inside the double cone through a segment.
pub(crate) struct Cone {
    a: f64,
    b: f64,
    d: f64,
    root: f64,
}

impl Cone {
    /// The discriminant is `tx^2 (g^2 - a q^2)` with `g = s e - f c w`, free of the cancellation in b^2 - a d.
    #[inline(always)]
    pub(crate) fn new(dir: &Direction, w: f64, q: f64, v: &Vertex) -> Self {
        let (tx, tr) = (v.tx, v.tr);
        let q2 = q * q;
        let e = tx * v.r - tr * (v.x + dir.s * w);
        let f = tr * dir.c;
        let ts = tx * dir.s;
        let cw = dir.c * w;
        let a = (ts - f) * (ts + f);
        let b = tx * ts * cw - e * f;
        let d = tx * tx * (cw * cw + q2) - e * e;
        let g = dir.s * e - f * cw;
        Self {
            a,
            b,
            d,
            root: tx * (g * g - a * q2).max(0.0).sqrt(),
        }
    }

    /// Returns whether the line enters and leaves through the cone, with a root larger than `least`.
    pub(crate) fn is_met(&self, least: f64) -> bool {
        self.a > 0.0 && self.root > least
    }
}

/// Sorts two numbers that are not NaN; `f64::min` and `max` would test for NaN.
#[inline(always)]
pub(crate) fn ordered(a: f64, b: f64) -> (f64, f64) {
    if a < b { (a, b) } else { (b, a) }
}
