//! A profile as a curve with a parameter: what a membrane solver gives, its material points included.

use crate::error::{finite, length};
use crate::{Error, Piece};

/// Pieces of polynomials on consecutive intervals of a parameter s; x and r in cm.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    knots: Vec<f64>,
    pieces: Vec<Piece>,
}

/// A point of a curve in the half-plane with its derivatives by the parameter, each (x, r).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Where it is.
    pub position: [f64; 2],
    /// First derivative by s.
    pub first: [f64; 2],
    /// Second derivative by s.
    pub second: [f64; 2],
}

impl Curve {
    /// A curve from the ends of its pieces' intervals, ascending, and the pieces between them.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one more knot than pieces and at least one piece, [`Error::NotFinite`] for a knot
    /// or a coefficient, [`Error::NotPositive`] for an interval.
    pub fn new(knots: Vec<f64>, pieces: Vec<Piece>) -> Result<Self, Error> {
        length(
            "knots (one more than pieces)",
            pieces.len().max(1) + 1,
            knots.len(),
        )?;
        length("pieces", knots.len() - 1, pieces.len())?;
        for &knot in &knots {
            finite("knot", knot)?;
        }
        for pair in knots.windows(2) {
            crate::error::positive("interval between knots", pair[1] - pair[0])?;
        }
        for piece in &pieces {
            for c in piece.coefficients().into_iter().flatten() {
                finite("coefficient", *c)?;
            }
        }
        Ok(Self { knots, pieces })
    }

    /// The polyline through `points` (x, r), point k at the parameter `knots[k]`.
    ///
    /// # Errors
    /// As [`Curve::new`].
    pub fn polyline(knots: &[f64], points: &[[f64; 2]]) -> Result<Self, Error> {
        length("points (one per knot)", knots.len(), points.len())?;
        let between = |p: &[[f64; 2]], k: usize| vec![p[0][k], p[1][k] - p[0][k]];
        let pieces = points.windows(2).map(|p| Piece::Power {
            x: between(p, 0),
            r: between(p, 1),
        });
        Self::new(knots.to_vec(), pieces.collect())
    }

    /// Where the pieces begin and end.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Largest number of coefficients of a piece, less one.
    pub(crate) fn degree(&self) -> usize {
        let sizes = self.pieces.iter().flat_map(Piece::coefficients);
        sizes.map(|c| c.len()).max().unwrap_or(1).max(1) - 1
    }

    /// The point at `s`; beyond the ends, the end piece continued.
    pub fn at(&self, s: f64) -> CurvePoint {
        let last = self.pieces.len() - 1;
        let k = self.knots[1..=last].partition_point(|&knot| knot < s);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let (rate, [x, r]) = match &self.pieces[k] {
            Piece::Chebyshev { x, r } => {
                let u = (s - from + (s - to)) / (to - from);
                (2.0 / (to - from), [x, r].map(|c| chebyshev(c, u)))
            }
            Piece::Power { x, r } => {
                let u = (s - from) / (to - from);
                (1.0 / (to - from), [x, r].map(|c| power(c, u)))
            }
        };
        CurvePoint {
            position: [x[0], r[0]],
            first: [x[1] * rate, r[1] * rate],
            second: [x[2] * rate * rate, r[2] * rate * rate],
        }
    }
}

/// A Chebyshev series with its first two derivatives, by Clenshaw's recurrence and its derivatives.
pub(crate) fn chebyshev(coefficients: &[f64], u: f64) -> [f64; 3] {
    let (mut b, mut db, mut ddb) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for &c in coefficients.iter().skip(1).rev() {
        ddb = [4.0 * db[0] + 2.0 * u * ddb[0] - ddb[1], ddb[0]];
        db = [2.0 * b[0] + 2.0 * u * db[0] - db[1], db[0]];
        b = [c + 2.0 * u * b[0] - b[1], b[0]];
    }
    [
        coefficients.first().copied().unwrap_or(0.0) + u * b[0] - b[1],
        b[0] + u * db[0] - db[1],
        2.0 * db[0] + u * ddb[0] - ddb[1],
    ]
}

/// A power series with its first two derivatives, by Horner's rule.
fn power(coefficients: &[f64], u: f64) -> [f64; 3] {
    coefficients.iter().rev().fold([0.0; 3], |[p, d, dd], c| {
        [c + u * p, p + u * d, 2.0 * d + u * dd]
    })
}
