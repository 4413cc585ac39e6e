//! Intersects a line with the convex solid under a chain: finds the faces of entry and exit.
//!
//! The crossing of a line with a plane perpendicular to the axis has an error of rounding over c, the cosine of the angle to the
//! axis; it is undefined if the line lies in the plane. Therefore one number per vertex, u, determines on which side of the vertex
//! plane the line passes the axis and whether it crosses the plane inside the solid, for all faces that meet there. An error of u
//! is an error of the vertex position. The ends of an interval are then found on cones alone.
//!
//! A line that is perpendicular to the axis up to rounding is treated as perpendicular and not as lying in a vertex plane: of two
//! faces it intersects the one farther up the axis. A line along a cone or a cylinder is outside: circles of the surface are smaller by
//! rounding.

use crate::rays::cone::{Cone, Face, ordered};
use crate::rays::direction::Direction;
use crate::solid::chains::{Chain, Vertex};
use crate::solid::meridian::Meridian;

/// A line of the given direction.
#[derive(Debug, Clone, Copy)]
struct Line {
    w: f64,
    /// For the plane through the middle of the body.
    u: f64,
    q: f64,
    q2: f64,
    /// c^2 and c^2 q^2.
    c2: f64,
    c2q2: f64,
}

/// Vertices around a guess that are tested together.
const WINDOW: usize = 4;

/// The faces of the previous line of a sweep; those of the next line are near.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Hint {
    low: Guess,
    high: Guess,
    valley: usize,
    /// The previous line intersected the solid.
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
    fn line(&self, w: f64, q: f64) -> Line {
        let (c2, q2) = (self.c * self.c, q * q);
        Line {
            w,
            u: w - self.beyond,
            q,
            q2,
            c2,
            c2q2: c2 * q2,
        }
    }

    /// Signed distance of the line from the axis at the plane x, times c.
    #[inline(always)]
    fn u(&self, line: &Line, x: f64) -> f64 {
        line.u + self.s * x
    }

    /// Returns whether the line intersects the plane at x inside a parallel. All callers use the same rounded number.
    #[inline(always)]
    fn inside(&self, line: &Line, x: f64, r2: f64) -> bool {
        let u = self.u(line, x);
        u * u < line.c2 * r2 - line.c2q2
    }

    /// Returns whether the distance from the cone of a vertex, convex along the line, decreases to the right of x.
    fn falls(&self, line: &Line, cone: &Vertex, x: f64) -> bool {
        let u = self.u(line, x);
        let rho = (u * u + line.c2q2).sqrt();
        // On the axis the distance increases to the right.
        let (u, rho) = if rho > 0.0 { (u, rho) } else { (1.0, 1.0) };
        cone.tx * self.s * u < cone.tr * self.c.abs() * rho
    }

    /// Returns the intervals of the line (w, q) in the solids of the chains; `hints`, one per chain, contain the faces of the
    /// previous line.
    #[inline(always)]
    pub(crate) fn intervals<'a>(
        &'a self,
        meridian: &'a Meridian,
        [w, q]: [f64; 2],
        hints: &'a mut [Hint],
    ) -> Intervals<'a> {
        Intervals {
            direction: self,
            line: self.line(w, q),
            meridian,
            hints,
            at: 0,
        }
    }

    /// Two faces with ascending x, in the order of the line.
    #[inline(always)]
    fn along<T>(&self, [low, high]: [T; 2]) -> [T; 2] {
        if self.along > 0.0 {
            [low, high]
        } else {
            [high, low]
        }
    }

    /// Returns the faces of entry and exit in the solid of a chain, by ascending x.
    #[inline(always)]
    fn interval<'a>(
        &self,
        chain: &'a Chain,
        line: &Line,
        hint: &mut Hint,
    ) -> Option<[Face<'a>; 2]> {
        let met = hint.met;
        hint.met = false;
        let (xs, r2) = (&chain.x[..], &chain.r2[..]);
        let end = xs.len() - 1;
        let inside = |k: usize| self.inside(line, xs[k], r2[k]);
        let (first, last) = (inside(0), inside(end));
        if met {
            let low = if first {
                Some(0)
            } else {
                self.near(line, chain, hint.low.next(), true)
            };
            let high = if last {
                Some(end)
            } else {
                self.near(line, chain, hint.high.next(), false)
            };
            if let (Some(low), Some(high)) = (low, high) {
                return Some(self.found(hint, chain, [low, high], [first, last], false));
            }
        }
        // A vertex plane that the line intersects inside the solid: the search for both ends starts here.
        let seed = if first {
            0
        } else if last {
            end
        } else {
            let middle = ((hint.low.last + hint.high.last) / 2).min(end);
            if met && inside(middle) {
                middle
            } else {
                // The segment in which the line is nearest to or deepest under the surface.
                let right = boundary(
                    |k| !self.falls(line, &chain.vertices[k], xs[k]),
                    -1,
                    end as isize,
                    hint.valley as isize,
                );
                hint.valley = right;
                if right == 0 {
                    // The distance increases from the first vertex, where the line is outside.
                    return None;
                }
                if inside(right) {
                    right
                } else if inside(right - 1) {
                    right - 1
                } else {
                    // The interval is in the segment, or beyond its right end.
                    let vertex = &chain.vertices[right - 1];
                    let cone = Cone::new(self, line.w, line.q, vertex);
                    if self.falls(line, vertex, xs[right]) || !cone.is_met(vertex.tx * self.near) {
                        return None;
                    }
                    hint.low.found(right - 1, !met);
                    hint.high.found(right, !met);
                    hint.met = true;
                    return Some([self.face(vertex, xs[right]); 2]);
                }
            }
        };
        let low = if first {
            0
        } else {
            boundary(inside, 0, seed as isize, hint.low.next() as isize)
        };
        let high = if last {
            end
        } else {
            let guess = hint.high.next() as isize;
            boundary(|k| !inside(k), seed as isize, end as isize, guess)
        };
        Some(self.found(hint, chain, [low, high], [first, last], !met))
    }

    /// Returns the faces at the boundaries before vertices `at`, or the end planes, and stores them as hints.
    #[inline(always)]
    fn found<'a>(
        &self,
        hint: &mut Hint,
        chain: &'a Chain,
        [low, high]: [usize; 2],
        planes: [bool; 2],
        fresh: bool,
    ) -> [Face<'a>; 2] {
        hint.met = true;
        hint.low.found(low, fresh);
        hint.high.found(high, fresh);
        let vs = &chain.vertices[..];
        let face = |k: usize, plane: bool| match plane {
            true => Face::plane(&vs[k], vs[k].x),
            false => self.face(&vs[k - 1], vs[k].x),
        };
        [face(low, planes[0]), face(high, planes[1])]
    }

    /// The cone between a vertex and the next plane, extended by rounding so that no gap to the next cone remains.
    #[inline(always)]
    fn face<'a>(&self, vertex: &'a Vertex, next: f64) -> Face<'a> {
        Face::cone(vertex, [vertex.x - self.slack, next + self.slack])
    }

    /// Returns the first vertex plane beyond the boundary between planes met outside and inside (`enters`), or inside and outside,
    /// if it is near a guess. Branch-free, because the position is unpredictable.
    #[inline(always)]
    fn near(&self, line: &Line, chain: &Chain, guess: usize, enters: bool) -> Option<usize> {
        let start = guess
            .saturating_sub(WINDOW / 2)
            .min(chain.x.len().checked_sub(WINDOW)?);
        let x: &[f64; WINDOW] = chain.x[start..].first_chunk()?;
        let r2: &[f64; WINDOW] = chain.r2[start..].first_chunk()?;
        let mut before = [0u64; WINDOW];
        for k in 0..WINDOW {
            before[k] = u64::from(self.inside(line, x[k], r2[k]) != enters);
        }
        (before[0] == 1 && before[WINDOW - 1] == 0)
            .then(|| start + before.iter().sum::<u64>() as usize)
    }
}

