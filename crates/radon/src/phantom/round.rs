//! Closed forms of the intersection of the unit disc with a polygon, and of the unit ball with a parallelepiped.
//!
//! All three integrals use polar coordinates about the origin, one polygon edge at a time. An edge lies on a
//! line at distance g from the origin; φ is the angle from the foot of that line, t = g tan φ the position along the
//! edge, and ρ = g / cos φ the distance of the edge's points. Each integrand over φ changes its form where the edge
//! leaves a circle about the origin, and both pieces have an elementary antiderivative, so an edge costs two evaluations
//! of an odd function of t, and the sum over the edges is exact for any polygon, convex or not.

pub(super) type Vec2 = [f64; 2];
pub(super) type Vec3 = [f64; 3];

pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(super) fn add(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

pub(super) fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// Sum over the edges of `corners` of Ψ(end) - Ψ(start), where Ψ = `antiderivative(g, t)` is odd in t and the edge's sign
/// is that of its turn about the origin.
fn sum_edges(corners: &[Vec2], antiderivative: impl Fn(f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for (i, p) in corners.iter().enumerate() {
        let q = corners[(i + 1) % corners.len()];
        let d = [q[0] - p[0], q[1] - p[1]];
        let length = d[0].hypot(d[1]);
        let turn = (p[0] * q[1] - p[1] * q[0]) / length;
        // A radial edge sweeps no angle; a closed edge of no length is not an edge.
        if length == 0.0 || turn == 0.0 {
            continue;
        }
        let along = |v: &Vec2| (v[0] * d[0] + v[1] * d[1]) / length;
        let g = turn.abs();
        sum += turn.signum() * (antiderivative(g, along(&q)) - antiderivative(g, along(p)));
    }
    sum
}

/// Area of the unit disc about the origin inside the polygon `corners` (counter-clockwise positive).
pub(super) fn disc_in_polygon(corners: &[Vec2]) -> f64 {
    sum_edges(corners, |g, t| {
        // ρ² dφ / 2 inside the disc, dφ / 2 outside.
        let rim = (1.0 - g * g).max(0.0).sqrt();
        if t.abs() <= rim {
            0.5 * g * t
        } else {
            0.5 * (g * rim + (t.abs().atan2(g) - rim.atan2(g))) * t.signum()
        }
    })
}

/// Volume between the unit disc and the unit hemisphere above it, inside the vertical prism on the polygon `corners`.
pub(super) fn hemisphere_over_polygon(corners: &[Vec2]) -> f64 {
    // With t = g tan φ: ∫ (1 - (1 - ρ²)^(3/2)) / 3 dφ. Both arcs use the same root, the height of the hemisphere, whose rounding near the
    // rim then cancels.
    let inside = |g: f64, t: f64, root: f64| {
        let cubed = t.atan2(g * root) - 0.5 * g * ((3.0 - g * g) * t.atan2(root) + t * root);
        (t.atan2(g) - cubed) / 3.0
    };
    sum_edges(corners, |g, t| {
        let rim = (1.0 - g * g).max(0.0).sqrt();
        if t.abs() < rim {
            inside(g, t, (1.0 - g * g - t * t).max(0.0).sqrt())
        } else {
            let beyond = (t.abs().atan2(g) - rim.atan2(g)) / 3.0;
            (if rim > 0.0 { inside(g, rim, 0.0) } else { 0.0 } + beyond) * t.signum()
        }
    })
}

/// Volume of the unit ball inside the cone from the origin to the polygon `corners`, which lies in a plane at distance
/// `h` > 0 and is given in that plane relative to the foot of the origin.
fn ball_in_cone(h: f64, corners: &[Vec2]) -> f64 {
    let rim_rho_sq = (1.0 - h * h).max(0.0);
    // Where the face is inside the ball the cone is a pyramid: h ρ² dφ / 6. Beyond, the cone ends on the sphere.
    let swept = if h < 1.0 {
        h / 2.0 - h * h * h / 6.0
    } else {
        1.0 / 3.0
    };
    sum_edges(corners, |g, t| {
        let rim = (rim_rho_sq - g * g).max(0.0).sqrt();
        let beyond = |t: f64| {
            let slant = (h * h + g * g + t * t).sqrt();
            swept * t.atan2(g) - (h * t).atan2(g * slant) / 3.0
        };
        if t.abs() <= rim {
            h * g * t / 6.0
        } else {
            (h * g * rim / 6.0 + beyond(t.abs()) - if rim > 0.0 { beyond(rim) } else { 0.0 })
                * t.signum()
        }
    })
}

/// Volume of the unit ball about the origin inside the parallelepiped with centre `c` and half edges `e`.
pub(super) fn ball_in_parallelepiped(c: Vec3, e: [Vec3; 3]) -> f64 {
    let mut volume = 0.0;
    for k in 0..3 {
        let (u, v) = (e[(k + 1) % 3], e[(k + 2) % 3]);
        let mut normal = cross(u, v);
        let area = norm(normal);
        let sign = dot(normal, e[k]).signum();
        normal = normal.map(|x| x * sign / area);
        // In-plane frame, right-handed about the outward normal.
        let first = u.map(|x| x / norm(u));
        let second = cross(normal, first);
        for side in [1.0, -1.0] {
            let centre = add(c, side, e[k]);
            let h = side * dot(normal, centre);
            if h == 0.0 {
                continue;
            }
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| {
                let p = add(add(centre, a, u), b, v);
                [dot(p, first), dot(p, second)]
            });
            volume += h.signum() * ball_in_cone(h.abs(), &corners).abs();
        }
    }
    volume
}
