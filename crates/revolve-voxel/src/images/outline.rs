//! Outlines of solids on the detector, at which line integrals are not smooth.
//!
//! The rays of a row cut a solid of revolution along a plane curve: it contains points of the parallel (x, r) at `foot +- side sqrt(r^2 - rho(x)^2)`,
//! where rho(x) is the distance of the plane from the axis. A line integral is not smooth at the positions u at which this curve turns, which are
//! local extrema of u along the curve, and at its corners. The heights of the rows are divided at the local extrema of v over the whole surface.

use nalgebra::{Point2, Vector3};

use crate::images::plane::{Quotient, RayPlane, RayRow};
use crate::solid::segment::Segment;
use crate::solid::wedge::Wedge;
use crate::wall::root::golden;
use crate::{Body, Meridian, Organ, Sector};

/// Parts of a smooth meridian between which extrema are searched.
const PARTS: usize = 40;
/// Steps of the golden-section search for an extremum, which is flat: its position is accurate to 1e-4 of a part and its value to 1e-8.
const SEARCH: usize = 20;
/// A plane with a smaller angle to the parallels cuts circles: they are within 1e-8 of their radius.
const PERPENDICULAR: f64 = 1e-8;
/// A plane with a larger slope, radius by axial length, cuts only the parallels within 1/100 of their radius of the point where it meets the
/// axis: a search between knots may miss them, so that they are sampled there.
const STEEP: f64 = 100.0;

/// Returns the sine of the angle by which a meridian turns at vertex k.
fn turn(layer: &Meridian, k: usize) -> f64 {
    let (segments, n) = (layer.segments(), layer.segments().len());
    let (before, next) = (&segments[(k + n - 1) % n], &segments[k % n]);
    (before.tx * next.tr - before.tr * next.tx).abs()
}

/// Returns the vertices at which a ring turns by more than `least`, a sine. A vertex nearer than `apart` to the one before is left out.
fn corners(ring: &Meridian, least: f64, apart: f64) -> Vec<usize> {
    let segments = ring.segments();
    let mut kept: Vec<usize> = (0..segments.len()).collect();
    let place = |k: usize| Point2::from(segments[k].start());
    kept.dedup_by(|next, own| (place(*next) - place(*own)).norm() < apart);
    let n = kept.len();
    let is_corner = |i: &usize| {
        let [a, b, c] = [i + n - 1, *i, i + 1].map(|i| place(kept[i % n]));
        let (before, after) = (b - a, c - b);
        before.perp(&after).abs() > least * before.norm() * after.norm()
    };
    (0..n).filter(is_corner).map(|i| kept[i]).collect()
}

/// Returns the largest sine of the turns of a meridian that do not exceed `least`, reduced in proportion to their distance where corners are nearer to
/// each other than `step`: the errors of quadrature across them nearly cancel.
pub(super) fn largest_turn(layer: &Meridian, least: f64, step: f64) -> f64 {
    let segments = layer.segments();
    let reduced = |k: usize| {
        let apart = segments[k - 1].length.max(segments[k].length);
        match turn(layer, k) {
            own if own <= least => own * (apart / step).min(1.0),
            _ => 0.0,
        }
    };
    (1..segments.len()).map(reduced).fold(0.0, f64::max)
}

/// A layer of a body, with the vertices between which extrema are searched.
#[derive(Debug)]
pub(super) struct Path<'a> {
    body: &'a Body,
    layer: &'a Meridian,
    /// The part of the surface: a sector has no outline elsewhere.
    wedge: &'a Wedge,
    /// Indices of vertices, ascending, and whether each is a corner.
    knots: Vec<(usize, bool)>,
}

impl<'a> Path<'a> {
    /// `least` is the sine of the smallest turn of a corner that divides panels.
    pub(super) fn of_layer(body: &'a Body, layer: &'a Meridian, least: f64) -> Self {
        Self::new(body, layer, &Wedge::Whole, |k| turn(layer, k) > least)
    }

    /// The same for the surface of a sector; vertices nearer than `apart` count as one.
    pub(super) fn of_sector(sector: &'a Sector, least: f64, apart: f64) -> Self {
        let (ring, wedge) = sector.ring();
        let layer = &ring.layers()[0];
        let corners = corners(layer, least, apart);
        Self::new(ring, layer, wedge, |k| {
            corners.contains(&(k % layer.n_segments()))
        })
    }