/// The intervals of one line: sign and faces of entry and exit. If a whole part of the meridian is met inside, one interval between
/// its end planes replaces its intervals.
pub(crate) struct Intervals<'a> {
    direction: &'a Direction,
    line: Line,
    meridian: &'a Meridian,
    hints: &'a mut [Hint],
    /// The next node of the tree of the meridian.
    at: usize,
}

impl<'a> Iterator for Intervals<'a> {
    type Item = (f64, [Face<'a>; 2]);

    // Inlined, so that it is compiled for the instruction set of the caller.
    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        let (direction, line) = (self.direction, &self.line);
        while let Some(node) = self.meridian.tree().get(self.at) {
            self.at += 1;
            let [u0, u1] = node.x.map(|x| direction.u(line, x));
            let (near, far) = ordered(u0 * u0, u1 * u1);
            // Nearest to the axis: at an end plane, or between them if the line crosses the axis plane there.
            let least = if u0 * u1 > 0.0 { near } else { 0.0 };
            if least >= line.c2 * node.r2[1] - line.c2q2 {
                if u0 * u1 > 0.0 || line.q2 >= node.r2[1] {
                    self.at = node.after;
                    continue;
                }
            } else if far < line.c2 * node.r2[0] - line.c2q2 {
                self.at = node.after;
                let vertex = &self.meridian.chains()[0].vertices[0];
                let [from, to] = node.path;
                let (sign, x) = if to > from {
                    (1.0, [from, to])
                } else {
                    (-1.0, [to, from])
                };
                return Some((sign, direction.along(x.map(|x| Face::plane(vertex, x)))));
            }
            if let Some(k) = node.chain {
                let chain = &self.meridian.chains()[k];
                if let Some(faces) = direction.interval(chain, line, &mut self.hints[k]) {
                    return Some((chain.sign, direction.along(faces)));
                }
            }
        }
        None
    }
}

/// Returns the first index in (low, high] at which `test` is true, given that it is false at low, true at high, and changes once.
///
/// The search starts at a guess; the cost is the logarithm of the error of the guess.
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
