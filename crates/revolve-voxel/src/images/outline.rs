//! Outlines of solids on the detector, at which line integrals are not smooth.
//!
//! The rays of a row cut a solid of revolution along a plane curve: it contains points of the parallel (x, r) at `foot +- side sqrt(r^2 - rho(x)^2)`,
//! where rho(x) is the distance of the plane from the axis. A line integral is not smooth at the positions u at which this curve turns, which are
//! local extrema of u along the curve, and at its corners. The heights of the rows are divided at the local extrema of v over the whole surface.

use nalgebra::Vector3;

use crate::images::plane::{Quotient, RayPlane, RayRow};
use crate::{Body, Meridian, Organ};

/// Parts of a smooth meridian between which extrema are searched.
const PARTS: usize = 40;
/// Steps of the search for an extremum, which is flat: its position is accurate to 1e-4 of a part and its value to 1e-8; number of bisections.
const SEARCH: usize = 20;
const STEPS: usize = 50;
/// The inverse of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// A layer of a body, with the vertices between which extrema are searched.
#[derive(Debug)]
pub(super) struct Path<'a> {
    body: &'a Body,
    layer: &'a Meridian,
    /// Indices of vertices, ascending, and whether each is a corner.
    knots: Vec<(usize, bool)>,
}

impl<'a> Path<'a> {
    /// `least` is the sine of the smallest turn of a corner that divides panels.
    pub(super) fn new(body: &'a Body, layer: &'a Meridian, least: f64) -> Self {
        let segments = layer.segments();
        let n = segments.len();
        let step = n.div_ceil(PARTS).max(1);
        let is_corner = |k: usize| {
            let (before, next) = (&segments[(k + n - 1) % n], &segments[k % n]);
            (before.tx * next.tr - before.tr * next.tx).abs() > least
        };
        let knot = |k: usize| {
            let corner = is_corner(k);
            (corner || k.is_multiple_of(step) || k == n).then_some((k, corner))
        };
        Self {
            body,
            layer,
            knots: (0..=n).filter_map(knot).collect(),
        }
    }

    /// Returns the point at a fractional index.
    #[inline(always)]
    fn point(&self, index: f64) -> [f64; 2] {
        let segments = self.layer.segments();
        let segment = &segments[(index as usize).min(segments.len() - 1)];
        let share = index - index.floor().min(segments.len() as f64 - 1.0);
        let ([x0, r0], [x1, r1]) = (segment.start(), segment.end());
        [x0 + share * (x1 - x0), r0 + share * (r1 - r0)]
    }

    /// Appends the positions at which the line integrals along a row are not smooth.
    pub(super) fn add_positions(&self, row: &RayRow, breaks: &mut Vec<f64>) {
        let pose = self.body.pose();
        let (normal, distance) = row.plane();
        let distance = distance - normal.dot(&pose.isometry().translation.vector);
        let normal = pose.vector_to_body(&normal);
        let across = normal.y.hypot(normal.z);
        let position = row.position().in_body(pose);
        if across == 0.0 {
            // The plane is perpendicular to the axis and cuts circles.
            return self.add_circles(distance / normal.x, &position, breaks);
        }
        let (foot, side) = (
            Vector3::new(0.0, normal.y, normal.z) / across,
            Vector3::new(0.0, -normal.z, normal.y) / across,
        );
        // The signed distance rho of the plane from the axis; the position as a quotient of affine functions of x and half the width of the cut.
        let rho = [distance / across, -normal.x / across];
        let along = Vector3::x() + foot * rho[1];
        let [over, under] = position.on_plane(&(foot * rho[0]), [&along, &side]);
        let depth = |index: f64| {
            let [x, r] = self.point(index);
            let rho = rho[0] + rho[1] * x;
            (r - rho) * (r + rho)
        };
        for part in self.positive_parts(depth) {
            for sign in [-1.0, 1.0] {
                let value = |index: f64| {
                    let half = sign * depth(index).max(0.0).sqrt();
                    let [x, _] = self.point(index);
                    let of = |[a, b, c]: [f64; 3]| a + b * x + c * half;
                    of(over) / of(under)
                };
                self.add_extrema(value, part, breaks);
            }
        }
    }

    /// Returns the ranges of the index between whose ends a function is positive.
    fn positive_parts(&self, depth: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let knots = self.knots.iter().map(|(k, _)| *k as f64);
        let mut samples: Vec<[f64; 2]> = knots.map(|index| [index, depth(index)]).collect();
        // A part between two knots is found at the extremum.
        let turns = samples.windows(3).filter_map(|three| {
            let [[from, a], [_, b], [to, c]] = [three[0], three[1], three[2]];
            let hides = (b <= 0.0 && a <= b && c <= b) || (b > 0.0 && a >= b && c >= b);
            hides.then(|| extreme(&depth, [from, to], b <= 0.0))
        });
        let turns: Vec<[f64; 2]> = turns.map(|(index, value)| [index, value]).collect();
        samples.extend(turns);
        samples.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let mut parts = Vec::new();
        let mut from = samples
            .first()
            .filter(|[_, depth]| *depth > 0.0)
            .map(|[at, _]| *at);
        for pair in samples.windows(2) {
            let [[a, before], [b, after]] = [pair[0], pair[1]];
            match (before > 0.0, after > 0.0) {
                (false, true) => from = Some(boundary(&depth, a, b)),
                (true, false) => {
                    parts.extend(from.take().map(|from| [from, boundary(&depth, b, a)]))
                }
                _ => {}
            }
        }
        parts.extend(from.zip(samples.last()).map(|(from, last)| [from, last[0]]));
        parts
    }

