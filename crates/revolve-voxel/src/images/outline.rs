//! Where line integrals are not smooth: the outlines of solids on the detector.
//!
//! The rays of a row cut a solid of revolution along a plane curve: the parallel (x, r) is met at `foot +- side sqrt(r^2 - rho(x)^2)`, where rho(x) is
//! the distance of the plane from the axis. A line integral is not smooth at the positions u at which this curve turns, which are local extrema
//! of u along the curve, and at its corners. The heights of the rows are divided at the local extrema of v over the whole surface.

use nalgebra::Vector3;

use crate::images::plane::{Quotient, RayPlane, RayRow};
use crate::{Body, Meridian, Organ, OrganShape};

/// Corners of a meridian whose sine of the turn exceeds this divide panels.
const CORNER: f64 = 0.1;
/// Parts of a smooth meridian between which extrema are searched.
const PARTS: usize = 64;
/// Steps of the search for an extremum, which is flat: it is located to 1e-5 of a part and known to 1e-10; and of bisections.
const SEARCH: usize = 24;
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
    pub(super) fn new(body: &'a Body, layer: &'a Meridian) -> Self {
        let segments = layer.segments();
        let n = segments.len();
        let step = n.div_ceil(PARTS).max(1);
        let is_corner = |k: usize| {
            let (before, next) = (&segments[(k + n - 1) % n], &segments[k % n]);
            (before.tx * next.tr - before.tr * next.tx).abs() > CORNER
        };
        let knot = |k: usize| {
            let corner = is_corner(k);
            (corner || k % step == 0 || k == n).then_some((k, corner))
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
        for sign in [-1.0, 1.0] {
            let value = |[x, r]: [f64; 2]| {
                let rho = rho[0] + rho[1] * x;
                let square = (r - rho) * (r + rho);
                (square > 0.0).then(|| {
                    let half = sign * square.sqrt();
                    let of = |[a, b, c]: [f64; 3]| a + b * x + c * half;
                    of(over) / of(under)
                })
            };
            self.add_extrema(value, breaks);
        }
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
        for end in 0..2 {
            self.add_extrema(|p| Some(height.on_parallel(p)[end]), breaks);
        }
    }

    /// Appends the local extrema of a function of the points of the meridian, its values at corners, and its extrema near the ends of the parts
    /// where it is defined.
    fn add_extrema(&self, value: impl Fn([f64; 2]) -> Option<f64>, breaks: &mut Vec<f64>) {
        let at = |index: f64| value(self.point(index));
        let mut start = at(0.0);
        // A ring begins off the axis.
        breaks.extend(start.filter(|_| self.point(0.0)[1] > 0.0));
        // The part before this one, and whether the function rises there.
        let mut before: Option<([f64; 2], bool)> = None;
        for pair in self.knots.windows(2) {
            let [(from, _), (to, corner)] = [pair[0], pair[1]];
            let part = [from, to].map(|k| k as f64);
            let end = at(part[1]);
            let rising = match (start, end) {
                (Some(low), Some(high)) => {
                    let up = high > low;
                    // The slope may change within either of two parts.
                    if let Some((other, rising)) = before
                        && rising != up
                    {
                        breaks.extend(extreme(at, part, !up));
                        breaks.extend(extreme(at, other, !up));
                    }
                    Some(up)
                }
                (None, None) => None,
                _ => {
                    // The curve of both signs closes here, where its slope is infinite.
                    let edge = boundary(|index| at(index).is_some(), part, end.is_some());
                    let inside = match end {
                        Some(_) => [edge, part[1]],
                        None => [part[0], edge],
                    };
                    breaks.extend(
                        [false, true]
                            .iter()
                            .flat_map(|most| extreme(at, inside, *most)),
                    );
                    None
                }
            };
            breaks.extend(end.filter(|_| corner));
            before = rising.map(|up| (part, up));
            start = end;
        }
    }
}

/// Returns the index at which a function becomes defined (`up`) or ceases to be, on the defined side.
fn boundary(inside: impl Fn(f64) -> bool, [from, to]: [f64; 2], up: bool) -> f64 {
    let (mut out, mut within) = if up { (from, to) } else { (to, from) };
    for _ in 0..STEPS {
        let middle = 0.5 * (out + within);
        if inside(middle) {
            within = middle;
        } else {
            out = middle;
        }
    }
    within
}

/// Returns the largest or smallest value between two indices, by golden-section search.
fn extreme(
    value: impl Fn(f64) -> Option<f64>,
    [mut low, mut high]: [f64; 2],
    largest: bool,
) -> Option<f64> {
    let sign = if largest { 1.0 } else { -1.0 };
    let of = |index: f64| value(index).map_or(f64::NEG_INFINITY, |v| sign * v);
    let inner = |low: f64, high: f64| low + (1.0 - GOLDEN) * (high - low);
    let [mut a, mut b] = [inner(low, high), inner(high, low)];
    let [mut at_a, mut at_b] = [of(a), of(b)];
    let mut best = of(low).max(of(high));
    for _ in 0..SEARCH {
        best = best.max(at_a).max(at_b);
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
    best.is_finite().then_some(sign * best)
}

/// Appends the positions of the outline of an organ in a row.
pub(super) fn add_organ_positions(organ: &Organ, row: &RayRow, breaks: &mut Vec<f64>) {
    let (position, plane) = (row.position(), row.plane());
    breaks.extend(
        match &organ.shape {
            OrganShape::Ellipsoid(ellipsoid) => position.on_cut(ellipsoid, plane),
            OrganShape::Cylinder(cylinder) => position.on_cylinder(cylinder, plane),
        }
        .into_iter()
        .flatten(),
    );
}

/// Appends the heights of the rows that touch an organ; none for a cylinder along z.
pub(super) fn add_organ_heights(organ: &Organ, plane: &RayPlane, breaks: &mut Vec<f64>) {
    if let OrganShape::Ellipsoid(ellipsoid) = &organ.shape {
        breaks.extend(plane.height().on_ellipsoid(ellipsoid));
    }
}
