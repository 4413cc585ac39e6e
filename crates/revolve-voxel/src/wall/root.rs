//! Root of an increasing function, and extremum of a function with one.

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

/// The inverse of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Returns position and value of the largest or smallest value of a function with one extremum between two positions, by golden-section
/// search.
pub(crate) fn golden(
    value: impl Fn(f64) -> f64,
    [mut low, mut high]: [f64; 2],
    largest: bool,
    steps: usize,
) -> (f64, f64) {
    let sign = if largest { 1.0 } else { -1.0 };
    let of = |at: f64| sign * value(at);
    let inner = |low: f64, high: f64| low + (1.0 - GOLDEN) * (high - low);
    let [mut a, mut b] = [inner(low, high), inner(high, low)];
    let [mut at_a, mut at_b] = [of(a), of(b)];
    let mut best = (low, of(low));
    let mut keep = |at: f64, value: f64| {
        if value > best.1 {
            best = (at, value);
        }
    };
    keep(high, of(high));
    for _ in 0..steps {
        keep(a, at_a);
        keep(b, at_b);
        if at_a < at_b {
            (low, a, at_a) = (a, b, at_b);
            b = inner(high, low);
            at_b = of(b);
        } else {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high);
            at_a = of(a);
        }
    }
    (best.0, sign * best.1)
}