    /// Appends the extreme positions on the circles in which a plane perpendicular to the axis cuts the layer.
    fn add_circles(&self, x: f64, position: &Quotient, breaks: &mut Vec<f64>) {
        for segment in self.layer.segments() {
            let ([x0, r0], [x1, r1]) = (segment.start(), segment.end());
            if (x0 - x) * (x1 - x) <= 0.0 && x0 != x1 {
                let r = r0 + (r1 - r0) * (x - x0) / (x1 - x0);
                breaks.extend(position.on_parallel([x, r]));
            }
        }
    }

    /// Appends the heights at which the integrals of the rows are not smooth.
    pub(super) fn add_heights(&self, plane: &RayPlane, breaks: &mut Vec<f64>) {
        let height = plane.height().in_body(self.body.pose());
        let all = [0.0, self.layer.segments().len() as f64];
        for end in 0..2 {
            let value = |index: f64| height.on_parallel(self.point(index))[end];
            self.add_extrema(value, all, breaks);
        }
    }

    /// Appends the local extrema of a function between two indices, and its values at corners.
    fn add_extrema(
        &self,
        value: impl Fn(f64) -> f64,
        [low, high]: [f64; 2],
        breaks: &mut Vec<f64>,
    ) {
        let known = self.knots.iter().map(|(k, corner)| (*k as f64, *corner));
        let mut knots: Vec<(f64, bool)> = known
            .filter(|(index, _)| low <= *index && *index <= high)
            .collect();
        if knots.first().is_none_or(|(index, _)| *index > low) {
            knots.insert(0, (low, false));
        }
        if knots.last().is_none_or(|(index, _)| *index < high) {
            knots.push((high, false));
        }
        // The part before this one, and whether the function rises there.
        let mut before: Option<([f64; 2], bool)> = None;
        let mut from = value(low);
        for (k, pair) in knots.windows(2).enumerate() {
            let [(a, corner), (b, _)] = [pair[0], pair[1]];
            let (part, to) = ([a, b], value(b));
            breaks.extend(corner.then_some(from));
            let up = to > from;
            if let Some((other, rising)) = before
                && rising != up
            {
                // The slope may change within either of two parts.
                breaks.extend([part, other].map(|part| extreme(&value, part, !up).1));
            }
            // At its ends a curve closes with an infinite slope.
            if k == 0 || k + 2 == knots.len() {
                breaks.extend([false, true].map(|largest| extreme(&value, part, largest).1));
            }
            (before, from) = (Some((part, up)), to);
        }
    }
}

/// Returns the index between one where a function is not positive and one where it is, on the positive side.
fn boundary(value: impl Fn(f64) -> f64, mut out: f64, mut within: f64) -> f64 {
    for _ in 0..STEPS {
        let middle = 0.5 * (out + within);
        if value(middle) > 0.0 {
            within = middle;
        } else {
            out = middle;
        }
    }
    within
}

/// Returns index and value of the largest or smallest value between two indices, by golden-section search.
fn extreme(value: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2], largest: bool) -> (f64, f64) {
    let sign = if largest { 1.0 } else { -1.0 };
    let of = |index: f64| sign * value(index);
    let inner = |low: f64, high: f64| low + (1.0 - GOLDEN) * (high - low);
    let [mut a, mut b] = [inner(low, high), inner(high, low)];
    let [mut at_a, mut at_b] = [of(a), of(b)];
    let mut best = (low, of(low));
    let mut keep = |index: f64, value: f64| {
        if value > best.1 {
            best = (index, value);
        }
    };
    keep(high, of(high));
    for _ in 0..SEARCH {
        keep(a, at_a);
        keep(b, at_b);
        if at_a < at_b {
            (low, a, at_a) = (a, b, at_b);
            b = inner(high, low);
            at_b = of(b);
        } else {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high);
            at_a = of(a);
        }
    }
    (best.0, sign * best.1)
}

/// Appends the positions of the outline of an organ in a row.
pub(super) fn add_organ_positions(organ: &Organ, row: &RayRow, breaks: &mut Vec<f64>) {
    let (position, plane) = (row.position(), row.plane());
    let ends = match organ.shape.is_cylinder() {
        false => position.on_cut(&organ.shape, plane),
        true => position.on_cylinder(&organ.shape, plane),
    };
    breaks.extend(ends.into_iter().flatten());
}

/// Appends the heights of the rows that touch an organ; none for a cylinder along z.
pub(super) fn add_organ_heights(organ: &Organ, plane: &RayPlane, breaks: &mut Vec<f64>) {
    if !organ.shape.is_cylinder() {
        breaks.extend(plane.height().on_ellipsoid(&organ.shape));
    }
}