    fn new(
        body: &'a Body,
        layer: &'a Meridian,
        wedge: &'a Wedge,
        is_corner: impl Fn(usize) -> bool,
    ) -> Self {
        let n = layer.segments().len();
        let step = n.div_ceil(PARTS).max(1);
        let knot = |k: usize| {
            let corner = is_corner(k);
            (corner || k.is_multiple_of(step) || k == n).then_some((k, corner))
        };
        Self {
            body,
            layer,
            wedge,
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
        if across < PERPENDICULAR {
            // The plane is perpendicular to the axis and cuts circles.
            return self.add_circles(distance / normal.x, &position, breaks);
        }
        let (foot, side) = (
            Vector3::new(0.0, normal.y, normal.z) / across,
            Vector3::new(0.0, -normal.z, normal.y) / across,
        );
        let rho = [distance / across, -normal.x / across];
        let along = Vector3::x() + foot * rho[1];
        let [over, under] = position.on_plane(&(foot * rho[0]), [&along, &side]);
        for part in self.positive_parts(rho) {
            for sign in [-1.0, 1.0] {
                let signed = |[a, b, c]: [f64; 3]| [a, b, sign * c];
                let cut = Cut {
                    path: self,
                    rho,
                    over: signed(over),
                    under: signed(under),
                };
                let extreme = |part, largest| cut.extreme(part, largest);
                let is_kept = |index: f64, _: f64| {
                    let [rho, h] = cut.place(index);
                    let place = foot * rho + side * (sign * h);
                    self.wedge.contains(&place.into(), 0.0)
                };
                let position = |index| cut.position(index);
                self.add_extrema((position, extreme, is_kept), part, breaks);
            }
        }
    }

    /// Returns the ranges of the index between whose ends a plane cuts the parallels, at the distance `rho[0] + rho[1] x` from the axis.
    fn positive_parts(&self, rho: [f64; 2]) -> Vec<[f64; 2]> {
        let depth = |index: f64| {
            let [x, r] = self.point(index);
            let rho = rho[0] + rho[1] * x;
            (r - rho) * (r + rho)
        };
        let boundary = |out: f64, within: f64| self.boundary(rho, depth, [out, within]);
        let knots = self.knots.iter().map(|(k, _)| *k as f64);
        let mut samples: Vec<[f64; 2]> = knots.map(|index| [index, depth(index)]).collect();
        // A part between two knots is found at the extremum.
        let turns = samples.windows(3).filter_map(|three| {
            let [[from, a], [_, b], [to, c]] = [three[0], three[1], three[2]];
            let hides = (b <= 0.0 && a <= b && c <= b) || (b > 0.0 && a >= b && c >= b);
            hides.then(|| golden(depth, [from, to], b <= 0.0, SEARCH).0)
        });
        let segments: &[Segment] = match rho[1].abs() > STEEP {
            true => self.layer.segments(),
            false => &[],
        };
        let foot = -rho[0] / rho[1];
        let met = |(k, s): (usize, &Segment)| {
            let is_met = (s.x0 < foot) != (s.x1 < foot);
            is_met.then(|| k as f64 + (foot - s.x0) / (s.x1 - s.x0))
        };
        let met = segments.iter().enumerate().filter_map(met);
        let more: Vec<f64> = turns.chain(met).collect();
        samples.extend(more.into_iter().map(|index| [index, depth(index)]));
        samples.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let mut parts = Vec::new();
        let mut from = samples
            .first()
            .filter(|[_, depth]| *depth > 0.0)
            .map(|[at, _]| *at);
        for pair in samples.windows(2) {
            let [[a, before], [b, after]] = [pair[0], pair[1]];
            match (before > 0.0, after > 0.0) {
                (false, true) => from = Some(boundary(a, b)),
                (true, false) => parts.extend(from.take().map(|from| [from, boundary(b, a)])),
                _ => {}
            }
        }
        parts.extend(from.zip(samples.last()).map(|(from, last)| [from, last[0]]));
        parts
    }

    /// Returns the index between one whose parallel a plane misses and one whose parallel it cuts, at which it touches the parallel.
    fn boundary(
        &self,
        rho: [f64; 2],
        depth: impl Fn(f64) -> f64,
        [mut out, mut within]: [f64; 2],
    ) -> f64 {
        loop {
            // The vertex nearest to the middle.
            let middle = (0.5 * (out + within)).round();
            if middle <= out.min(within) || middle >= out.max(within) {
                break;
            }
            match depth(middle) > 0.0 {
                true => within = middle,
                false => out = middle,
            }
        }
        // Between them r and rho are linear.
        let [from, to] = [out, within].map(|index| self.point(index));
        let side = (rho[0] + rho[1] * from[0]).signum();
        let [from, to] = [from, to].map(|[x, r]| r - side * (rho[0] + rho[1] * x));
        out + (within - out) * (from / (from - to)).clamp(0.0, 1.0)
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
            let extreme = |part, largest| golden(value, part, largest, SEARCH);
            let is_kept = |index: f64, value: f64| {
                let [x, _] = self.point(index);
                self.wedge.contains(&height.place(x, value), 0.0)
            };
            self.add_extrema((value, extreme, is_kept), all, breaks);
        }
    }

