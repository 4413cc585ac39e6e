//! The distribution of the volume of a wall along its parameter.
//!
//! The volume before s is a polynomial between knots, stored as Chebyshev series. At an end on the axis the volume per unit of s
//! vanishes: at the distance t from it (1 at the next knot) the volume beyond is `V = t^2 q(t)`, and t computed from V by a
//! difference of volumes would have half its digits. With the polynomial q itself, t has all digits.

use std::f64::consts::PI;

use crate::solid::series::chebyshev;
use crate::wall::root::rising_root;

/// The volume along a wall.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shares {
    knots: Vec<f64>,
    /// Volume from the start of the range to each knot.
    below: Vec<f64>,
    /// Volume beyond a knot, a Chebyshev series on the interval to the next.
    series: Vec<Vec<f64>>,
    /// The first and the last end, where they are on the axis.
    poles: [Option<Pole>; 2],
}

/// An end of the range on the axis.
#[derive(Debug, Clone, PartialEq)]
struct Pole {
    end: f64,
    /// From the end to the next knot.
    reach: f64,
    /// q as a Chebyshev series.
    factor: Vec<f64>,
}

impl Shares {
    /// Computes it from the volume per unit of s, a polynomial of fewer than `n` coefficients between knots; `on_axis` marks ends
    /// on the axis, where it vanishes.
    pub(crate) fn new(
        knots: &[f64],
        n: usize,
        on_axis: [bool; 2],
        rate: impl Fn(f64) -> f64,
    ) -> Self {
        let mut knots = knots.to_vec();
        if knots.len() == 2 && on_axis == [true; 2] {
            // Each end has its own interval.
            knots.insert(1, 0.5 * (knots[0] + knots[1]));
        }
        let last = knots.len() - 1;
        let (mut below, mut series) = (vec![0.0], Vec::new());
        for pair in knots.windows(2) {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            let own = shortened(interpolated(n, |u| half * rate(middle + half * u)));
            let own = integral(&own);
            below.push(below[below.len() - 1] + value(&own, 1.0));
            series.push(own);
        }
        let pole = |end: usize, next: usize| Pole::new(n, knots[end], knots[next], &rate);
        let poles = [
            on_axis[0].then(|| pole(0, 1)),
            on_axis[1].then(|| pole(last, last - 1)),
        ];
        Self {
            knots,
            below,
            series,
            poles,
        }
    }

    /// Returns the total, cm^3.
    pub(crate) fn volume(&self) -> f64 {
        self.below[self.below.len() - 1]
    }

    /// Returns the fractions of the volume before and after s, each with full relative accuracy at an end on the axis.
    pub(crate) fn split(&self, s: f64) -> [f64; 2] {
        let last = self.knots.len() - 1;
        if s <= self.knots[0] {
            return [0.0, 1.0];
        } else if s >= self.knots[last] {
            return [1.0, 0.0];
        }
        let k = self.knots[1..last].partition_point(|&knot| knot < s);
        let whole = self.volume();
        match &self.poles {
            [_, Some(pole)] if k == last - 1 => {
                let after = (pole.volume(s) / whole).clamp(0.0, 1.0);
                [1.0 - after, after]
            }
            [Some(pole), _] if k == 0 => {
                let before = (pole.volume(s) / whole).clamp(0.0, 1.0);
                [before, 1.0 - before]
            }
            _ => {
                let (from, to) = (self.knots[k], self.knots[k + 1]);
                let u = (s - from + (s - to)) / (to - from);
                let before = self.below[k] + value(&self.series[k], u);
                let before = (before / whole).clamp(0.0, 1.0);
                [before, 1.0 - before]
            }
        }
    }

