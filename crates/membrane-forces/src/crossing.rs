//! Detection of self-crossings of a polyline by a sweep along its longer side.

use crate::error::{MembraneError, Result};

/// `Err(SelfCrossing)` if two segments that are not neighbours intersect, or a segment folds back onto its neighbour.
///
/// Cost O(n log n) plus the pairs whose ranges overlap along the side, x or y, on which the points extend more.
pub(crate) fn check(points: &[[f64; 2]]) -> Result<()> {
    let n = points.len() - 1;
    let extent = |k: usize| {
        let along = || points.iter().map(|p| p[k]);
        along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
    };
    let side = if extent(0) >= extent(1) { 0 } else { 1 };
    let range = |k: usize| {
        let (a, b) = (points[k][side], points[k + 1][side]);
        (a.min(b), a.max(b))
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| range(a).0.total_cmp(&range(b).0));
    let mut open: Vec<usize> = Vec::new();
    for &k in &order {
        let left = range(k).0;
        open.retain(|&other| range(other).1 >= left);
        for &other in &open {
            let (first, second) = (k.min(other), k.max(other));
            if meet(points, first, second) {
                return Err(MembraneError::SelfCrossing { first, second });
            }
        }
        open.push(k);
    }
    Ok(())
}

fn meet(points: &[[f64; 2]], first: usize, second: usize) -> bool {
    let (a, b) = (points[first], points[first + 1]);
    let (c, d) = (points[second], points[second + 1]);
    let turn = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    if second == first + 1 {
        let back = (b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) < 0.0;
        return back && turn(a, b, d) == 0.0;
    }
    let within = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        r[0] >= p[0].min(q[0])
            && r[0] <= p[0].max(q[0])
            && r[1] >= p[1].min(q[1])
            && r[1] <= p[1].max(q[1])
    };
    let (t1, t2) = (turn(a, b, c), turn(a, b, d));
    let (t3, t4) = (turn(c, d, a), turn(c, d, b));
    if t1 * t2 < 0.0 && t3 * t4 < 0.0 {
        return true;
    }
    (t1 == 0.0 && within(a, b, c))
        || (t2 == 0.0 && within(a, b, d))
        || (t3 == 0.0 && within(c, d, a))
        || (t4 == 0.0 && within(c, d, b))
}
