//! Rotation of the material of a wall about its axis, and the part of a line in a wedge that rotates with it.

use std::sync::Arc;

use nalgebra::Point3;

use crate::error::finite;
use crate::solid::wedge::Wedge;
use crate::wall::body_line::BodyLine;
use crate::{RevolveError, Shell};

/// Intervals of s on which the angles are linear.
const INTERVALS: usize = 512;
/// Largest length of a step along a line, and the smallest, relative to the size of the wall.
const STEPS: [f64; 2] = [1.0 / 256.0, 1.0 / 16.0];
/// Largest change of the angle in a step, radians.
const MOST_CHANGE: f64 = 0.05;
/// A step is halved if the depth below a side has an extremum in it that is smaller than this fraction of half its length, at most so
/// often: there the line nearly touches the side.
const GRAZING: f64 = 0.1;
const DEEPEST: u32 = 6;
/// A point on the surface of the wall may be outside it by rounding: the angle is then that of a point displaced by these fractions of
/// the way to the middle of the step.
const NUDGES: [f64; 4] = [0.0, 1e-9, 1e-6, 1e-3];

/// Rotation of each material point of a wall about the axis, from body y to body z: linear in the layer, and between equally spaced
/// s. It rotates every circle about the axis, so that it preserves volumes.
#[doc(alias = "torsion")]
#[derive(Debug, Clone, PartialEq)]
pub struct WallTwist {
    shell: Arc<Shell>,
    /// Angles on the inner and the outer meridian, radians.
    angles: Vec<[f64; 2]>,
    range: [f64; 2],
    /// Length of a step along a line.
    step: f64,
    /// Largest change of the angle in a step.
    change: f64,
}

impl WallTwist {
    /// The angles in radians on the inner and the outer meridian at s; between 513 equally spaced values they are interpolated.
    ///
    /// Example: [`Sector::with_twist`](crate::Sector::with_twist). Lines are followed in steps in which the angle changes by at most
    /// 0.05, but not shorter than 1/256 of the size of the wall ([`is_steep`](Self::is_steep)).
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for an angle.
    pub fn new(shell: Arc<Shell>, angles: impl Fn(f64) -> [f64; 2]) -> Result<Self, RevolveError> {
        let [first, last] = shell.isolines.range;
        let place = |k: usize| first + (last - first) * k as f64 / INTERVALS as f64;
        let angles: Vec<[f64; 2]> = (0..=INTERVALS).map(|k| angles(place(k))).collect();
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for angle in angles.iter().flatten() {
            finite("angle of the twist", *angle)?;
            range = [range[0].min(*angle), range[1].max(*angle)];
        }
        // Changes for each unit of length, along both meridians and across the wall.
        let size = shell.isolines.size;
        let mut steepest = 0.0f64;
        let points = |k: usize| [0.0, 1.0].map(|layer| shell.point(layer, place(k)));
        let mut change = |[a, b]: [f64; 2], [p, q]: [[f64; 2]; 2]| {
            let length = (q[0] - p[0]).hypot(q[1] - p[1]);
            steepest = steepest.max((b - a).abs() / length.max(1e-9 * size));
        };
        for k in 0..=INTERVALS {
            change(angles[k], points(k));
            for side in (0..2).filter(|_| k > 0) {
                let ends = [points(k - 1), points(k)].map(|points| points[side]);
                change([k - 1, k].map(|k| angles[k][side]), ends);
            }
        }
        let [least, most] = STEPS.map(|step| step * size);
        let step = (MOST_CHANGE / steepest).clamp(least, most);
        Ok(Self {
            step,
            change: step * steepest,
            shell,
            angles,
            range,
        })
    }

    /// Whether the angle changes by more than 0.05 radians within 1/256 of the size of the wall. Sectors are then less accurate where
    /// it does.
    #[must_use]
    pub fn is_steep(&self) -> bool {
        self.change > (1.0 + 1e-9) * MOST_CHANGE
    }

    /// Returns the angle in radians at a point (x, r); `None` outside the wall.
    fn angle(&self, p: [f64; 2]) -> Option<f64> {
        let [layer, s] = self.shell.locate(p)?;
        let [first, last] = self.shell.isolines.range;
        let at = ((s - first) / (last - first)).clamp(0.0, 1.0) * INTERVALS as f64;
        let k = (at as usize).min(INTERVALS - 1);
        let ends =
            [k, k + 1].map(|k| (1.0 - layer) * self.angles[k][0] + layer * self.angles[k][1]);
        Some(ends[0] + (at - k as f64) * (ends[1] - ends[0]))
    }

    /// Returns the angle at a point (x, r). If rounding puts it outside the wall, it is moved a little towards a point inside; if that does not suffice, the
    /// result is the mean of the smallest and the largest angle.
    pub(crate) fn angle_near(&self, [x, r]: [f64; 2], [to_x, to_r]: [f64; 2]) -> f64 {
        let at = |nudge: f64| self.angle([x + nudge * (to_x - x), r + nudge * (to_r - r)]);
        let found = NUDGES.iter().find_map(|nudge| at(*nudge));
        found.unwrap_or(0.5 * (self.range[0] + self.range[1]))
    }

    /// Returns the smallest and the largest angle.
    pub(crate) fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the position before the twist of a body point; `None` outside the wall.
    pub(crate) fn before(&self, p: &Point3<f64>) -> Option<Point3<f64>> {
        Some(rotated_back(p, self.angle([p.x, p.y.hypot(p.z)])?))
    }

