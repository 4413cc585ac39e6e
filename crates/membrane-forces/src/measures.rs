//! Length, area, surface and volume of a polyline and their exact gradients (section 3.3).

use std::f64::consts::PI;

use crate::error::{MembraneError, finite, length};

/// A measure of a curve: length, area, surface or volume.
///
/// A curve is given by its nodes [x, y], from (0, +R) over the apex to (0, -R), joined by straight
/// segments; fewer than two make a curve of length, area, surface and volume zero. Surface and
/// volume revolve the curve about the x axis; the full curve covers the body twice, so they are
/// half the sum over its segments, and a segment that crosses the axis is split there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Measure {
    /// Length of the curve (Eq. 30), cm.
    Length,
    /// Signed area between the curve and the chord that closes it (shoelace; Eq. 31 without its
    /// absolute value), cm^2. Positive for a curve that runs clockwise.
    Area,
    /// Lateral surface of revolution, pi times the integral of |y| along the curve, cm^2.
    Surface,
    /// Volume of revolution, pi / 2 times the integral of y |y| dx (Eq. 34), cm^3.
    Volume,
}

/// All four measures of one curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Length of the 2-D curve, cm.
    pub length: f64,
    /// Signed 2-D area, cm^2.
    pub area: f64,
    /// Lateral surface of revolution, cm^2.
    pub surface: f64,
    /// Volume of revolution, cm^3.
    pub volume: f64,
}

impl Measures {
    /// The measures of the polyline through `nodes`. Cost O(n).
    #[must_use]
    pub fn of(nodes: &[[f64; 2]]) -> Self {
        Self {
            length: Measure::Length.of(nodes),
            area: Measure::Area.of(nodes),
            surface: Measure::Surface.of(nodes),
            volume: Measure::Volume.of(nodes),
        }
    }

    /// Returns the measures if all are finite; those of a curve of 1e100 cm overflow.
    ///
    /// # Errors
    /// [`MembraneError::NotFinite`].
    pub fn finite(self) -> Result<Self, MembraneError> {
        finite("length", self.length)?;
        finite("area", self.area)?;
        finite("surface", self.surface)?;
        finite("volume", self.volume)?;
        Ok(self)
    }
}

impl Measure {
    /// The measure of the polyline through `nodes`. Cost O(n).
    ///
    /// ```
    /// use membrane_forces::Measure;
    /// let cone = [[0.0, 3.0], [4.0, 0.0], [0.0, -3.0]];
    /// assert_eq!(Measure::Length.of(&cone), 10.0);
    /// assert_eq!(Measure::Area.of(&cone), 12.0);
    /// assert!((Measure::Surface.of(&cone) - std::f64::consts::PI * 15.0).abs() < 1e-13);
    /// assert!((Measure::Volume.of(&cone) - std::f64::consts::PI * 12.0).abs() < 1e-13);
    /// ```
    #[must_use]
    pub fn of(self, nodes: &[[f64; 2]]) -> f64 {
        self.segments(nodes.len())
            .map(|(a, b)| self.segment(nodes[a], nodes[b]).value)
            .sum()
    }

    /// `out` = gradient with respect to every node coordinate, the derivative of exactly what
    /// [`Measure::of`] returns. Cost O(n).
    ///
    /// # Panics
    /// `out` has another length than `nodes`.
    pub fn gradient_into(self, nodes: &[[f64; 2]], out: &mut [[f64; 2]]) {
        assert_eq!(nodes.len(), out.len(), "measure gradient");
        out.fill([0.0; 2]);
        self.segments(nodes.len()).for_each(|(a, b)| {
            let piece = self.segment(nodes[a], nodes[b]);
            for k in 0..2 {
                out[a][k] += piece.from[k];
                out[b][k] += piece.to[k];
            }
        });
    }

    /// Returns the rate of change of the measure of the polyline through `nodes` that move at `velocities`, per unit time: the gradient
    /// times the velocities. Cost O(n).
    ///
    /// ```
    /// use membrane_forces::Measure;
    /// // a cone of radius 3 whose apex moves away at 2: pi 3^2 2 / 3
    /// let (cone, moving) = ([[0.0, 3.0], [4.0, 0.0], [0.0, -3.0]], [[0.0; 2], [2.0, 0.0], [0.0; 2]]);
    /// assert!((Measure::Volume.rate(&cone, &moving)? - 6.0 * std::f64::consts::PI).abs() < 1e-13);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if the numbers of velocities and nodes differ.
    pub fn rate(self, nodes: &[[f64; 2]], velocities: &[[f64; 2]]) -> Result<f64, MembraneError> {
        length("velocities", velocities.len(), nodes.len())?;
        let along = |(a, b): (usize, usize)| {
            let piece = self.segment(nodes[a], nodes[b]);
            let ([u, v], [from, to]) = ([velocities[a], velocities[b]], [piece.from, piece.to]);
            from[0] * u[0] + from[1] * u[1] + to[0] * v[0] + to[1] * v[1]
        };
        Ok(self.segments(nodes.len()).map(along).sum())
    }

