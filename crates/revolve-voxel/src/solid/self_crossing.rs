//! Detection of self-intersections of a meridian.

use crate::RevolveError;
use crate::solid::box_tree::BoxTree;
use crate::solid::segment::Segment;

/// Segments that run along each other at this distance, relative to the largest coordinate, coincide: the sign of the distance to
/// them is undefined.
const APART: f64 = 16.0 * f64::EPSILON;

/// Tests each segment against those with intersecting boxes; neighbours may share their common point.
pub(crate) fn check(segments: &[Segment], boxes: &BoxTree) -> Result<(), RevolveError> {
    let n = segments.len();
    let coordinates = segments.iter().flat_map(|s| [s.start(), s.end()]).flatten();
    let near = APART * coordinates.fold(0.0, |most: f64, v| most.max(v.abs()));
    for (k, s) in segments.iter().enumerate() {
        let mut crossed = None;
        let [x0, x1, r0, r1] = s.bounds();
        boxes.overlapping([x0 - near, x1 + near, r0 - near, r1 + near], n, |j| {
            if j <= k || crossed.is_some() {
                return;
            }
            let o = &segments[j];
            let crosses = if j == k + 1 && s.end() == o.start() {
                folds_back(s.start(), s.end(), o.end())
            } else if k == 0 && j == n - 1 && o.end() == s.start() {
                folds_back(o.start(), o.end(), s.end())
            } else {
                meet(s.start(), s.end(), o.start(), o.end()) || alongside(s, o, near)
            };
            if crosses {
                crossed = Some(j);
            }
        });
        if let Some(second) = crossed {
            return Err(RevolveError::SelfCrossing { first: k, second });
        }
    }
    check_axis(segments)
}

/// Along the axis solid and void must alternate where the meridian leaves it (solid begins) and returns (solid ends); otherwise two
/// parts of the solid overlap, although their outlines may not meet off the axis.
fn check_axis(segments: &[Segment]) -> Result<(), RevolveError> {
    // Position, angle from the axis, whether solid begins.
    let mut feet = Vec::new();
    for (k, s) in segments.iter().enumerate() {
        for (foot, other, begins) in [(s.start(), s.end(), true), (s.end(), s.start(), false)] {
            if foot[1] == 0.0 {
                let angle = other[1].atan2(other[0] - foot[0]);
                feet.push((foot[0], -angle, begins, k));
            }
        }
    }
    feet.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for (i, &(_, _, begins, second)) in feet.iter().enumerate() {
        if begins != (i % 2 == 0) {
            let first = feet[i.saturating_sub(1)].3;
            return Err(RevolveError::SelfCrossing { first, second });
        }
    }
    Ok(())
}

/// Twice the signed area of a triangle.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Two segments with a common point m overlap, or form an angle below rounding.
fn folds_back(p: [f64; 2], m: [f64; 2], q: [f64; 2]) -> bool {
    let along = (p[0] - m[0]) * (q[0] - m[0]) + (p[1] - m[1]) * (q[1] - m[1]);
    along > 0.0 && area(p, m, q).abs() <= 4.0 * f64::EPSILON * along
}

/// A segment runs along another at a distance of at most `near`, over more than a corner.
fn alongside(s: &Segment, o: &Segment, near: f64) -> bool {
    let place = |[x, r]: [f64; 2]| {
        let (dx, dr) = (x - s.x0, r - s.r0);
        [dx * s.tx + dr * s.tr, dr * s.tx - dx * s.tr]
    };
    let [[u0, h0], [u1, h1]] = [place(o.start()), place(o.end())];
    let (low, high) = (u0.min(u1).max(0.0), u0.max(u1).min(s.length));
    let off = |u: f64| (h0 + (h1 - h0) * (u - u0) / (u1 - u0)).abs();
    high - low > 16.0 * near && off(low) <= near && off(high) <= near
}

/// Two segments have a common point other than a common end on the axis, where solids may touch.
fn meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let apart = |i: usize| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]);
    if apart(0) || apart(1) {
        return false;
    }
    let (c1, d1) = (area(a, b, c), area(a, b, d));
    let (a1, b1) = (area(c, d, a), area(c, d, b));
    let opposite = |u: f64, v: f64| (u <= 0.0 && v >= 0.0) || (u >= 0.0 && v <= 0.0);
    let touch_on_axis = [a, b].iter().any(|p| p[1] == 0.0 && (*p == c || *p == d));
    opposite(c1, d1) && opposite(a1, b1) && !touch_on_axis
}