    /// Appends the local extrema of a function between two indices, and its values at corners, if they are kept. `extreme` returns the index of the
    /// largest or of the smallest value between two indices, and the value.
    fn add_extrema(
        &self,
        (value, extreme, is_kept): (
            impl Fn(f64) -> f64,
            impl Fn([f64; 2], bool) -> (f64, f64),
            impl Fn(f64, f64) -> bool,
        ),
        [low, high]: [f64; 2],
        breaks: &mut Vec<f64>,
    ) {
        let mut add = |(index, value): (f64, f64)| {
            breaks.extend(is_kept(index, value).then_some(value));
        };
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
            if corner {
                add((a, from));
            }
            let up = to > from;
            if let Some((other, rising)) = before
                && rising != up
            {
                // The slope may change within either of two parts.
                for part in [part, other] {
                    add(extreme(part, !up));
                }
            }
            // At its ends a curve closes with an infinite slope.
            if k == 0 || k + 2 == knots.len() {
                for largest in [false, true] {
                    add(extreme(part, largest));
                }
            }
            (before, from) = (Some((part, up)), to);
        }
    }
}

/// One of both curves in which the plane of a row cuts a layer, h = sqrt(r^2 - rho^2) from the foot of the axis.
struct Cut<'a> {
    path: &'a Path<'a>,
    /// The signed distance of the plane from the axis is `rho[0] + rho[1] x`.
    rho: [f64; 2],
    /// The position u is a quotient of affine functions of x and h: `[constant, of x, of h]`.
    over: [f64; 3],
    under: [f64; 3],
}

/// The slope of the position on a segment: that of u, times a positive function, is `of_root h + line[0] + line[1] s`, where h^2 is
/// `square[0] + square[1] s + square[2] s^2` and s the fraction of the segment.
struct Slope {
    of_root: f64,
    line: [f64; 2],
    square: [f64; 3],
}

impl Cut<'_> {
    /// Returns rho and h at an index.
    #[inline(always)]
    fn place(&self, index: f64) -> [f64; 2] {
        let [x, r] = self.path.point(index);
        let rho = self.rho[0] + self.rho[1] * x;
        [rho, ((r - rho) * (r + rho)).max(0.0).sqrt()]
    }

    /// Returns the position u at an index.
    #[inline(always)]
    fn position(&self, index: f64) -> f64 {
        let ([x, _], [_, h]) = (self.path.point(index), self.place(index));
        let of = |[a, b, c]: [f64; 3]| a + b * x + c * h;
        of(self.over) / of(self.under)
    }

    /// Returns the slope on a segment, from u' D^2 h = (N' D - N D') h for u = N / D.
    fn slope(&self, segment: usize) -> Slope {
        let segment = &self.path.layer.segments()[segment];
        let ([x, r], [to_x, to_r]) = (segment.start(), segment.end());
        let (dx, dr) = (to_x - x, to_r - r);
        let (rho, drho) = (self.rho[0] + self.rho[1] * x, self.rho[1] * dx);
        let ([low, high], [dlow, dhigh]) = ([r - rho, r + rho], [dr - drho, dr + drho]);
        let square = [low * high, low * dhigh + dlow * high, dlow * dhigh];
        let of = |[a, b, c]: [f64; 3]| [a + b * x, b * dx, c];
        let ([a, b, c], [d, e, f]) = (of(self.over), of(self.under));
        let (constant, linear) = (c * d - a * f, c * e - b * f);
        let half = 0.5 * square[1];
        Slope {
            of_root: b * d - a * e,
            line: [
                constant * half - linear * square[0],
                constant * square[2] - linear * half,
            ],
            square,
        }
    }

    /// Returns the largest or smallest position between two indices, between which it has one extremum at most, and its index.
    fn extreme(&self, [a, b]: [f64; 2], largest: bool) -> (f64, f64) {
        let mut last = (b.ceil() as usize).saturating_sub(1);
        let mut segment = (a as usize).min(last);
        while segment < last {
            let middle = (segment + last).div_ceil(2);
            match self.slope(middle).rises() == largest {
                true => segment = middle,
                false => last = middle - 1,
            }
        }
        let from = segment as f64;
        let [s0, s1] = self.slope(segment).zeros();
        let best = |most: (f64, f64), index: f64| {
            let index = index.clamp(a, b);
            let value = self.position(index);
            match (value > most.1) == largest {
                true => (index, value),
                false => most,
            }
        };
        let start = (a, self.position(a));
        let within = [s0, s1].map(|s| from + s.clamp(0.0, 1.0));
        [b, from, from + 1.0, within[0], within[1]]
            .into_iter()
            .fold(start, best)
    }
}

