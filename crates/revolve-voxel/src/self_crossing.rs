//! Does a path in the half-plane cross itself?

use crate::Error;

/// Sweep along x over segments sorted by their left ends; neighbours may share their common point.
pub(crate) fn check(path: &[[f64; 2]]) -> Result<(), Error> {
    let n = path.len() - 1;
    let closed = path[0] == path[n];
    let left = |k: usize| path[k][0].min(path[k + 1][0]);
    let right = |k: usize| path[k][0].max(path[k + 1][0]);
    let mut order: Vec<usize> = (0..n)
        .filter(|&k| path[k][1] > 0.0 || path[k + 1][1] > 0.0)
        .collect();
    order.sort_by(|&a, &b| left(a).total_cmp(&left(b)));
    let mut active: Vec<usize> = Vec::new();
    for &k in &order {
        active.retain(|&j| right(j) >= left(k));
        for &j in &active {
            let (a, b) = (j.min(k), j.max(k));
            let adjacent = b == a + 1 || (closed && a == 0 && b == n - 1);
            let crosses = if adjacent {
                let (p, m, q) = if b == a + 1 {
                    (path[a], path[b], path[b + 1])
                } else {
                    (path[b], path[a], path[a + 1])
                };
                folds_back(p, m, q)
            } else {
                meet(path[a], path[a + 1], path[b], path[b + 1])
            };
            if crosses {
                return Err(Error::SelfCrossing {
                    first: a,
                    second: b,
                });
            }
        }
        active.push(k);
    }
    Ok(())
}

/// Twice the signed area of a triangle.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Two segments with a common point m run over each other.
fn folds_back(p: [f64; 2], m: [f64; 2], q: [f64; 2]) -> bool {
    let along = (p[0] - m[0]) * (q[0] - m[0]) + (p[1] - m[1]) * (q[1] - m[1]);
    area(p, m, q) == 0.0 && along > 0.0
}

/// Two segments have a point in common off the axis (solids may touch on the axis).
fn meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let overlap = |i: usize| a[i].min(b[i]) <= c[i].max(d[i]) && c[i].min(d[i]) <= a[i].max(b[i]);
    if !(overlap(0) && overlap(1)) {
        return false;
    }
    let (c1, d1) = (area(a, b, c), area(a, b, d));
    let (a1, b1) = (area(c, d, a), area(c, d, b));
    let opposite = |u: f64, v: f64| (u <= 0.0 && v >= 0.0) || (u >= 0.0 && v <= 0.0);
    if !(opposite(c1, d1) && opposite(a1, b1)) {
        return false;
    }
    // A common end point on the axis is allowed.
    let touch_on_axis = [a, b].iter().any(|p| p[1] == 0.0 && (*p == c || *p == d));
    !touch_on_axis
}