    /// Returns the s with these fractions (with sum 1) before and after it.
    pub(crate) fn place(&self, [before, after]: [f64; 2]) -> f64 {
        let last = self.knots.len() - 1;
        if before <= 0.0 {
            return self.knots[0];
        } else if after <= 0.0 {
            return self.knots[last];
        }
        let volume = before * self.volume();
        let k = self.below[1..last].partition_point(|&v| v < volume);
        match &self.poles {
            [_, Some(pole)] if k == last - 1 => pole.place(after * self.volume()),
            [Some(pole), _] if k == 0 => pole.place(volume),
            _ => {
                let (from, to) = (self.knots[k], self.knots[k + 1]);
                let target = volume - self.below[k];
                let f = |u: f64| {
                    let [[value], [slope], _] = chebyshev([&self.series[k]], u);
                    (value - target, slope)
                };
                let start = 2.0 * target / (self.below[k + 1] - self.below[k]) - 1.0;
                from + 0.5 * (to - from) * (1.0 + rising_root(f, [-1.0, 1.0], start))
            }
        }
    }
}

impl Pole {
    fn new(n: usize, end: f64, next: f64, rate: impl Fn(f64) -> f64) -> Self {
        let reach = next - end;
        // w(t) = V'(t) / t = 2 q + t q'.
        let w = interpolated(n, |u| {
            let t = 0.5 * (1.0 + u);
            rate(end + t * reach) * reach.abs() / t
        });
        // With u = 2 t - 1 and d the coefficients of dq/du, those of t q' = (1 + u) dq/du are d_k + d_(k+1) + k q_k.
        let mut q = vec![0.0; n];
        let mut d = vec![0.0; n + 2];
        for k in (1..n).rev() {
            q[k] = (w[k] - d[k] - d[k + 1]) / (k + 2) as f64;
            d[k - 1] = d[k + 1] + 2.0 * k as f64 * q[k];
        }
        // Half of the constants: a Chebyshev series counts its first term twice in these sums.
        q[0] = 0.5 * (w[0] - 0.5 * (d[0] + d[1]));
        Self {
            end,
            reach,
            factor: shortened(q),
        }
    }

    /// Volume between the end and s.
    fn volume(&self, s: f64) -> f64 {
        let t = (s - self.end) / self.reach;
        t * t * value(&self.factor, t + (t - 1.0))
    }

    /// Returns the s with the given volume between it and the end.
    fn place(&self, volume: f64) -> f64 {
        let root = volume.sqrt();
        let f = |t: f64| {
            let [[q], [slope], _] = chebyshev([&self.factor], t + (t - 1.0));
            let side = q.sqrt();
            (t * side - root, side + t * slope / side)
        };
        let start = root / value(&self.factor, -1.0).sqrt();
        self.end + self.reach * rising_root(f, [0.0, 1.0], start)
    }
}

fn value(series: &[f64], u: f64) -> f64 {
    chebyshev([series], u)[0][0]
}

/// Removes trailing terms below the rounding of the largest term.
fn shortened(mut series: Vec<f64>) -> Vec<f64> {
    let largest = series.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    let mut dropped = 0.0;
    while let Some(c) = series.last() {
        dropped += c.abs();
        if series.len() == 1 || dropped > 0.1 * f64::EPSILON * largest {
            break;
        }
        series.pop();
    }
    series
}

/// The Chebyshev series of `n` coefficients of a function on [-1, 1], from its values at their nodes.
fn interpolated(n: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let angle = |j: usize| PI * (j as f64 + 0.5) / n as f64;
    let values: Vec<f64> = (0..n).map(|j| f(angle(j).cos())).collect();
    let coefficient = |k: usize| {
        let terms = (0..n).map(|j| values[j] * (k as f64 * angle(j)).cos());
        terms.sum::<f64>() * if k == 0 { 1.0 } else { 2.0 } / n as f64
    };
    (0..n).map(coefficient).collect()
}

/// The integral from -1 of a Chebyshev series.
fn integral(series: &[f64]) -> Vec<f64> {
    // The integral of T_k is T_(k+1) / (2 (k + 1)) - T_(k-1) / (2 (k - 1)); that of T_0 is T_1.
    let c = |k: usize| series.get(k).copied().unwrap_or(0.0);
    let mut out = vec![0.0; series.len() + 1];
    for k in 1..out.len() {
        let lower = if k == 1 { 2.0 * c(0) } else { c(k - 1) };
        out[k] = (lower - c(k + 1)) / (2 * k) as f64;
    }
    out[0] = -value(&out, -1.0);
    out
}
