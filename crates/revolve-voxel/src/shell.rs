//! The wall between two profiles with a common parameter, filled with layers that hold equal shares of it.
//!
//! Points of equal parameter s on the inner curve A and the outer curve B are joined by straight lines,
//! `P(s, t) = (1 - t) A(s) + t B(s)`. The volume element about the axis is
//!
//! ```text
//! dV = 2 pi r J ds dt,    r = (1 - t) r_A + t r_B,    J = P_s x P_t = (1 - t) A' x D + t B' x D,    D = B - A
//! ```
//!
//! with both factors linear in t. So the share of a strip ds below t is a cubic in t, and the layer u is where that share
//! is u: between the layers u0 and u1 lies the fraction u1 - u0 of every strip, and so of the wall, whatever the curves.

use std::f64::consts::PI;

use crate::curve::{Curve, CurvePoint, chebyshev};
use crate::error::{finite, positive};
use crate::{Error, Meridian};

/// Fewest places at which the lines between the curves are looked at when a point is searched for.
const LINES: usize = 128;

/// What is on an end of the profile as near the axis as this, as a share of the size, is on it.
const ON_AXIS: f64 = 1e-12;

/// Derivatives at an end on the axis are taken this share of the parameter's range before it, where they differ from their
/// limit by its square.
const OFF_AXIS: f64 = 1e-6;

/// The wall between two profiles in the half-plane (x, r), with material coordinates: the layer u, 0 on the inner and 1 on
/// the outer profile, and the profiles' parameter s.
///
/// ```
/// use revolve_voxel::{Curve, Shell};
/// // Concentric half-circles of radius 1 and 2 as polylines of many points: half the wall of a ball.
/// let s: Vec<f64> = (0..=200).map(|k| k as f64 / 200.0).collect();
/// let arc = |radius: f64| -> Vec<[f64; 2]> {
///     let angle = |s: &f64| std::f64::consts::FRAC_PI_2 * s;
///     s.iter().map(|s| [radius * angle(s).sin(), radius * angle(s).cos()]).collect()
/// };
/// let shell = Shell::new(Curve::polyline(&s, &arc(1.0))?, Curve::polyline(&s, &arc(2.0))?, [0.0, 1.0])?;
/// let [x, r] = shell.point(0.5, 0.4);
/// // Half of the volume lies within the radius ((1 + 8) / 2)^(1/3).
/// assert!((x.hypot(r) - 4.5_f64.cbrt()).abs() < 1e-4);
/// let [layer, s] = shell.locate([x, r]).unwrap();
/// assert!((layer - 0.5).abs() < 1e-12 && (s - 0.4).abs() < 1e-12);
/// # Ok::<(), revolve_voxel::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    inner: Curve,
    outer: Curve,
    range: [f64; 2],
    /// Where either curve has a knot, and the ends of the range.
    knots: Vec<f64>,
    /// Volume from the start of the range to each knot.
    below: Vec<f64>,
    /// Volume beyond a knot, a Chebyshev series on the interval to the next.
    series: Vec<Vec<f64>>,
    /// Parameter, inner point and line to the outer point at many places.
    lines: Vec<(f64, [f64; 2], [f64; 2])>,
    /// Smallest box (x, r) that holds the lines, with a margin.
    bounds: [[f64; 2]; 2],
    size: f64,
}

/// The line of one s and what the strip about it holds.
struct Strip {
    inner: CurvePoint,
    outer: CurvePoint,
    line: [f64; 2],
    /// r and J at t = 0 and t = 1; on the axis, where r vanishes, |dr/ds| in place of r.
    r: [f64; 2],
    jacobian: [f64; 2],
}

