//! Mean of a function over a square, by subdivision.

/// Largest number of subdivisions.
const DEEPEST: u32 = 9;

/// Values at the corners of a square, the middles of its edges and its centre, `[y][x]`.
type Values = [[f64; 3]; 3];

/// Returns the mean of a function over -1 to 1 in both variables, and the number of evaluations.
///
/// A square is divided into four until its mean by the trapezoidal rule with nine points differs from that with four, and from the
/// value at its centre, by less than the tolerance over its side relative to the whole: a line on which the function is not smooth
/// crosses as many squares as fit along it. The result is extrapolated from both rules.
pub(crate) fn mean(tolerance: f64, f: impl FnMut([f64; 2]) -> f64) -> (f64, u64) {
    let mut squares = Squares {
        f,
        tolerance,
        evaluations: 9,
    };
    let mut values = Values::default();
    for (y, row) in values.iter_mut().enumerate() {
        for (x, value) in row.iter_mut().enumerate() {
            *value = (squares.f)([x, y].map(|k| k as f64 - 1.0));
        }
    }
    // Always divided once.
    let sum = squares.quarters([-1.0; 2], 2.0, &values, 0);
    (sum, squares.evaluations)
}

struct Squares<F> {
    f: F,
    tolerance: f64,
    evaluations: u64,
}

impl<F: FnMut([f64; 2]) -> f64> Squares<F> {
    /// Mean over a square with a corner and a side.
    fn mean(&mut self, corner: [f64; 2], side: f64, values: &Values, depth: u32) -> f64 {
        let [[a, b, c], [d, e, f], [g, h, i]] = *values;
        let corners = 0.25 * (a + c + g + i);
        let all = 0.25 * (corners + 0.5 * (b + d + f + h) + e);
        let apart = (all - corners).abs().max((all - e).abs());
        if apart * 0.5 * side <= self.tolerance || depth == DEEPEST {
            return all + (all - corners) / 3.0;
        }
        self.quarters(corner, side, values, depth)
    }

    /// As [`mean`](Self::mean) for a divided square.
    fn quarters(&mut self, corner: [f64; 2], side: f64, values: &Values, depth: u32) -> f64 {
        let step = 0.25 * side;
        let mut fine = [[0.0; 5]; 5];
        for (y, row) in fine.iter_mut().enumerate() {
            for (x, value) in row.iter_mut().enumerate() {
                *value = if x % 2 == 0 && y % 2 == 0 {
                    values[y / 2][x / 2]
                } else {
                    self.evaluations += 1;
                    (self.f)([corner[0] + step * x as f64, corner[1] + step * y as f64])
                };
            }
        }
        let mut sum = 0.0;
        for [x, y] in [[0, 0], [2, 0], [0, 2], [2, 2]] {
            let own = [0, 1, 2].map(|j| [0, 1, 2].map(|i| fine[y + j][x + i]));
            let from = [corner[0] + step * x as f64, corner[1] + step * y as f64];
            sum += self.mean(from, 0.5 * side, &own, depth + 1);
        }
        0.25 * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinks_and_jumps_are_integrated_to_the_tolerance() {
        for k in 0..120 {
            // A line at some angle and distance.
            let (turn, off) = (0.37 * f64::from(k), 0.61 * f64::from(k % 41) / 20.0 - 0.61);
            let depth = |[x, y]: [f64; 2]| x * turn.cos() + y * turn.sin() - off;
            let n = 1000;
            let exact = |f: &dyn Fn([f64; 2]) -> f64| {
                let at = |k: usize| (2 * k + 1) as f64 / n as f64 - 1.0;
                let points = (0..n * n).map(|k| f([at(k % n), at(k / n)]));
                points.sum::<f64>() / (n * n) as f64
            };
            let jump = |p: [f64; 2]| f64::from(depth(p) > 0.0);
            let kink = |p: [f64; 2]| depth(p).max(0.0);
            let functions: [&dyn Fn([f64; 2]) -> f64; 2] = [&jump, &kink];
            for f in functions.into_iter().skip(k as usize % 2).take(1) {
                let (found, evaluations) = mean(1e-3, f);
                // The reference has an error below 1e-4.
                assert!((found - exact(f)).abs() < 1.1e-3, "{turn} {off} {found}");
                // A jump crosses at most 2^9 squares along a side, with a few evaluations each.
                assert!(evaluations < 20_000, "{evaluations}");
            }
        }
    }
}
