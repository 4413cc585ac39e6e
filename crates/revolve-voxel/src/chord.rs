//! A line through the convex solid under a chain: two ends, each a closed form.

use nalgebra::{Point3, Vector3};

use crate::chains::{Chain, Kind, Vertex};
use crate::meridian::Meridian;

/// One direction of lines in a body frame.
///
/// A line of direction (c, s e1) is `x = -s w + c t` (from the body's middle), `y = c w + s t` (along e1), `z = q`
/// (along e2): its coordinates are w and |q|, for the body is its own mirror image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direction {
    pub(crate) c: f64,
    pub(crate) s: f64,
    e1: [f64; 2],
    mid: f64,
    inv_c: f64,
    inv_sc: f64,
    /// Sign of c, never zero.
    along: f64,
    /// Parameter of a vertex plane from `w + s x` rather than from x: the one that keeps digits.
    steep: bool,
}

/// A line of that direction.
#[derive(Debug, Clone, Copy)]
struct Line {
    w: f64,
    q2: f64,
    /// c^2 and c^2 q^2, s w, and the offset of the plane parameters.
    c2: f64,
    c2q2: f64,
    sw: f64,
    shift: f64,
}

/// Where a line enters or leaves a chain's solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct End {
    pub(crate) t: f64,
    /// The cone, or none for an end plane.
    pub(crate) cone: Option<usize>,
}

/// Where the last line of a sweep met a chain: the next one is near.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Hint {
    low: Guess,
    high: Guess,
    valley: usize,
    /// The last line met the solid.
    met: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Guess {
    last: usize,
    step: isize,
}

impl Guess {
    fn next(&self) -> usize {
        self.last.saturating_add_signed(self.step)
    }
    fn found(&mut self, at: usize, fresh: bool) {
        self.step = if fresh {
            0
        } else {
            at as isize - self.last as isize
        };
        self.last = at;
    }
}

impl Direction {
    /// From a unit direction in the body frame; `mid` is the middle of the x range.
    pub(crate) fn new(mid: f64, direction: &Vector3<f64>) -> Self {
        let c = direction.x;
        let s = direction.y.hypot(direction.z);
        Self {
            c,
            s,
            e1: if s > 0.0 {
                [direction.y / s, direction.z / s]
            } else {
                [1.0, 0.0]
            },
            mid,
            inv_c: 1.0 / c,
            inv_sc: 1.0 / (s * c),
            along: if c < 0.0 { -1.0 } else { 1.0 },
            steep: s >= c.abs(),
        }
    }

    /// (w, q, t) of a body point.
    pub(crate) fn coordinates(&self, p: &Point3<f64>) -> [f64; 3] {
        self.slopes(&Vector3::new(p.x - self.mid, p.y, p.z))
    }

    /// Change of (w, q, t) along a body vector.
    pub(crate) fn slopes(&self, v: &Vector3<f64>) -> [f64; 3] {
        let y = v.y * self.e1[0] + v.z * self.e1[1];
        let q = v.z * self.e1[0] - v.y * self.e1[1];
        [self.c * y - self.s * v.x, q, self.c * v.x + self.s * y]
    }

    fn line(&self, w: f64, q: f64) -> Line {
        let (c2, q2, sw) = (self.c * self.c, q * q, self.s * w);
        Line {
            w,
            q2,
            c2,
            c2q2: c2 * q2,
            sw,
            shift: if self.steep {
                -self.c * w / self.s
            } else {
                sw * self.inv_c
            },
        }
    }

    /// Does the line meet the vertex's plane inside its parallel? One rounding of one number decides, for all who ask.
    #[inline(always)]
    fn inside(&self, line: &Line, v: &Vertex) -> bool {
        let u = line.w + self.s * v.x;
        u * u < line.c2 * v.r2 - line.c2q2
    }

    /// Parameter at which the line meets the vertex's plane (infinite or NaN if parallel to it).
    #[inline(always)]
    fn plane(&self, line: &Line, v: &Vertex) -> f64 {
        self.plane_at(line, v.x)
    }

    #[inline(always)]
    fn plane_at(&self, line: &Line, x: f64) -> f64 {
        if self.steep {
            (line.w + self.s * x) * self.inv_sc + line.shift
        } else {
            x * self.inv_c + line.shift
        }
    }

