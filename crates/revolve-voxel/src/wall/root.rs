//! Root of an increasing function.

/// Newton steps below this fraction of the initial bracket converge quadratically.
const LAST_STEP: f64 = 1e-8;

/// Returns the root of an increasing function (with its slope): Newton's method from `start`, kept in its bracket by bisection.
pub(crate) fn rising_root(f: impl Fn(f64) -> (f64, f64), bracket: [f64; 2], start: f64) -> f64 {
    let [mut low, mut high] = bracket;
    let least = f64::EPSILON * (high - low);
    let mut x = if start > low && start < high {
        start
    } else {
        0.5 * (low + high)
    };
    let mut last = f64::INFINITY;
    for _ in 0..128 {
        let (value, slope) = f(x);
        if value == 0.0 {
            return x;
        }
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let step = value / slope;
        let newton = x - step;
        let inside = newton >= low && newton <= high;
        let from_ends = (newton - bracket[0]).min(bracket[1] - newton);
        if inside && step.abs() <= (LAST_STEP * from_ends).max(least) {
            return newton;
        }
        // Bisects unless Newton's step stays inside and gains at least a factor of two.
        let next = if inside && step.abs() <= 0.5 * last {
            last = step.abs();
            newton
        } else {
            last = high - low;
            0.5 * (low + high)
        };
        if next == x || high - low <= 2.0 * f64::EPSILON * low.abs().max(high.abs()) {
            return next;
        }
        x = next;
    }
    x
}