impl Slope {
    /// Whether the position rises at the start of the segment.
    fn rises(&self) -> bool {
        self.of_root * self.square[0].max(0.0).sqrt() + self.line[0] > 0.0
    }

    /// Returns the fractions of the segment at which the slope may vanish; not finite if there are none.
    fn zeros(&self) -> [f64; 2] {
        let ([q0, q1, q2], [l0, l1], k2) = (self.square, self.line, self.of_root * self.of_root);
        let (a, b, c) = (
            k2 * q2 - l1 * l1,
            k2 * q1 - 2.0 * l0 * l1,
            k2 * q0 - l0 * l0,
        );
        let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
        let t = -0.5 * (b + root.copysign(b));
        [t / a, c / t]
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Lines, ParallelDetector, PointRaster, Pose};
    use nalgebra::Point3;

    /// The last ray that hits a body, by bisection, touches it at one of the positions.
    #[test]
    fn rays_that_touch_are_positions() {
        let turn = |k: usize| std::f64::consts::PI * k as f64 / 150.0;
        let points = (0..=150).map(|k| {
            [
                -4.0 * turn(k).cos(),
                2.5 * turn(k).sin() * (1.2 + 0.3 * turn(k).cos()),
            ]
        });
        let layer = Meridian::new(&points.collect::<Vec<_>>()).unwrap();
        let raster = |first: [f64; 3], bin: [f64; 3], row: [f64; 3]| PointRaster {
            first: Point3::from(first),
            bin_step: bin.into(),
            row_step: row.into(),
        };
        let source = raster([0.0, -30.0, 0.0], [0.0; 3], [0.0; 3]);
        let detector = raster([0.0, 20.0, 0.0], [1.0, 0.1, 0.0], [0.0, 0.0, 1.0]);
        let parallel = ParallelDetector::new(1, 1, [1.0; 2]).unwrap().rays(0.4);
        let planes = [parallel, Lines::between([1; 2], source, detector)]
            .map(|lines| RayPlane::new(&lines.unwrap(), [1.0; 2]).unwrap());
        let mut rows = 0;
        for tilt in 0..24 {
            let angle = 0.13 * f64::from(tilt);
            let pose = Pose::axis_along_z(angle).and_then(|pose| pose.rotated_x(0.3 + angle));
            let body = Body::new(vec![layer.clone()], pose.unwrap()).unwrap();
            let path = Path::of_layer(&body, &body.layers()[0], 0.1);
            let rows_of = |plane| (-9..=9).map(move |v| (plane, 0.47 * f64::from(v)));
            for (plane, v) in planes.iter().flat_map(rows_of) {
                let row = plane.row(v);
                let mut breaks = Vec::new();
                path.add_positions(&row, &mut breaks);
                let hits = |u: f64| body.chord(0, &row.ray(u)).unwrap() > 0.0;
                let Some(within) = (-400..400).map(|k| 0.02 * f64::from(k)).find(|u| hits(*u))
                else {
                    continue;
                };
                rows += 1;
                for out in [-15.0, 15.0] {
                    let (mut out, mut within) = (out, within);
                    for _ in 0..60 {
                        let middle = 0.5 * (out + within);
                        *(if hits(middle) { &mut within } else { &mut out }) = middle;
                    }
                    let off = breaks.iter().map(|u| (u - within).abs());
                    let nearest = off.fold(f64::MAX, f64::min);
                    // The bisection ends within rounding, of lines that touch.
                    assert!(nearest < 1e-9, "{tilt} {v}: {within} {nearest}");
                }
            }
        }
        assert!(rows > 400, "{rows}");
    }
}