impl Shell {
    /// The wall between `inner` and `outer` for s in `range`, run through in the direction in which the solid is on the right
    /// (base to apex).
    ///
    /// # Errors
    /// [`Error::NotFinite`] or [`Error::NotPositive`] for the range, [`Error::Folded`] where lines between the curves cross in
    /// the wall or a radius is negative, so that s and u are no coordinates.
    pub fn new(inner: Curve, outer: Curve, range: [f64; 2]) -> Result<Self, Error> {
        let [first, last] = range;
        finite("start of the parameter", first)?;
        positive("length of the parameter's range", last - first)?;
        let mut knots: Vec<f64> = [inner.knots(), outer.knots()].concat();
        // Knots that mean the same place would make an interval of rounding.
        let near = 1e-12 * (last - first);
        knots.retain(|&s| s > first + near && s < last - near);
        knots.extend(range);
        knots.sort_by(f64::total_cmp);
        knots.dedup_by(|b, a| *b - *a < near);
        let mut shell = Self {
            inner,
            outer,
            range,
            knots,
            below: vec![0.0],
            series: Vec::new(),
            lines: Vec::new(),
            bounds: [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
            size: 0.0,
        };
        let per_interval = LINES.div_ceil(shell.knots.len() - 1);
        let mut places: Vec<f64> = Vec::new();
        for pair in shell.knots.windows(2) {
            let at = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / per_interval as f64;
            places.extend((0..per_interval).map(at));
        }
        places.push(last);
        shell.lines = places.into_iter().map(|s| shell.line(s)).collect();
        for (_, a, d) in &shell.lines {
            for k in 0..2 {
                for end in [a[k], a[k] + d[k]] {
                    shell.bounds[0][k] = shell.bounds[0][k].min(end);
                    shell.bounds[1][k] = shell.bounds[1][k].max(end);
                }
            }
        }
        let [low, high] = shell.bounds;
        shell.size = (high[0] - low[0]).max(high[1] - low[1]);
        for k in 0..2 {
            // Between the places looked at, the curves may reach out a little.
            shell.bounds[0][k] -= 0.05 * shell.size;
            shell.bounds[1][k] += 0.05 * shell.size;
        }
        // J has the size of a length squared.
        let least = -1e-12 * shell.size;
        for &(s, ..) in &shell.lines {
            let strip = shell.strip(s);
            for k in 0..2 {
                let (r, jacobian) = (strip.r[k], strip.jacobian[k]);
                if r.is_nan() || jacobian.is_nan() || r < least || jacobian < least * shell.size {
                    return Err(Error::Folded { s, r, jacobian });
                }
            }
        }
        // The strip's volume is a polynomial of degree 3 p - 1 in s.
        let n = 3 * shell.inner.degree().max(shell.outer.degree());
        for pair in shell.knots.windows(2) {
            let series = integral(n, pair[0], pair[1], |s| shell.strip(s).volume());
            let sum = shell.below[shell.below.len() - 1] + chebyshev(&series, 1.0)[0];
            shell.below.push(sum);
            shell.series.push(series);
        }
        positive("volume of the wall", shell.volume())?;
        Ok(shell)
    }

    /// First and last parameter.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Volume of the wall, cm^3: exact for the curves' polynomials.
    pub fn volume(&self) -> f64 {
        self.below[self.below.len() - 1]
    }

    /// Volume for each unit of s, `dV/ds`.
    pub fn strip_volume(&self, s: f64) -> f64 {
        let strip = self.strip(self.clamped(s));
        if strip.on_axis(self.size) {
            0.0
        } else {
            strip.volume()
        }
    }

    /// The point (x, r) on the layer at s, both clamped to where they exist.
    pub fn point(&self, layer: f64, s: f64) -> [f64; 2] {
        let strip = self.strip(self.clamped(s));
        strip.point(strip.height(layer.clamp(0.0, 1.0)))
    }

    /// Derivatives of the point (x, r), by the layer at fixed s and by s along the layer.
    ///
    /// At an end on the axis, where the first is a limit, both are those 1e-6 of the parameter's range before it.
    pub fn tangents(&self, layer: f64, s: f64) -> [[f64; 2]; 2] {
        let strip = self.strip(self.off_axis(s));
        let t = strip.height(layer.clamp(0.0, 1.0));
        let (d, e) = (
            strip.line,
            [0, 1].map(|k| strip.outer.first[k] - strip.inner.first[k]),
        );
        // The share below t is g(t) / g(1): it stays the same along the layer.
        let rate = strip.r_rate();
        let jacobian_rate =
            [&strip.inner, &strip.outer].map(|c| cross(c.second, d) + cross(c.first, e));
        let change = |t: f64| below(rate, strip.jacobian, t) + below(strip.r, jacobian_rate, t);
        let whole = below(strip.r, strip.jacobian, 1.0);
        let slope = mix(strip.r, t) * mix(strip.jacobian, t);
        let by_layer = whole / slope;
        let by_s = (below(strip.r, strip.jacobian, t) / whole * change(1.0) - change(t)) / slope;
        [
            d.map(|v| v * by_layer),
            [0, 1].map(|k| mix([strip.inner.first[k], strip.outer.first[k]], t) + d[k] * by_s),
        ]
    }

    /// Layer and s of a point (x, r), or nothing if it is not in the wall.
    ///
    /// The surfaces belong to the wall, to 1e-12 of its size.
    pub fn locate(&self, p: [f64; 2]) -> Option<[f64; 2]> {
        let [low, high] = self.bounds;
        // A NaN is nowhere.
        if !(0..2).all(|k| p[k] >= low[k] && p[k] <= high[k]) {
            return None;
        }
        // Positive while the line lies before the point.
        let side = |a: [f64; 2], d: [f64; 2]| cross([p[0] - a[0], p[1] - a[1]], d);
        let slack = ON_AXIS * self.size;
        let (mut before, a, d) = self.lines[0];
        let mut ahead = side(a, d);
        if ahead < 0.0 && ahead >= -slack * norm(d) {
            ahead = 0.0;
        }
        for &(s, a, d) in &self.lines[1..] {
            let mut next = side(a, d);
            // The last line has no neighbour that could hold a point on it.
            if s == self.range[1] && next > 0.0 && next <= slack * norm(d) {
                next = 0.0;
            }
            if ahead >= 0.0 && next <= 0.0 {
                let s = self.root(p, before, s);
                let strip = self.strip(s);
                let from = [0, 1].map(|k| p[k] - strip.inner.position[k]);
                let t = (from[0] * strip.line[0] + from[1] * strip.line[1])
                    / (norm(strip.line) * norm(strip.line));
                let excess = slack / norm(strip.line);
                let off = cross(from, strip.line).abs() / norm(strip.line);
                if t >= -excess && t <= 1.0 + excess && off <= slack {
                    return Some([strip.share(t.clamp(0.0, 1.0)), s]);
                }
            }
            (before, ahead) = (s, next);
        }
        None
    }

    /// Share of the wall's volume before the line of `s`.
    pub fn share(&self, s: f64) -> f64 {
        if s <= self.range[0] {
            return 0.0;
        } else if s >= self.range[1] {
            return 1.0;
        }
        let k = self.knots[1..self.knots.len() - 1].partition_point(|&knot| knot < s);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let u = (s - from + (s - to)) / (to - from);
        ((self.below[k] + chebyshev(&self.series[k], u)[0]) / self.volume()).clamp(0.0, 1.0)
    }

    /// The s before whose line the given share (clamped to [0, 1]) of the wall's volume lies.
    ///
    /// Where the wall ends on the axis the share grows as the square of the distance from it, so that there s has half the
    /// digits of the share.
    pub fn at_share(&self, share: f64) -> f64 {
        if share <= 0.0 {
            return self.range[0];
        } else if share >= 1.0 {
            return self.range[1];
        }
        let volume = share * self.volume();
        let k = self.below[1..self.below.len() - 1].partition_point(|&v| v < volume);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let series = &self.series[k];
        let f = |u: f64| {
            let [value, slope, _] = chebyshev(series, u);
            (self.below[k] + value - volume, slope)
        };
        from + 0.5 * (to - from) * (1.0 + rising_root(f, -1.0, 1.0))
    }

    /// The solid between two layers and the lines of two s, as a profile whose layers are drawn to `tolerance` (cm).
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::NotPositive`] for the tolerance or a range of no width; those of [`Meridian::ring`].
    pub fn region(&self, layers: [f64; 2], s: [f64; 2], tolerance: f64) -> Result<Meridian, Error> {
        positive("tolerance", tolerance)?;
        let layers = layers.map(|u| u.clamp(0.0, 1.0));
        let s = s.map(|s| self.clamped(s));
        positive("width of the layers", layers[1] - layers[0])?;
        positive("length along the wall", s[1] - s[0])?;
        let mut inner = self.arc(layers[0], s, tolerance)?;
        let mut outer = self.arc(layers[1], s, tolerance)?;
        inner.reverse();
        outer.extend(inner);
        for p in &mut outer {
            if p[1].abs() <= ON_AXIS * self.size {
                p[1] = 0.0;
            }
        }
        Meridian::ring(&outer)
    }

    /// A layer from one s to another as a polyline within `tolerance`.
    fn arc(&self, layer: f64, s: [f64; 2], tolerance: f64) -> Result<Vec<[f64; 2]>, Error> {
        let mut stops = vec![s[0]];
        stops.extend(self.knots.iter().filter(|&&k| k > s[0] && k < s[1]));
        stops.push(s[1]);
        let mut points = vec![self.point(layer, s[0])];
        let at = |s: f64| self.point(layer, s);
        for pair in stops.windows(2) {
            // Stretches short enough that none can hide a wiggle between the places looked at.
            let n = self.inner.degree().max(self.outer.degree()).max(1);
            for k in 0..n {
                let s = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / n as f64;
                let ends = [points[points.len() - 1], at(s(k + 1))];
                crate::pieces::flatten(&at, [s(k), s(k + 1)], ends, tolerance, &mut points)?;
            }
        }
        Ok(points)
    }

    /// The inner and the outer curve.
    pub(crate) fn curves(&self) -> (&Curve, &Curve) {
        (&self.inner, &self.outer)
    }

    /// Parameters close enough that the curves are nearly straight between them; all knots are among them.
    pub(crate) fn places(&self) -> Vec<f64> {
        self.lines.iter().map(|line| line.0).collect()
    }

    fn clamped(&self, s: f64) -> f64 {
        s.clamp(self.range[0], self.range[1])
    }

    /// `s`, moved off an end that lies on the axis.
    fn off_axis(&self, s: f64) -> f64 {
        let [first, last] = self.range;
        let by = OFF_AXIS * (last - first);
        let mut s = self.clamped(s);
        for (end, moved) in [(first, (first + by).max(s)), (last, (last - by).min(s))] {
            if (s - end).abs() < by && self.strip(end).on_axis(self.size) {
                s = moved;
            }
        }
        s
    }

    fn line(&self, s: f64) -> (f64, [f64; 2], [f64; 2]) {
        let strip = self.strip(s);
        (s, strip.inner.position, strip.line)
    }

    fn strip(&self, s: f64) -> Strip {
        let (inner, outer) = (self.inner.at(s), self.outer.at(s));
        let line = [0, 1].map(|k| outer.position[k] - inner.position[k]);
        let mut strip = Strip {
            r: [inner.position[1], outer.position[1]],
            jacobian: [cross(inner.first, line), cross(outer.first, line)],
            inner,
            outer,
            line,
        };
        if strip.on_axis(self.size) {
            strip.r = [inner.first[1].abs(), outer.first[1].abs()];
        }
        strip
    }

    /// The s between two lines on either side of `p` whose own line meets it.
    fn root(&self, p: [f64; 2], before: f64, after: f64) -> f64 {
        let f = |s: f64| {
            let strip = self.strip(s);
            let from = [0, 1].map(|k| p[k] - strip.inner.position[k]);
            let turn = [0, 1].map(|k| strip.outer.first[k] - strip.inner.first[k]);
            let slope = cross(from, turn) - cross(strip.inner.first, strip.line);
            // Rising.
            (-cross(from, strip.line), -slope)
        };
        rising_root(f, before, after)
    }
}

impl Strip {
    fn on_axis(&self, size: f64) -> bool {
        let near = ON_AXIS * size;
        self.inner.position[1].abs() <= near && self.outer.position[1].abs() <= near
    }

    /// Derivatives of r by s.
    fn r_rate(&self) -> [f64; 2] {
        [self.inner.first[1], self.outer.first[1]]
    }

    fn volume(&self) -> f64 {
        2.0 * PI
            * below(
                [self.inner.position[1], self.outer.position[1]],
                self.jacobian,
                1.0,
            )
    }

    fn point(&self, t: f64) -> [f64; 2] {
        // Exact at both ends.
        [0, 1].map(|k| mix([self.inner.position[k], self.outer.position[k]], t))
    }

    /// The share of the strip's volume below t.
    fn share(&self, t: f64) -> f64 {
        let whole = below(self.r, self.jacobian, 1.0);
        if whole > 0.0 {
            (below(self.r, self.jacobian, t) / whole).clamp(0.0, 1.0)
        } else {
            t
        }
    }

    /// The t below which the given share of the strip's volume lies.
    fn height(&self, share: f64) -> f64 {
        let whole = below(self.r, self.jacobian, 1.0);
        if !(whole > 0.0 && share > 0.0 && share < 1.0) {
            return share;
        }
        let f = |t: f64| {
            (
                below(self.r, self.jacobian, t) / whole - share,
                mix(self.r, t) * mix(self.jacobian, t) / whole,
            )
        };
        rising_root(f, 0.0, 1.0)
    }
}

/// A quantity that runs linearly from one end to the other.
fn mix(ends: [f64; 2], t: f64) -> f64 {
    (1.0 - t) * ends[0] + t * ends[1]
}

/// The integral from 0 to t of the product of two such quantities.
fn below(a: [f64; 2], b: [f64; 2], t: f64) -> f64 {
    let (da, db) = (a[1] - a[0], b[1] - b[0]);
    t * (a[0] * b[0] + t * ((a[0] * db + da * b[0]) / 2.0 + t * da * db / 3.0))
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn norm(a: [f64; 2]) -> f64 {
    (a[0] * a[0] + a[1] * a[1]).sqrt()
}

/// Where a function (with its slope) rises through zero: Newton's method, kept in its bracket by bisection.
pub(crate) fn rising_root(f: impl Fn(f64) -> (f64, f64), mut low: f64, mut high: f64) -> f64 {
    let mut x = 0.5 * (low + high);
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
        // Bisected unless Newton's step stays inside and gains at least a factor of two.
        let next = if newton >= low && newton <= high && step.abs() <= 0.5 * last {
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

/// The integral from `from` of a polynomial of degree below `n`, as a Chebyshev series on `[from, to]`.
fn integral(n: usize, from: f64, to: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let n = n.max(1);
    let angle = |j: usize| PI * (j as f64 + 0.5) / n as f64;
    let values: Vec<f64> = (0..n)
        .map(|j| f(from + 0.5 * (to - from) * (1.0 + angle(j).cos())))
        .collect();
    let series: Vec<f64> = (0..n)
        .map(|k| {
            let sum: f64 = (0..n)
                .map(|j| values[j] * (k as f64 * angle(j)).cos())
                .sum();
            sum * if k == 0 { 1.0 } else { 2.0 } / n as f64
        })
        .collect();
    // The integral of T_k is T_(k+1) / (2 (k + 1)) - T_(k-1) / (2 (k - 1)); that of T_0 is T_1.
    let c = |k: usize| series.get(k).copied().unwrap_or(0.0);
    let half = 0.5 * (to - from);
    let mut out = vec![0.0; n + 1];
    for k in 1..=n {
        let lower = if k == 1 { 2.0 * c(0) } else { c(k - 1) };
        out[k] = half * (lower - c(k + 1)) / (2 * k) as f64;
    }
    out[0] = -chebyshev(&out, -1.0)[0];
    out
}