    /// Does the distance from the surface, convex along the line, still fall to the right of this vertex?
    fn falls(&self, line: &Line, v: &Vertex) -> bool {
        let u = line.w + self.s * v.x;
        let rho = (u * u + line.c2q2).sqrt();
        // On the axis itself the distance from it rises to the right.
        let (u, rho) = if rho > 0.0 { (u, rho) } else { (1.0, 1.0) };
        v.tx * self.s * u < v.tr * self.c.abs() * rho
    }

    /// Calls `each` with sign, chain and ends (sorted) of every interval that the line (w, q) has in a chain's solid;
    /// where a whole stretch of the profile is met inside, one interval between its end planes stands for all of them.
    ///
    /// `hints`, one per chain, carry what the last line found.
    #[inline(always)]
    pub(crate) fn intervals(
        &self,
        profile: &Meridian,
        w: f64,
        q: f64,
        hints: &mut [Hint],
        each: &mut impl FnMut(f64, &Chain, [End; 2]),
    ) {
        let line = self.line(w, q);
        let tree = profile.tree();
        let mut at = 0;
        while let Some(node) = tree.get(at) {
            at += 1;
            let [u0, u1] = node.x.map(|x| line.w + self.s * x);
            let (near, far) = ordered(u0 * u0, u1 * u1);
            // Nearest the axis: at an end plane, or between them if the line passes the axis there.
            let least = if u0 * u1 > 0.0 { near } else { 0.0 };
            if least >= line.c2 * node.r2[1] - line.c2q2 {
                if u0 * u1 > 0.0 || line.q2 >= node.r2[1] {
                    at = node.after;
                    continue;
                }
            } else if far < line.c2 * node.r2[0] - line.c2q2 {
                let [a, b] = node.path.map(|x| End {
                    t: self.plane_at(&line, x),
                    cone: None,
                });
                let chain = &profile.chains()[0];
                let forward = (node.path[1] - node.path[0]) * self.along > 0.0;
                let sign = if node.path[1] > node.path[0] {
                    1.0
                } else {
                    -1.0
                };
                each(sign, chain, if forward { [a, b] } else { [b, a] });
                at = node.after;
                continue;
            }
            if let Kind::Leaf(k) = node.kind {
                let chain = &profile.chains()[k];
                if let Some(ends) = self.interval(chain, &line, &mut hints[k]) {
                    each(chain.sign, chain, ends);
                }
            }
        }
    }

    /// Parameters of entry to and exit from the chain's solid, sorted.
    #[inline(always)]
    fn interval(&self, chain: &Chain, line: &Line, hint: &mut Hint) -> Option<[End; 2]> {
        let met = hint.met;
        hint.met = false;
        let vs = &chain.vertices[..];
        let end = vs.len() - 1;
        let first = self.inside(line, &vs[0]);
        let last = self.inside(line, &vs[end]);
        // A vertex plane that the line meets inside: the search for either end starts there.
        let seed = if first {
            0
        } else if last {
            end
        } else {
            let middle = ((hint.low.last + hint.high.last) / 2).min(end);
            if met && self.inside(line, &vs[middle]) {
                middle
            } else {
                // The segment in which the line comes nearest the surface, or deepest under it.
                let right = boundary(
                    |k| !self.falls(line, &vs[k]),
                    -1,
                    end as isize,
                    hint.valley as isize,
                );
                hint.valley = right;
                if right == 0 {
                    // Rising from the first vertex on, where the line is outside.
                    return None;
                }
                if self.inside(line, &vs[right]) {
                    right
                } else if self.inside(line, &vs[right - 1]) {
                    right - 1
                } else {
                    let pair = self.pair(line, vs, right - 1);
                    if pair.is_some() {
                        hint.low.found(right - 1, !met);
                        hint.high.found(right, !met);
                        hint.met = true;
                    }
                    return pair;
                }
            }
        };
        hint.met = true;
        let low = if first {
            hint.low.found(0, !met);
            End {
                t: self.plane(line, &vs[0]),
                cone: None,
            }
        } else {
            let k = boundary(
                |k| self.inside(line, &vs[k]),
                0,
                seed as isize,
                hint.low.next() as isize,
            );
            hint.low.found(k, !met);
            self.end(line, vs, k - 1, self.c > 0.0)
        };
        let high = if last {
            hint.high.found(end, !met);
            End {
                t: self.plane(line, &vs[end]),
                cone: None,
            }
        } else {
            let k = boundary(
                |k| !self.inside(line, &vs[k]),
                seed as isize,
                end as isize,
                hint.high.next() as isize,
            );
            hint.high.found(k, !met);
            self.end(line, vs, k - 1, self.c < 0.0)
        };
        Some(if self.along > 0.0 {
            [low, high]
        } else {
            [high, low]
        })
    }

