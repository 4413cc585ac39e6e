//! Length, area, surface and volume of a polyline and their exact gradients (section 3.3).

use std::f64::consts::PI;

use crate::error::{MembraneError, Result, finite};

/// A measure of a curve: length, area, surface or volume.
///
/// A curve is given by its nodes [x, y], from (0, +R) over the apex to (0, -R), joined by straight segments; fewer than two make a curve of
/// length, area, surface and volume zero. Surface and volume revolve the curve about the x axis; the full curve covers the body twice, so
/// they are half the sum over its segments, and a segment that crosses the axis is split there.
///
/// Nodes up to the axis only, as in states of rubber ([`DiscreteMembrane::is_half`](crate::DiscreteMembrane::is_half)), have half of the length,
/// surface and volume. Use [`DiscreteMembrane::measures`](crate::DiscreteMembrane::measures), or `points` of that trait for the whole curve.
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
    /// The measures of the polyline through `nodes`, of the whole curve ([`Measure`]). Cost O(n).
    #[must_use]
    pub fn of(nodes: &[[f64; 2]]) -> Self {
        Measure::ALL.map(|measure| measure.of(nodes)).into()
    }

    /// Returns the measures if all are finite; those of a curve of 1e100 cm overflow.
    ///
    /// # Errors
    /// [`MembraneError::OutOfRange`](crate::MembraneError::OutOfRange).
    pub fn finite(self) -> Result<Self> {
        finite("length", self.length)?;
        finite("area", self.area)?;
        finite("surface", self.surface)?;
        finite("volume", self.volume)?;
        Ok(self)
    }
}

impl From<[f64; 4]> for Measures {
    fn from([length, area, surface, volume]: [f64; 4]) -> Self {
        Self {
            length,
            area,
            surface,
            volume,
        }
    }
}

impl Measure {
    /// In the order of the fields of [`Measures`].
    pub(crate) const ALL: [Self; 4] = [Self::Length, Self::Area, Self::Surface, Self::Volume];

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
        self.value(nodes, false)
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
    /// [`MembraneError::WrongLength`](crate::MembraneError::WrongLength) if the numbers of velocities and nodes differ.
    pub fn rate(self, nodes: &[[f64; 2]], velocities: &[[f64; 2]]) -> Result<f64> {
        MembraneError::length("velocities", velocities.len(), nodes.len())?;
        let mut rate = 0.0;
        let mut add = |by: [f64; 2], n: usize| {
            rate += by[0] * velocities[n][0] + by[1] * velocities[n][1];
        };
        self.each_segment(nodes, false, |segment, a, b| {
            add(segment.from, a);
            add(segment.to, b);
        });
        Ok(rate)
    }

    /// The measure of the polyline through `nodes`, or of a curve of which they are one `half`.
    pub(crate) fn value(self, nodes: &[[f64; 2]], half: bool) -> f64 {
        let mut sum = 0.0;
        self.each_segment(nodes, half, |segment, _, _| sum += segment.value);
        copies(half) * sum
    }

    /// `out` = gradient of [`Measure::value`].
    pub(crate) fn gradient(self, nodes: &[[f64; 2]], half: bool, out: &mut [[f64; 2]]) {
        out.fill([0.0; 2]);
        let copies = copies(half);
        self.each_segment(nodes, half, |segment, a, b| {
            segment.add_gradient(copies, [a, b], out);
        });
    }

    /// Calls `visit` for each segment with the indices of its nodes, that which closes an area last.
    ///
    /// Half a curve is the mirror image of the other about the x axis: a last node off the axis is joined to its image, and the chord
    /// between the ends begins on the axis. The foot of a node on the axis moves along it with the node.
    #[inline]
    fn each_segment(
        self,
        nodes: &[[f64; 2]],
        half: bool,
        mut visit: impl FnMut(Segment, usize, usize),
    ) {
        let Some(last) = nodes.len().checked_sub(1) else {
            return;
        };
        for (n, pair) in nodes.windows(2).enumerate() {
            visit(self.segment(pair[0], pair[1]), n, n + 1);
        }
        if half && nodes[last][1] != 0.0 {
            let mut across = self.segment(nodes[last], [nodes[last][0], 0.0]);
            across.from[0] += across.to[0];
            across.to = [0.0; 2];
            visit(across, last, last);
        }
        if let Some((chord, a, b)) = self.closing(nodes, half) {
            visit(chord, a, b);
        }
    }

    /// Returns the chord that closes an area, with the indices of its nodes; `None` for other measures.
    pub(crate) fn closing(self, nodes: &[[f64; 2]], half: bool) -> Option<(Segment, usize, usize)> {
        let last = nodes.len().checked_sub(1)?;
        match (self, half) {
            (Self::Area, true) => {
                let mut chord = self.segment([nodes[0][0], 0.0], nodes[0]);
                chord.to[0] += chord.from[0];
                chord.from = [0.0; 2];
                Some((chord, 0, 0))
            }
            (Self::Area, false) if last > 0 => Some((self.segment(nodes[last], nodes[0]), last, 0)),
            _ => None,
        }
    }

    /// Whether the integrand has a kink where the curve crosses the axis.
    pub(crate) fn has_kink(self) -> bool {
        match self {
            Self::Length | Self::Area => false,
            Self::Surface | Self::Volume => true,
        }
    }

    /// Returns the integrand at a point c of a curve with derivative d by its parameter, and its derivatives by c and d.
    #[inline]
    pub(crate) fn integrand(self, c: [f64; 2], d: [f64; 2]) -> (f64, [f64; 2], [f64; 2]) {
        let speed = || d[0].hypot(d[1]);
        match self {
            Self::Length => {
                let speed = speed();
                (speed, [0.0; 2], [d[0] / speed, d[1] / speed])
            }
            // twice the area is the integral of y x' - x y'
            Self::Area => (
                0.5 * (c[1] * d[0] - c[0] * d[1]),
                [-0.5 * d[1], 0.5 * d[0]],
                [0.5 * c[1], -0.5 * c[0]],
            ),
            Self::Surface => {
                let (speed, y) = (speed(), PI * c[1].abs());
                (
                    y * speed,
                    [0.0, PI * c[1].signum() * speed],
                    [y * (d[0] / speed), y * (d[1] / speed)],
                )
            }
            Self::Volume => {
                let y = 0.5 * PI * c[1] * c[1].abs();
                (y * d[0], [0.0, PI * c[1].abs() * d[0]], [y, 0.0])
            }
        }
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

pub(crate) struct Segment {
    pub(crate) value: f64,
    from: [f64; 2],
    to: [f64; 2],
}

impl Segment {
    /// Adds its gradient times `copies` to those by its nodes.
    #[inline]
    pub(crate) fn add_gradient(&self, copies: f64, [a, b]: [usize; 2], out: &mut [[f64; 2]]) {
        for k in 0..2 {
            out[a][k] += copies * self.from[k];
            out[b][k] += copies * self.to[k];
        }
    }
}

/// Number of times that a half counts.
pub(crate) fn copies(half: bool) -> f64 {
    if half { 2.0 } else { 1.0 }
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
        mean,
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