    /// As [`Measure::of`], for the curve of `nodes` and their mirror images about the x axis; a last node off the axis is joined to its
    /// image.
    pub(crate) fn of_half(self, points: &[[f64; 2]]) -> f64 {
        let (first, last) = (points[0], points[points.len() - 1]);
        let inside: f64 = points
            .windows(2)
            .map(|p| self.segment(p[0], p[1]).value)
            .sum();
        let across = match last[1] {
            0.0 => 0.0,
            _ => self.segment(last, foot(last)).value,
        };
        let close = match self {
            Self::Area => self.segment(foot(first), first).value,
            _ => 0.0,
        };
        2.0 * (inside + across + close)
    }

    /// `out` = gradient of [`Measure::of_half`].
    pub(crate) fn half_gradient_into(self, points: &[[f64; 2]], out: &mut [[f64; 2]]) {
        out.fill([0.0; 2]);
        let mut add = |n: usize, by: [f64; 2]| {
            out[n][0] += 2.0 * by[0];
            out[n][1] += 2.0 * by[1];
        };
        for n in 1..points.len() {
            let piece = self.segment(points[n - 1], points[n]);
            add(n - 1, piece.from);
            add(n, piece.to);
        }
        // The foot of the perpendicular moves along the axis with its node.
        let last = points.len() - 1;
        if points[last][1] != 0.0 {
            let across = self.segment(points[last], foot(points[last]));
            add(last, [across.from[0] + across.to[0], across.from[1]]);
        }
        if self == Self::Area {
            let close = self.segment(foot(points[0]), points[0]);
            add(0, [close.from[0] + close.to[0], close.to[1]]);
        }
    }

    /// Nodes at the ends of the segments of a curve of `n` nodes, the chord that closes an area last.
    fn segments(self, n: usize) -> impl Iterator<Item = (usize, usize)> {
        let chord = (self == Self::Area && n > 1).then(|| (n - 1, 0));
        (1..n).map(|k| (k - 1, k)).chain(chord)
    }

    /// Returns the contribution of the segment from `a` to `b`, and its derivatives by `a` and `b`.
    #[inline]
    fn segment(self, a: [f64; 2], b: [f64; 2]) -> Segment {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        match self {
            Self::Length => {
                let length = dx.hypot(dy);
                let unit = [dx / length, dy / length];
                Segment {
                    value: length,
                    from: [-unit[0], -unit[1]],
                    to: unit,
                }
            }
            Self::Area => Segment {
                value: 0.5 * (b[0] * a[1] - a[0] * b[1]),
                from: [-0.5 * b[1], 0.5 * b[0]],
                to: [0.5 * a[1], -0.5 * a[0]],
            },
            Self::Surface => {
                // mean of |y| over the segment times its length, times pi
                let length = dx.hypot(dy);
                let unit = [dx / length, dy / length];
                let (mean, da, db) = mean_abs(a[1], b[1]);
                Segment {
                    value: PI * mean * length,
                    from: [-PI * mean * unit[0], PI * (da * length - mean * unit[1])],
                    to: [PI * mean * unit[0], PI * (db * length + mean * unit[1])],
                }
            }
            Self::Volume => {
                // mean of y |y| over the segment times dx, times pi / 2
                let (mean, da, db) = mean_signed_square(a[1], b[1]);
                let c = 0.5 * PI;
                Segment {
                    value: c * mean * dx,
                    from: [-c * mean, c * da * dx],
                    to: [c * mean, c * db * dx],
                }
            }
        }
    }
}

struct Segment {
    value: f64,
    from: [f64; 2],
    to: [f64; 2],
}

/// The point on the axis beside `point`.
fn foot(point: [f64; 2]) -> [f64; 2] {
    [point[0], 0.0]
}

/// Mean of |y| for y running linearly from a to b, with its derivatives by a and b.
#[inline]
fn mean_abs(a: f64, b: f64) -> (f64, f64, f64) {
    if a * b >= 0.0 {
        let sign = if a + b < 0.0 { -1.0 } else { 1.0 };
        return (0.5 * (a + b).abs(), 0.5 * sign, 0.5 * sign);
    }
    let sum = a.abs() + b.abs();
    let mean = 0.5 * (a * a + b * b) / sum;
    (
        (mean),
        (a - mean * a.signum()) / sum,
        (b - mean * b.signum()) / sum,
    )
}

/// Mean of y |y| for y running linearly from a to b, with its derivatives by a and b.
#[inline]
fn mean_signed_square(a: f64, b: f64) -> (f64, f64, f64) {
    if a * b >= 0.0 {
        let sign = if a + b < 0.0 { -1.0 } else { 1.0 };
        let third = sign / 3.0;
        return (
            third * (a * a + a * b + b * b),
            third * (2.0 * a + b),
            third * (a + 2.0 * b),
        );
    }
    // the integral of y |y| dy is |y|^3 / 3
    let mean = (b.abs().powi(3) - a.abs().powi(3)) / (3.0 * (b - a));
    (
        mean,
        (mean - a * a.abs()) / (b - a),
        (b * b.abs() - mean) / (b - a),
    )
}