    /// The crossing of cone k between vertex planes one of which is met inside, the other outside.
    #[inline(always)]
    fn end(&self, line: &Line, vs: &[Vertex], k: usize, enters: bool) -> End {
        // Finite: a line that meets a plane inside is not parallel to it.
        let (low, high) = ordered(self.plane(line, &vs[k]), self.plane(line, &vs[k + 1]));
        let cone = Cone::new(self, line, &vs[k]);
        let t = if enters { cone.enter() } else { cone.leave() };
        // A line along the cone's own generator has no well-defined crossing (t is NaN): any point of the segment will do.
        let t = if t > low { t } else { low };
        End {
            t: if t < high { t } else { high },
            cone: Some(k),
        }
    }

    /// Both crossings of cone k, met outside at both its planes.
    #[inline(always)]
    fn pair(&self, line: &Line, vs: &[Vertex], k: usize) -> Option<[End; 2]> {
        let cone = Cone::new(self, line, &vs[k]);
        if !(cone.a > 0.0 && cone.root > 0.0) {
            return None;
        }
        // The chord's middle tells whether it lies in the segment; its ends may be on the very plane.
        let x = self.c * (-cone.b / cone.a);
        if x < vs[k].x + line.sw || x > vs[k + 1].x + line.sw {
            return None;
        }
        let at = |t: f64| End { t, cone: Some(k) };
        Some([at(cone.enter()), at(cone.leave())])
    }
}

/// `a t^2 + 2 b t + d`, negative inside the double cone through a segment.
struct Cone {
    a: f64,
    b: f64,
    d: f64,
    root: f64,
}

impl Cone {
    /// The discriminant is `tx^2 (g^2 - a q^2)` with `g = s e - f c w`, free of the cancellation in b^2 - a d.
    #[inline(always)]
    fn new(dir: &Direction, line: &Line, v: &Vertex) -> Self {
        let (tx, tr) = (v.tx, v.tr);
        let e = tx * v.r - tr * (v.x + line.sw);
        let f = tr * dir.c;
        let ts = tx * dir.s;
        let cw = dir.c * line.w;
        let a = (ts - f) * (ts + f);
        let b = tx * ts * cw - e * f;
        let d = tx * tx * (cw * cw + line.q2) - e * e;
        let g = dir.s * e - f * cw;
        Self {
            a,
            b,
            d,
            root: tx * (g * g - a * line.q2).max(0.0).sqrt(),
        }
    }

    #[inline(always)]
    fn enter(&self) -> f64 {
        if self.b >= 0.0 {
            (-self.b - self.root) / self.a
        } else {
            self.d / (self.root - self.b)
        }
    }

    #[inline(always)]
    fn leave(&self) -> f64 {
        if self.b > 0.0 {
            self.d / (-self.b - self.root)
        } else {
            (self.root - self.b) / self.a
        }
    }
}

/// Two numbers that are no NaN, the smaller one first: `f64::min` and `max` would ask for NaN each time.
#[inline(always)]
fn ordered(a: f64, b: f64) -> (f64, f64) {
    if a < b { (a, b) } else { (b, a) }
}

/// The first index in (low, high] at which `test` holds, given that it fails at low, holds at high, and changes once.
///
/// Searched outward from a guess, so that the cost is the logarithm of the guess's error.
#[inline(always)]
fn boundary(test: impl Fn(usize) -> bool, mut low: isize, mut high: isize, guess: isize) -> usize {
    let mut step = 1;
    let down = guess >= high || (guess > low && test(guess as usize));
    if down {
        high = high.min(guess);
        while high - step > low {
            let k = high - step;
            if !test(k as usize) {
                low = k;
                break;
            }
            high = k;
            step *= 2;
        }
    } else {
        low = low.max(guess);
        while low + step < high {
            let k = low + step;
            if test(k as usize) {
                high = k;
                break;
            }
            low = k;
            step *= 2;
        }
    }
    while high - low > 1 {
        let k = low + (high - low) / 2;
        if test(k as usize) {
            high = k;
        } else {
            low = k;
        }
    }
    high as usize
}
