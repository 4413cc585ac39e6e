//! Simple polygons: chords, strip areas and rectangle areas, all as sums over the edges.

use super::round::Vec2;

/// Pairs of consecutive corners, the last joined to the first.
fn edges(corners: &[Vec2]) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
    corners
        .iter()
        .zip(corners.iter().cycle().skip(1))
        .map(|(&p, &q)| (p, q))
}

/// Signed area, positive when counter-clockwise.
pub(super) fn area(corners: &[Vec2]) -> f64 {
    // Relative to the first corner, to avoid cancellation far from the origin.
    let o = corners[0];
    edges(corners)
        .map(|(p, q)| 0.5 * ((p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])))
        .sum()
}

/// Returns the corners in the frame of a camera at `theta`: (position along the detector, position along the ray).
pub(super) fn turned(corners: &[Vec2], theta: f64) -> Vec<Vec2> {
    let (sin, cos) = theta.sin_cos();
    corners
        .iter()
        .map(|p| [p[0] * cos + p[1] * sin, p[1] * cos - p[0] * sin])
        .collect()
}

/// Length of the line x = `at` inside a counter-clockwise polygon; along an edge, the mean of the limits from both sides.
pub(super) fn chord(corners: &[Vec2], at: f64) -> f64 {
    let mut sum = 0.0;
    for (p, q) in edges(corners) {
        if p[0] == q[0] {
            continue;
        }
        let (low, high) = (p[0].min(q[0]), p[0].max(q[0]));
        let shares = f64::from(u8::from(low <= at && at < high))
            + f64::from(u8::from(low < at && at <= high));
        if shares > 0.0 {
            let y = p[1] + (q[1] - p[1]) * ((at - p[0]) / (q[0] - p[0]));
            // Counter-clockwise: the upper boundary runs towards smaller x.
            sum += 0.5 * shares * y * (p[0] - q[0]).signum();
        }
    }
    sum
}

/// Area of a counter-clockwise polygon inside the rectangle [x0, x1] x [y0, y1]; y0 and y1 may be infinite together.
///
/// NaN bounds are ignored (`clamp` would panic). Each edge contributes the area between itself and the floor of the rectangle, clipped to it:
/// piecewise linear in x.
pub(super) fn area_in(corners: &[Vec2], [x0, x1]: Vec2, [y0, y1]: Vec2) -> f64 {
    let floor = if y0.is_finite() { y0 } else { corners[0][1] };
    let mut sum = 0.0;
    for (p, q) in edges(corners) {
        let sign = (p[0] - q[0]).signum();
        let (left, right) = if p[0] < q[0] { (p, q) } else { (q, p) };
        let (a, b) = (left[0].max(x0), right[0].min(x1));
        if a >= b {
            continue;
        }
        let slope = (right[1] - left[1]) / (right[0] - left[0]);
        let height = |x: f64| left[1] + slope * (x - left[0]);
        // Break where the edge crosses the floor and the ceiling.
        let mut breaks = [a, b, b, b];
        if slope != 0.0 {
            let mut cuts = [y0, y1].map(|y| (left[0] + (y - left[1]) / slope).max(a).min(b));
            cuts.sort_by(f64::total_cmp);
            breaks = [a, cuts[0], cuts[1], b];
        }
        for w in breaks.windows(2) {
            let middle = height(0.5 * (w[0] + w[1])).max(y0).min(y1);
            sum += sign * (w[1] - w[0]) * (middle - floor);
        }
    }
    sum
}

/// Whether two edges that are not neighbours touch: the polygon is then not simple.
pub(super) fn crosses_itself(corners: &[Vec2]) -> bool {
    let n = corners.len();
    let side =
        |a: Vec2, b: Vec2, c: Vec2| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    for i in 0..n {
        for j in i + 2..n {
            if i == 0 && j == n - 1 {
                continue;
            }
            let (a, b, c, d) = (corners[i], corners[i + 1], corners[j], corners[(j + 1) % n]);
            let straddles = |p, q, r, s| side(p, q, r) * side(p, q, s) <= 0.0;
            let overlaps = (0..2)
                .all(|k| a[k].min(b[k]) <= c[k].max(d[k]) && c[k].min(d[k]) <= a[k].max(b[k]));
            if overlaps && straddles(a, b, c, d) && straddles(c, d, a, b) {
                return true;
            }
        }
    }
    false
}
