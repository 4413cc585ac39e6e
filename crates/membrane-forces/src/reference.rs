//! Reference configurations: the unloaded curve c0(s), from which springs are displaced.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::error::{MembraneError, Result, at_least, finite, positive, rising};
use crate::shared::Shared;

/// A point of a curve with its first two derivatives with respect to s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Position [x, y], x along the axis of revolution (cm).
    pub position: [f64; 2],
    /// First derivative, per unit s.
    pub first: [f64; 2],
    /// Second derivative, per unit s squared.
    pub second: [f64; 2],
}

/// The unloaded curve c0(s), s in [0, 1], smooth between its breakpoints.
///
/// The built-in shapes run with constant speed (s proportional to arc length) from (0, +R)
/// over the apex to (0, -R); x is the axis of revolution. Shapes of a function are equal if they share it, as clones do.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceShape {
    /// 0 = first, ..., 1 = last: piece k covers `[breaks[k], breaks[k + 1]]`.
    breaks: Vec<f64>,
    pieces: Vec<Piece>,
}

/// Samples per piece of a function.
const SAMPLES: usize = 64;
/// Halvings of the distance between two samples until only a jump is left.
const HALVINGS: usize = 24;

type CurveFunction = dyn Fn(f64) -> CurvePoint + Send + Sync;

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Line {
        from: [f64; 2],
        to: [f64; 2],
    },
    Arc {
        centre: [f64; 2],
        radius: f64,
        start: f64,
        sweep: f64,
    },
    Function(Shared<CurveFunction>),
}

impl Piece {
    fn line(from: [f64; 2], to: [f64; 2]) -> Self {
        Self::Line { from, to }
    }
}

impl ReferenceShape {
    /// A cylinder of length `h` closed by a hemisphere of radius `radius` (cm), open at x = 0 (Rohmer et al. 2006, Table 1).
    ///
    /// ```
    /// use membrane_forces::ReferenceShape;
    /// let rest = ReferenceShape::balloon(8.5, 1.75)?;
    /// assert_eq!(rest.at(0.0).position, [0.0, 1.75]);
    /// assert!((rest.at(0.5).position[0] - 10.25).abs() < 1e-14);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// `h` or `radius` not finite or not positive, or a ratio at which a piece of the curve vanishes by rounding (about 1e16).
    pub fn balloon(h: f64, radius: f64) -> Result<Self> {
        positive("cylinder length", h)?;
        positive("radius", radius)?;
        let length = 2.0 * h + PI * radius;
        let line = h / length;
        rising(&[line, 1.0 - line])?;
        let cap = Piece::Arc {
            centre: [h, 0.0],
            radius,
            start: PI / 2.0,
            sweep: -PI,
        };
        Ok(Self {
            breaks: vec![0.0, line, 1.0 - line, 1.0],
            pieces: vec![
                Piece::line([0.0, radius], [h, radius]),
                cap,
                Piece::line([h, -radius], [0.0, -radius]),
            ],
        })
    }

    /// The straight line from (0, +R) to (0, -R): a flat disc when revolved.
    ///
    /// # Errors
    /// `radius` not finite or not positive.
    pub fn disc(radius: f64) -> Result<Self> {
        positive("radius", radius)?;
        Ok(Self {
            breaks: vec![0.0, 1.0],
            pieces: vec![Piece::line([0.0, radius], [0.0, -radius])],
        })
    }

    /// Straight segments through `points` from (0, +R) over the apex at x > 0 to (0, -R), s proportional to arc length. Both halves belong to
    /// the curve, and the positions are [x, y] with x along the axis.
    ///
    /// # Errors
    /// Fewer than two points, a coordinate that is not finite, neighbours that coincide, segments that cross;
    /// [`MembraneError::EndsOnOneSide`], also of half a curve, and [`MembraneError::InsideOut`] of a curve that runs the other way.
    pub fn polyline(points: &[[f64; 2]]) -> Result<Self> {
        at_least("polyline points", points.len(), 2)?;
        let mut lengths = vec![0.0];
        for (index, pair) in points.windows(2).enumerate() {
            for value in pair.as_flattened() {
                finite("polyline coordinate", *value)?;
            }
            let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            let so_far = lengths[index] + step;
            finite("polyline length", so_far)?;
            if so_far == lengths[index] {
                return Err(MembraneError::CoincidentPoints { index });
            }
            lengths.push(so_far);
        }
        check_body(points)?;
        let total = lengths[points.len() - 1];
        Ok(Self {
            breaks: lengths.iter().map(|l| l / total).collect(),
            pieces: (points.windows(2).map(|p| Piece::line(p[0], p[1]))).collect(),
        })
    }

