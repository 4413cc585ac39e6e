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
    is_plane: bool,
}

impl<'a> Face<'a> {
    /// The cone of a vertex, between two planes or unbounded.
    pub(crate) fn cone(vertex: &'a Vertex, planes: [f64; 2]) -> Self {
        Self {
            vertex,
            planes,
            is_plane: false,
        }
    }

    /// The plane at x: a cone bounded there on both sides.
    pub(crate) fn plane(vertex: &'a Vertex, x: f64) -> Self {
        Self {
            vertex,
            planes: [x; 2],
            is_plane: true,
        }
    }

    /// Returns the outward normal (x, r) of a cone; `None` for a plane.
    pub(crate) fn normal(&self) -> Option<[f64; 2]> {
        let v = self.vertex;
        (!self.is_plane).then_some([-v.tr, v.tx])
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
            let (w, q, direction) = (self.w[lane], self.q[lane], direction(lane));
            ends[0][lane] = direction.enter(w, q, &entry.vertex(lane), entry.planes(lane));
            let leave = direction.leave(w, q, &exit.vertex(lane), exit.planes(lane));
            ends[1][lane] = ordered(ends[0][lane], leave).1;
        }
        let len = std::mem::take(&mut self.len);
        (0..len).map(move |lane| (self.of[lane], ends.map(|t| t[lane])))
    }
}

impl Direction {
    /// Returns the parameters of entry and exit of the line (w, q) through two faces, in this order.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Meridian;
    use nalgebra::Vector3;

    /// The loop, compiled for each instruction set.
    struct Drain<'a>(&'a mut Batch<usize>, &'a Direction);

    impl simd_set::Work for Drain<'_> {
        type Out = Vec<(usize, [f64; 2])>;

        #[inline(always)]
        fn run(self) -> Self::Out {
            self.0.drain(|_| *self.1).collect()
        }
    }

    /// Steep and flat lines in both directions, widening and narrowing cones, planes, lines that miss.
    #[test]
    fn several_lines_and_single_lines_are_bitwise_identical() {
        let meridian = Meridian::new(&[[-0.7, 1.0], [1.3, 2.0]]).unwrap();
        let mut compared = 0;
        for k in 0..400 {
            let at = |a: f64| (k as f64 * a).sin();
            let d = Vector3::new(at(0.7), at(1.1), at(1.9)).normalize();
            let direction = Direction::new(&meridian, 0.0, &d);
            let turn = 1.5 * at(2.3);
            let vertex = Vertex {
                x: at(2.9),
                r: 1.0 + at(3.1),
                tx: turn.cos(),
                tr: turn.sin(),
            };
            let faces = [
                Face::cone(&vertex, [vertex.x, vertex.x + 0.3]),
                Face::plane(&vertex, vertex.x),
                Face::cone(&vertex, [f64::NEG_INFINITY, f64::INFINITY]),
            ];
            let mut batch = Batch::default();
            let lines = [0, 1, 2, 3, 4].map(|n| {
                let line = [at(3.7 + n as f64), at(4.3 + n as f64)];
                (line, [faces[n % 3], faces[(k + n) % 3]])
            });
            for (n, (line, faces)) in lines.iter().enumerate() {
                assert!(!batch.is_full());
                batch.push(*line, faces, n);
            }
            let drained = simd_set::Set::detect().run(Drain(&mut batch, &direction));
            assert_eq!(drained.len(), lines.len());
            for (n, ends) in drained {
                let (line, faces) = &lines[n];
                let alone = direction.ends(*line, faces).map(f64::to_bits);
                assert_eq!(ends.map(f64::to_bits), alone);
                compared += 1;
            }
            assert_eq!(batch.drain(|_| direction).count(), 0);
        }
        assert_eq!(compared, 2000);
    }
}
