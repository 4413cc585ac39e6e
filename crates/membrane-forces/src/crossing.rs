//! Curves that enclose no body: self-crossings, found by a sweep along an axis, and curves that are inside out.

use crate::error::{MembraneError, Result};
use crate::measures::Measure;

/// Negative volume over the cube of the length that is rounding, of flat curves.
const FLAT: f64 = 1e-9;

/// `Err(SelfCrossing)` if two segments that are not neighbours intersect, or a segment folds back onto its neighbour; `Err(InsideOut)` if the volume
/// is negative.
pub(crate) fn check(points: &[[f64; 2]]) -> Result<()> {
    if let Some([first, second]) = crossing(points, &mut Vec::new()) {
        return Err(MembraneError::SelfCrossing { first, second });
    }
    inside_out(points).map_or(Ok(()), |volume| Err(MembraneError::InsideOut { volume }))
}

/// Returns a node near which a curve that has moved from its `start` encloses no body: it crosses the axis more often or crosses itself, so that
/// walls intersect, or it is inside out (its volume is negative). A start whose nodes come nearer to the axis all the way from the end to the apex,
/// such as a disc or a shallow cap, can be pushed through: it may be inside out. A curve that crosses the axis as often as its start, but elsewhere,
/// is accepted, although it bounds no body of revolution.
///
/// Crossings are those of the segments between the points. `order` is a work array, which allocates for more points than before. Cost O(n log n) plus
/// the pairs whose ranges overlap along x or y, whichever the curve turns back along less often.
pub fn collapse(start: &[[f64; 2]], points: &[[f64; 2]], order: &mut Vec<usize>) -> Option<usize> {
    if axis_crossings(points).count() > axis_crossings(start).count() {
        return axis_crossings(points).next();
    }
    if let Some([first, _]) = crossing(points, order)
        && crossing(start, order).is_none()
    {
        return Some(first + 1);
    }
    let mut upper = start.windows(2).take_while(|pair| pair[1][1] >= 0.0);
    let passable = upper.all(|pair| pair[1][1] < pair[0][1]);
    (!passable && inside_out(points).is_some()).then_some(points.len() / 2)
}

/// Returns the volume if it is negative.
fn inside_out(points: &[[f64; 2]]) -> Option<f64> {
    let [volume, length] = [Measure::Volume, Measure::Length].map(|m| m.of(points));
    (volume < -FLAT * length.powi(3)).then_some(volume)
}

/// Lists the nodes before which a curve crosses the axis.
fn axis_crossings(points: &[[f64; 2]]) -> impl Iterator<Item = usize> {
    let mut side = 0.0;
    points.iter().enumerate().filter_map(move |(n, point)| {
        let before = side;
        if point[1] != 0.0 {
            side = point[1].signum();
        }
        (before * side < 0.0).then_some(n)
    })
}

/// Returns two segments that intersect.
fn crossing(points: &[[f64; 2]], order: &mut Vec<usize>) -> Option<[usize; 2]> {
    // The number of times that the curve turns back along x or y.
    let reversals = |k: usize| {
        let turns = points.windows(3);
        turns
            .filter(|at| (at[1][k] - at[0][k]) * (at[2][k] - at[1][k]) <= 0.0)
            .count()
    };
    let turns = [reversals(0), reversals(1)];
    if turns.contains(&0) {
        return None;
    }
    let side = usize::from(turns[1] < turns[0]);
    let range = |k: usize| {
        let (a, b) = (points[k][side], points[k + 1][side]);
        (a.min(b), a.max(b))
    };
    order.clear();
    order.extend(0..points.len().saturating_sub(1));
    order.sort_unstable_by(|&a, &b| range(a).0.total_cmp(&range(b).0));
    let pairs = order.iter().enumerate().flat_map(|(n, &k)| {
        let later = order[n + 1..].iter();
        let open = later.take_while(move |&&other| range(other).0 <= range(k).1);
        open.map(move |&other| [k.min(other), k.max(other)])
    });
    let mut crossing = pairs.filter(|&[first, second]| meet(points, first, second));
    crossing.next()
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