    /// A curve from (0, +R) over the apex at x > 0 to (0, -R), clockwise, so that the enclosed volume is positive: `curve(s)` gives
    /// position, first and second derivative with respect to s. `breakpoints` are the s inside (0, 1) at which the first or second derivative
    /// jumps.
    ///
    /// # Errors
    /// Breakpoints that are not strictly ascending inside (0, 1), values that are not finite, a vanishing first derivative, derivatives
    /// that differ from central differences by more than a thousandth ([`MembraneError::WrongDerivative`]), a first derivative that jumps by
    /// more than a thousandth between breakpoints ([`MembraneError::Kink`]), a curve that crosses itself, whose ends are on one side of the
    /// axis ([`MembraneError::EndsOnOneSide`]), or that encloses a negative volume ([`MembraneError::InsideOut`]; all as sampled at 64 points
    /// per piece).
    pub fn from_function(
        curve: impl Fn(f64) -> CurvePoint + Send + Sync + 'static,
        breakpoints: &[f64],
    ) -> Result<Self> {
        rising(breakpoints)?;
        let breaks = [&[0.0], breakpoints, &[1.0]].concat();
        let curve: Shared<CurveFunction> = Shared(Arc::new(curve));
        let pieces = vec![Piece::Function(curve); breaks.len() - 1];
        let shape = Self { breaks, pieces };
        shape.check_sampled()?;
        for piece in 0..shape.pieces.len() {
            shape.check_derivatives(piece)?;
            shape.check_smooth(piece)?;
        }
        Ok(shape)
    }

    /// Rejects a first derivative that jumps inside a piece: between samples where its change differs from the integral of the second
    /// derivative, the interval is halved around the larger change, which vanishes unless it is a jump.
    fn check_smooth(&self, piece: usize) -> Result<()> {
        let (a, b) = (self.breaks[piece], self.breaks[piece + 1]);
        // not at the ends, where a function has the derivative of the next piece
        let inside = (0..SAMPLES).map(|k| (k as f64 + 0.5) / SAMPLES as f64);
        let places = [1e-6].into_iter().chain(inside).chain([1.0 - 1e-6]);
        let samples: Vec<(f64, CurvePoint)> = places
            .map(|t| a + (b - a) * t)
            .map(|s| (s, self.at_in(piece, s)))
            .collect();
        let size = |v: [f64; 2]| v[0].hypot(v[1]);
        let change =
            |from: &CurvePoint, to: &CurvePoint| [0, 1].map(|k| to.first[k] - from.first[k]);
        for pair in samples.windows(2) {
            let [(mut from, mut before), (mut to, mut after)] = [pair[0], pair[1]];
            let smallest = 1e-3 * size(before.first).max(size(after.first));
            let turned = change(&before, &after);
            let bend = |k: usize| 0.5 * (to - from) * (before.second[k] + after.second[k]);
            if size([turned[0] - bend(0), turned[1] - bend(1)]) <= smallest {
                continue;
            }
            for _ in 0..HALVINGS {
                let s = 0.5 * (from + to);
                let middle = self.at_in(piece, s);
                if size(change(&before, &middle)) > size(change(&middle, &after)) {
                    (to, after) = (s, middle);
                } else {
                    (from, before) = (s, middle);
                }
            }
            if size(change(&before, &after)) > smallest {
                let (s, before, after) = (to, before.first, after.first);
                return Err(MembraneError::Kink { s, before, after });
            }
        }
        Ok(())
    }

