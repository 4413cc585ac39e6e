//! The total turning angle of a curve.

use std::f64::consts::{FRAC_PI_2, TAU};

/// The origin of a result, which limits the turning angle of its curve.
#[derive(Clone, Copy)]
pub(crate) enum Reach {
    /// A direct solve: within a quarter turn of the start, or angle and change at most a full circle.
    Direct,
    /// A step of the walk: at most a quarter turn more.
    Step,
}

impl Reach {
    /// Whether a curve that turned through `start` may turn through `end`.
    pub(crate) fn allows(self, [start, end]: [f64; 2]) -> bool {
        let by = (end - start).abs();
        match self {
            Self::Direct => by <= FRAC_PI_2 || by.max(end.abs()) <= TAU,
            Self::Step => by <= FRAC_PI_2,
        }
    }
}

/// Angle through which the segments of the polyline `nodes` (flat) turn in all, loops counted;
/// positive counter-clockwise. Cost O(n), two arc tangents.
pub(crate) fn turning(nodes: &[f64]) -> f64 {
    swept(segments(nodes))
}

/// Returns the difference of the turning angles of `to` and `from`, which have equally many nodes: between them a corner may pass the half
/// turn, at which its own angle jumps from pi to -pi.
pub(crate) fn turned(from: &[f64], to: &[f64]) -> f64 {
    let pairs = segments(from).zip(segments(to));
    swept(pairs.map(|(a, b)| [a[0] * b[0] + a[1] * b[1], a[0] * b[1] - a[1] * b[0]]))
}

fn segments(nodes: &[f64]) -> impl Iterator<Item = [f64; 2]> {
    let pairs = nodes.as_chunks::<2>().0.windows(2);
    pairs.map(|p| [p[1][0] - p[0][0], p[1][1] - p[0][1]])
}

/// Returns the total turning angle of `directions`, each less than half a turn from the previous one.
fn swept(mut directions: impl Iterator<Item = [f64; 2]>) -> f64 {
    let Some(first) = directions.next() else {
        return 0.0;
    };
    // Quarters are counted exactly and select the loop of the last angle.
    let (mut last, mut quarters) = (first, 0);
    for d in directions {
        quarters += match (quarter(d) - quarter(last)).rem_euclid(4) {
            0 => 0,
            1 => 1,
            3 => -1,
            _ if last[0] * d[1] < last[1] * d[0] => -2,
            _ => 2,
        };
        last = d;
    }
    let angle = last[1].atan2(last[0]) - first[1].atan2(first[0]);
    angle + TAU * ((f64::from(quarters) * FRAC_PI_2 - angle) / TAU).round()
}

/// Quarter of the plane that `d` points to: 0 ..= 3, counter-clockwise.
fn quarter(d: [f64; 2]) -> i32 {
    match (d[0] >= 0.0, d[1] >= 0.0) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arcs of known angle, in any direction, also with more than one loop.
    #[test]
    fn loops_are_counted() {
        for k in -60..=60 {
            let (wanted, count) = (0.31 * f64::from(k), 50);
            for start in 0..40 {
                let step = wanted / f64::from(count - 1);
                let mut nodes = vec![0.3, -0.2];
                for n in 0..count {
                    let angle = 0.17 * f64::from(start) + f64::from(n) * step;
                    let [x, y] = [nodes[nodes.len() - 2], nodes[nodes.len() - 1]];
                    nodes.extend([x + angle.cos(), y + angle.sin()]);
                }
                let found = turning(&nodes);
                assert!((found - wanted).abs() < 1e-12, "{found} for {wanted}");
                let line: Vec<f64> = (0..=count).flat_map(|n| [f64::from(n), 0.7]).collect();
                assert!((turned(&line, &nodes) - wanted).abs() < 1e-12);
                assert!((turned(&nodes, &line) + wanted).abs() < 1e-12);
            }
        }
    }

    /// A hairpin in any direction whose corner opens from 3 to 3.3 rad turns by 0.3 more, not by 0.3 - 2 pi.
    #[test]
    fn a_corner_may_pass_the_half_turn() {
        for first in (0..16).map(|k| 0.4 * f64::from(k)) {
            let hairpin = |angle: f64| {
                let [a, b] = [first, first + angle].map(f64::sin_cos);
                [0.0, 0.0, a.1, a.0, a.1 + b.1, a.0 + b.0]
            };
            let (before, after) = (hairpin(3.0), hairpin(3.3));
            assert!((turned(&before, &after) - 0.3).abs() < 1e-12);
            assert!((turning(&after) - turning(&before) - (0.3 - TAU)).abs() < 1e-12);
        }
    }
}