    /// Returns the derivatives of the angle with respect to x and r at a point of the wall, by differences.
    pub(crate) fn slopes(&self, p: [f64; 2]) -> [f64; 2] {
        let step = 1e-5 * self.shell.isolines.size;
        [[step, 0.0], [0.0, step]].map(|[x, r]| {
            let at = |way: f64| Some([way, self.angle([p[0] + way * x, p[1] + way * r])?]);
            // To one side only where the other is outside the wall.
            match (at(-1.0).or_else(|| at(0.0)), at(1.0).or_else(|| at(0.0))) {
                (Some([from, a]), Some([to, b])) if from < to => (b - a) / ((to - from) * step),
                _ => 0.0,
            }
        })
    }

    /// Calls `each` with the parts of an interval of a line in the wall that are in a twisted wedge, in order; adjacent ones may meet.
    ///
    /// In each step the depths below both sides are quadratics through three points; one step of Newton's method with the exact
    /// depth corrects their roots.
    pub(crate) fn trace(
        &self,
        wedge: &Wedge,
        line: &BodyLine,
        [from, to]: [f64; 2],
        mut each: impl FnMut([f64; 2]),
    ) {
        let n = ((to - from) / self.step).ceil().clamp(1.0, 1.0 / STEPS[0]) as u32;
        let at = |k: u32| match k == n {
            true => to,
            false => from + (to - from) * f64::from(k) / f64::from(n),
        };
        let mut depths = self.depths(wedge, line, from, 0.5 * (from + at(1)));
        for k in 0..n {
            let ends = ([at(k), at(k + 1)], DEEPEST);
            depths = self.trace_step(wedge, line, ends, depths, &mut each);
        }
    }

    /// As [`trace`](Self::trace) in one step, from the depths at its start; returns those at its end.
    fn trace_step(
        &self,
        wedge: &Wedge,
        line: &BodyLine,
        ([from, to], deepest): ([f64; 2], u32),
        start: [f64; 2],
        each: &mut impl FnMut([f64; 2]),
    ) -> [f64; 2] {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let centre = self.depths(wedge, line, middle, middle);
        let end = self.depths(wedge, line, to, middle);
        let sides = [0, 1].map(|side| Quadratic::through([start, centre, end].map(|d| d[side])));
        if deepest > 0 && sides.iter().any(|side| side.touches(GRAZING * half)) {
            let [left, right] = [[from, middle], [middle, to]].map(|ends| (ends, deepest - 1));
            let known = self.trace_step(wedge, line, left, start, each);
            return self.trace_step(wedge, line, right, known, each);
        }
        let mut ends = vec![-1.0, 1.0];
        for (side, depth) in sides.iter().enumerate() {
            for root in depth.roots().into_iter().filter(|root| root.abs() < 1.0) {
                let exact = self.depths(wedge, line, middle + half * root, middle)[side];
                let moved = root - exact / depth.slope(root);
                ends.push(if moved.abs() <= 1.0 { moved } else { root });
            }
        }
        ends.sort_by(f64::total_cmp);
        // The ends of the step are exact, so that parts of adjacent steps meet.
        let at = |u: f64| match u.abs() == 1.0 {
            true if u < 0.0 => from,
            true => to,
            false => middle + half * u,
        };
        for pair in ends.windows(2) {
            let between = 0.5 * (pair[0] + pair[1]);
            if pair[0] < pair[1] && wedge.holds(sides.each_ref().map(|side| side.at(between))) {
                each([at(pair[0]), at(pair[1])]);
            }
        }
        end
    }

    /// Depths below the sides of a twisted wedge, on a line in the wall at `t`, in a step around `middle`.
    fn depths(&self, wedge: &Wedge, line: &BodyLine, t: f64, middle: f64) -> [f64; 2] {
        let (origin, along, _) = &line.parts;
        let place = |t: f64| {
            let p = origin + along * t;
            (p, [p.x, p.y.hypot(p.z)])
        };
        let ((point, own), (_, inner)) = (place(t), place(middle));
        let angle = self.angle_near(own, inner);
        let before = rotated_back(&point, angle);
        wedge.depths(&before)
    }
}

/// Returns a body point rotated about the axis from body z to body y.
fn rotated_back(p: &Point3<f64>, angle: f64) -> Point3<f64> {
    let (sin, cos) = angle.sin_cos();
    Point3::new(p.x, cos * p.y + sin * p.z, cos * p.z - sin * p.y)
}

/// `a u^2 + b u + c` for u from -1 to 1.
struct Quadratic([f64; 3]);

impl Quadratic {
    /// Through values at -1, 0 and 1.
    fn through([left, centre, right]: [f64; 3]) -> Self {
        Self([0.5 * (left + right) - centre, 0.5 * (right - left), centre])
    }

    fn at(&self, u: f64) -> f64 {
        let [a, b, c] = self.0;
        (a * u + b) * u + c
    }

    fn slope(&self, u: f64) -> f64 {
        let [a, b, _] = self.0;
        2.0 * a * u + b
    }

    /// Whether it has an extremum between -1 and 1 with at most this absolute value.
    fn touches(&self, near: f64) -> bool {
        let [a, b, _] = self.0;
        let extremum = -b / (2.0 * a);
        extremum.abs() < 1.0 && self.at(extremum).abs() <= near
    }

    /// Its roots; not finite where it has fewer than two.
    fn roots(&self) -> [f64; 2] {
        let [a, b, c] = self.0;
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            return [f64::NAN; 2];
        }
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        [q / a, c / q]
    }
}