    /// Compares derivatives with central differences at the middles of the samples. Over 1e-5 of the piece they are accurate to 1e-10 of a
    /// derivative (truncation, for wavelengths of at least the piece) and to 1e-11 of the size (rounding).
    fn check_derivatives(&self, piece: usize) -> Result<()> {
        let (a, b) = (self.breaks[piece], self.breaks[piece + 1]);
        let step = 1e-5 * (b - a);
        let middle = |k: usize| a + (b - a) * (k as f64 + 0.5) / SAMPLES as f64;
        let samples: Vec<CurvePoint> = (0..SAMPLES).map(|k| self.at_in(piece, middle(k))).collect();
        let largest = |of: fn(&CurvePoint) -> [f64; 2]| {
            let values = samples.iter().map(|point| of(point)[0].hypot(of(point)[1]));
            values.fold(0.0, f64::max)
        };
        let speed = largest(|point| point.first);
        // per length of the piece; a vanishing second derivative is at most as large as the first
        let bend = largest(|point| point.second).max(speed / (b - a));
        for (k, here) in samples.iter().enumerate() {
            let s = middle(k);
            let (before, after) = (self.at_in(piece, s - step), self.at_in(piece, s + step));
            let slope =
                |from: [f64; 2], to: [f64; 2]| [0, 1].map(|i| (to[i] - from[i]) / (2.0 * step));
            for (order, given, found, size) in [
                (1, here.first, slope(before.position, after.position), speed),
                (2, here.second, slope(before.first, after.first), bend),
            ] {
                // rounding of the values and of s, which matters on narrow pieces
                let of = [here.position, here.first][order - 1];
                let rounding = 8.0 * f64::EPSILON * (of[0].hypot(of[1]) + size) / step;
                let off = (given[0] - found[0]).hypot(given[1] - found[1]);
                if off > 1e-3 * size + rounding {
                    return Err(MembraneError::WrongDerivative {
                        order,
                        s,
                        given,
                        found,
                    });
                }
            }
        }
        Ok(())
    }

    /// Samples each piece and rejects values and geometry without a defined force.
    fn check_sampled(&self) -> Result<()> {
        let mut points = Vec::with_capacity(SAMPLES * self.pieces.len() + 1);
        for piece in 0..self.pieces.len() {
            for k in 0..SAMPLES {
                let (a, b) = (self.breaks[piece], self.breaks[piece + 1]);
                let here = self.at_in(piece, a + (b - a) * k as f64 / SAMPLES as f64);
                for value in [here.position, here.first, here.second].as_flattened() {
                    finite("reference curve", *value)?;
                }
                let index = points.len();
                if here.first == [0.0, 0.0] || points.last() == Some(&here.position) {
                    return Err(MembraneError::CoincidentPoints { index });
                }
                points.push(here.position);
            }
        }
        let last = self.at(1.0).position;
        finite("reference curve", last[0] + last[1])?;
        points.push(last);
        check_body(&points)
    }

    /// 0, the positions at which the first or second derivative jumps, 1.
    #[must_use]
    pub fn breakpoints(&self) -> &[f64] {
        &self.breaks
    }

    /// The curve at `s`; at a breakpoint the derivatives are those of the piece on its right.
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePoint {
        let inner = &self.breaks[1..self.pieces.len()];
        self.at_in(inner.partition_point(|&b| b <= s), s)
    }

    /// Returns the curve at `s` by piece `piece`: one-sided derivatives at breakpoints.
    pub(crate) fn at_in(&self, piece: usize, s: f64) -> CurvePoint {
        let (a, b) = (self.breaks[piece], self.breaks[piece + 1]);
        // From the nearer end, so that mirror images are equal to rounding.
        let t = if s - a <= b - s {
            (s - a) / (b - a)
        } else {
            1.0 - (b - s) / (b - a)
        };
        let per_s = 1.0 / (b - a);
        match &self.pieces[piece] {
            Piece::Line { from, to } => {
                let way = [to[0] - from[0], to[1] - from[1]];
                let position = |k: usize| {
                    if t <= 0.5 {
                        from[k] + t * way[k]
                    } else {
                        to[k] - (1.0 - t) * way[k]
                    }
                };
                CurvePoint {
                    position: [position(0), position(1)],
                    first: [way[0] * per_s, way[1] * per_s],
                    second: [0.0; 2],
                }
            }
            Piece::Arc {
                centre,
                radius,
                start,
                sweep,
            } => {
                let (sin, cos) = (start + sweep * t).sin_cos();
                let omega = sweep * per_s;
                CurvePoint {
                    position: [centre[0] + radius * cos, centre[1] + radius * sin],
                    first: [-radius * omega * sin, radius * omega * cos],
                    second: [-radius * omega * omega * cos, -radius * omega * omega * sin],
                }
            }
            Piece::Function(Shared(curve)) => curve(s),
        }
    }
}

/// Rejects a curve that crosses itself, that ends on the side of the axis on which it begins, or that is inside out.
fn check_body(points: &[[f64; 2]]) -> Result<()> {
    crate::crossing::check(points)?;
    match *points {
        [from, .., to] => check_sides([from, to]),
        _ => Ok(()),
    }
}

/// Rejects ends on one side of the axis.
pub(crate) fn check_sides([from, to]: [[f64; 2]; 2]) -> Result<()> {
    match from[1].min(to[1]) < 0.0 && from[1].max(to[1]) > 0.0 {
        true => Ok(()),
        false => Err(MembraneError::EndsOnOneSide { from, to }),
    }
}
