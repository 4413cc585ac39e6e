//! Where a line crosses the surface: closed forms, one per cone.

use nalgebra::{Point3, Vector3};

use crate::meridian::{Meridian, Segment};

/// One direction of rays in a meridian's body frame.
///
/// A line of direction (c, s e1) is `x = mid - s w + c t`, `y = c w + s t` (along e1), `z = q` (along e2): its two
/// coordinates are w and |q|, the mirror symmetry of the body makes the sign of q irrelevant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direction {
    pub(crate) c: f64,
    pub(crate) s: f64,
    e1: [f64; 2],
    mid: f64,
}

/// A crossing of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    pub(crate) t: f64,
    pub(crate) enters: bool,
    pub(crate) segment: usize,
}

impl Direction {
    pub(crate) fn new(meridian: &Meridian, direction: &Vector3<f64>) -> Self {
        let s = direction.y.hypot(direction.z);
        let [a, b] = meridian.x_range();
        Self {
            c: direction.x,
            s,
            e1: if s > 0.0 {
                [direction.y / s, direction.z / s]
            } else {
                [1.0, 0.0]
            },
            mid: 0.5 * (a + b),
        }
    }

    /// Coordinates (w, q, t) of a body point on the line through it.
    pub(crate) fn coordinates(&self, p: &Point3<f64>) -> [f64; 3] {
        let x = p.x - self.mid;
        let y = p.y * self.e1[0] + p.z * self.e1[1];
        let q = p.z * self.e1[0] - p.y * self.e1[1];
        [self.c * y - self.s * x, q, self.c * x + self.s * y]
    }

    /// Change of (w, q, t) along a body vector.
    pub(crate) fn slopes(&self, v: &Vector3<f64>) -> [f64; 3] {
        let y = v.y * self.e1[0] + v.z * self.e1[1];
        let q = v.z * self.e1[0] - v.y * self.e1[1];
        [self.c * y - self.s * v.x, q, self.c * v.x + self.s * y]
    }

    /// Calls `found` for each crossing of the line (w, q), in the order of the segments.
    pub(crate) fn crossings(
        &self,
        meridian: &Meridian,
        w: f64,
        q: f64,
        mut found: impl FnMut(Crossing),
    ) {
        let q2 = q * q;
        let c2 = self.c * self.c;
        let sw = self.s * w;
        let c2w = c2 * w;
        // The line meets the plane of a vertex inside its parallel?
        let inside = |x: f64, r: f64| {
            let v = c2w + self.s * x;
            v * v < c2 * (r * r - q2)
        };
        for (k, seg) in meridian.segments().iter().enumerate() {
            if seg.r0 <= q.abs() && seg.r1 <= q.abs() {
                continue;
            }
            let plane0 = seg.x0 - self.mid + sw;
            let plane1 = seg.x1 - self.mid + sw;
            let in0 = inside(plane0, seg.r0);
            let in1 = inside(plane1, seg.r1);
            if in0 && in1 {
                continue;
            }
            if seg.tx == 0.0 {
                if in0 != in1 {
                    found(Crossing {
                        t: plane0 / self.c,
                        enters: (seg.tr > 0.0) == (self.c > 0.0),
                        segment: k,
                    });
                }
                continue;
            }
            let roots = cone(seg, self.c, self.s, w, q2, plane0);
            let forward = seg.tx > 0.0;
            if in0 != in1 {
                // Along the line the cone is left if its inner vertex plane comes first.
                let leaves = in0 == ((self.c > 0.0) == forward);
                let (t0, t1) = (plane0 / self.c, plane1 / self.c);
                let t = if leaves { roots.leave } else { roots.enter };
                let t = if t.is_nan() { t0 } else { t };
                found(Crossing {
                    t: t.max(t0.min(t1)).min(t0.max(t1)),
                    enters: leaves != forward,
                    segment: k,
                });
            } else if roots.a > 0.0 && roots.disc > 0.0 {
                // Outside at both planes: a pair of crossings if the middle of the chord lies between them.
                let x = self.c * roots.middle;
                if (x > plane0) != (x > plane1) {
                    found(Crossing {
                        t: roots.enter,
                        enters: forward,
                        segment: k,
                    });
                    found(Crossing {
                        t: roots.leave,
                        enters: !forward,
                        segment: k,
                    });
                }
            }
        }
    }
}

struct Roots {
    a: f64,
    disc: f64,
    enter: f64,
    leave: f64,
    middle: f64,
}

/// Roots of `tx^2 R(t)^2 = (tx r(t))^2`: a t^2 + 2 b t + d = 0, negative inside the cone.
///
/// The discriminant is `tx^2 (k^2 - a q^2)` with `k = s e - f c w`, free of the cancellation in b^2 - a d.
fn cone(seg: &Segment, c: f64, s: f64, w: f64, q2: f64, plane0: f64) -> Roots {
    let (tx, tr) = (seg.tx, seg.tr);
    let e = tx * seg.r0 - tr * plane0;
    let f = tr * c;
    let a = (tx * s - f) * (tx * s + f);
    let b = tx * tx * s * c * w - e * f;
    let d = tx * tx * (c * c * w * w + q2) - e * e;
    let k = s * e - f * c * w;
    let disc = k * k - a * q2;
    let root = tx.abs() * disc.max(0.0).sqrt();
    let (enter, leave) = if b >= 0.0 {
        let far = -b - root;
        (far / a, d / far)
    } else {
        let far = -b + root;
        (d / far, far / a)
    };
    Roots {
        a,
        disc,
        enter,
        leave,
        middle: -b / a,
    }
}
