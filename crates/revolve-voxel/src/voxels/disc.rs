//! A disc about the axis, and lines and polygons in its plane.

/// Returns the fractions of the path from p to q inside the disc.
#[inline(always)]
pub(crate) fn within(p: [f64; 2], q: [f64; 2], r2: f64) -> Option<[f64; 2]> {
    let c = p[0] * p[0] + p[1] * p[1] - r2;
    let end = q[0] * q[0] + q[1] * q[1] - r2;
    if c <= 0.0 && end <= 0.0 {
        return Some([0.0, 1.0]);
    }
    let d = [q[0] - p[0], q[1] - p[1]];
    let a = d[0] * d[0] + d[1] * d[1];
    let b = p[0] * d[0] + p[1] * d[1];
    if c > 0.0 && end > 0.0 && (b >= 0.0 || b + a <= 0.0) {
        return None;
    }
    let disc = b * b - a * c;
    if disc <= 0.0 {
        return None;
    }
    let root = disc.sqrt();
    let (low, high) = ((-b - root) / a, (-b + root) / a);
    (low < 1.0 && high > 0.0).then_some([low.max(0.0), high.min(1.0)])
}

pub(crate) fn between(p: [f64; 2], q: [f64; 2], t: f64) -> [f64; 2] {
    [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]
}

/// Returns twice the signed area of the triangle from the axis to p and q inside the disc.
pub(crate) fn sector_sum(p: [f64; 2], q: [f64; 2], r2: f64) -> f64 {
    let Some([low, high]) = within(p, q, r2) else {
        return r2 * angle(p, q);
    };
    let (first, last) = (between(p, q, low), between(p, q, high));
    r2 * (angle(p, first) + angle(last, q)) + cross(first, last)
}

pub(crate) fn cross(p: [f64; 2], q: [f64; 2]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

/// Returns the angle from p to q, between -pi and pi.
pub(crate) fn angle(p: [f64; 2], q: [f64; 2]) -> f64 {
    let (y, x) = (cross(p, q), p[0] * q[0] + p[1] * q[1]);
    if x > 0.0 && y.abs() < 0.05 * x {
        // Series of the arc tangent: the first omitted term is below 1e-15 of the sum.
        let t = y / x;
        let s = t * t;
        t * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s * (1.0 / 9.0 - s / 11.0)))))
    } else {
        y.atan2(x)
    }
}
