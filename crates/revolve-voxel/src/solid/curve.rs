//! Parametrised meridian curves, such as solutions of a membrane solver with material coordinates.

use crate::error::{finite, length, positive};
use crate::solid::series::{chebyshev, power};
use crate::{Piece, RevolveError};

/// Pieces of polynomials on consecutive intervals of a parameter s; x and r in cm.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    knots: Vec<f64>,
    pieces: Vec<Piece>,
}

/// A point of a curve in the half-plane with its derivatives by the parameter, each (x, r).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Position.
    pub position: [f64; 2],
    /// First derivative by s.
    pub first: [f64; 2],
    /// Second derivative by s.
    pub second: [f64; 2],
}

impl Curve {
    /// Creates a curve from the ends of the parameter intervals, ascending, and the pieces between them.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] unless there is at least one piece and one more knot than pieces, [`RevolveError::NotFinite`]
    /// for a knot or a coefficient, [`RevolveError::NotPositive`] for an interval.
    pub fn new(knots: Vec<f64>, mut pieces: Vec<Piece>) -> Result<Self, RevolveError> {
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
            positive("interval between knots", pair[1] - pair[0])?;
        }
        for piece in &pieces {
            for c in piece.coefficients().into_iter().flatten() {
                finite("coefficient", *c)?;
            }
        }
        // Series of equal length, so that x and r are evaluated together.
        for piece in &mut pieces {
            let n = piece.coefficients().map(<[f64]>::len).into_iter().max();
            let (Piece::Chebyshev { x, r } | Piece::Power { x, r }) = piece;
            for c in [x, r] {
                c.resize(n.unwrap_or(0).max(1), 0.0);
            }
        }
        Ok(Self { knots, pieces })
    }

    /// Creates the polyline through `points` (x, r), point k at the parameter `knots[k]`.
    ///
    /// # Errors
    /// As [`Curve::new`].
    pub fn polyline(knots: &[f64], points: &[[f64; 2]]) -> Result<Self, RevolveError> {
        length("points (one per knot)", knots.len(), points.len())?;
        let between = |p: &[[f64; 2]], k: usize| vec![p[0][k], p[1][k] - p[0][k]];
        let pieces = points.windows(2).map(|p| Piece::Power {
            x: between(p, 0),
            r: between(p, 1),
        });
        Self::new(knots.to_vec(), pieces.collect())
    }

    /// Returns the polyline of [`Meridian::smooth`](crate::Meridian::smooth) for the same pieces, with the parameter of each point,
    /// so that a wall between such curves ends at the body. A polyline is returned unchanged.
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`] for the tolerance, [`RevolveError::TooFine`] if a piece needs more than ten million points.
    pub fn to_polyline(&self, tolerance: f64) -> Result<Self, RevolveError> {
        if self.degree() <= 1 {
            return Ok(self.clone());
        }
        positive("tolerance", tolerance)?;
        let mut points = vec![(self.knots[0], self.pieces[0].at(0.0))];
        for (pair, piece) in self.knots.windows(2).zip(&self.pieces) {
            let first = points.len();
            piece.draw(tolerance, &mut points)?;
            for (at, _) in &mut points[first..] {
                *at = if *at < 1.0 {
                    pair[0] + *at * (pair[1] - pair[0])
                } else {
                    pair[1]
                };
            }
        }
        let (knots, points): (Vec<f64>, Vec<[f64; 2]>) = points.into_iter().unzip();
        Self::polyline(&knots, &points)
    }

    /// Returns the knots between the pieces.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Returns the largest degree of a piece.
    pub(crate) fn degree(&self) -> usize {
        let sizes = self.pieces.iter().flat_map(Piece::coefficients);
        sizes.map(|c| c.len()).max().unwrap_or(1).max(1) - 1
    }

    /// Returns the point at `s`; beyond the ends the first or last piece is continued.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePoint {
        let last = self.pieces.len() - 1;
        let k = self.knots[1..=last].partition_point(|&knot| knot < s);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let (rate, [position, first, second]) = match &self.pieces[k] {
            Piece::Chebyshev { x, r } => {
                let u = (s - from + (s - to)) / (to - from);
                (2.0 / (to - from), chebyshev([x, r], u))
            }
            Piece::Power { x, r } => {
                let u = (s - from) / (to - from);
                (1.0 / (to - from), power([x, r], u))
            }
        };
        let square = rate * rate;
        CurvePoint {
            position,
            first: [first[0] * rate, first[1] * rate],
            second: [second[0] * square, second[1] * square],
        }
    }
}
