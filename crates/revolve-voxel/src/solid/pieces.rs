//! Smooth meridians: piecewise polynomials, approximated by a polyline to a tolerance.

use crate::error::{finite, positive};
use crate::solid::series::{chebyshev, power};
use crate::{Meridian, RevolveError};

/// A smooth part of a meridian: x and r as polynomials of a parameter, such as the solution of a spectral membrane solver.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// Sums of `c[k] T_k(u)`, Chebyshev polynomials, u from -1 to 1.
    Chebyshev {
        /// Coefficients of x.
        x: Vec<f64>,
        /// Coefficients of r.
        r: Vec<f64>,
    },
    /// Sums of `c[k] u^k`, u from 0 to 1.
    Power {
        /// Coefficients of x.
        x: Vec<f64>,
        /// Coefficients of r.
        r: Vec<f64>,
    },
}

impl Piece {
    /// Returns the point (x, r) at a fraction of the piece: 0 its start, 1 its end.
    #[must_use]
    pub fn at(&self, fraction: f64) -> [f64; 2] {
        match self {
            Piece::Chebyshev { x, r } => {
                let u = 2.0 * fraction - 1.0;
                [x, r].map(|c| chebyshev([c], u)[0][0])
            }
            Piece::Power { x, r } => [x, r].map(|c| power([c], fraction)[0][0]),
        }
    }

    /// Appends the points after the first of a polyline that stays within `tolerance`, each with its fraction.
    pub(crate) fn draw(&self, tolerance: f64, points: &mut Vec<Drawn>) -> Result<(), RevolveError> {
        // As many intervals as the degree, so that no oscillation remains undetected between samples.
        let degree = self.coefficients().iter().fold(1, |m, c| c.len().max(m));
        let at = |k: usize| k as f64 / degree as f64;
        for k in 0..degree {
            let ends = [at(k), at(k + 1)];
            let places = ends.map(|fraction| self.at(fraction));
            flatten(&|f| Ok(self.at(f)), ends, places, tolerance, points)?;
        }
        Ok(())
    }

    pub(crate) fn coefficients(&self) -> [&[f64]; 2] {
        match self {
            Piece::Chebyshev { x, r } | Piece::Power { x, r } => [x, r],
        }
    }
}

impl Meridian {
    /// Creates a meridian from smooth pieces, base to apex, each starting at the end of the previous one.
    ///
    /// The curve is replaced by a polyline with vertices on it and a distance of at most `tolerance`. The number of segments scales
    /// as `tolerance`^(-1/2); chords and distances cost its logarithm. Gaps between pieces and negative radii up to `tolerance` are
    /// closed. Chords, measures, voxels and meshes are those of this polyline and agree with each other to rounding.
    ///
    /// Their errors against the smooth curve are larger than the tolerance e. The volume differs by at most e times the area (less where the
    /// curve is convex). A ray that meets the surface at the angle alpha to its normal has a chord wrong by up to 2 e / cos alpha. A chord at the
    /// distance d inside a silhouette of the radius of curvature R (along the ray) is 2 sqrt(2 R d), so rays within e of it have errors of
    /// up to 2 sqrt(2 R e): 0.13 cm for R = 2 cm and e = 1e-3 cm, 0.013 cm for 1e-5 cm. An error c of every chord needs e = c^2 / (8 R).
    ///
    /// ```
    /// use revolve_voxel::{Meridian, Piece};
    /// // x = 1 + u, r = 1 - u^2: a spindle, volume 16 pi / 15.
    /// let piece = Piece::Chebyshev { x: vec![1.0, 1.0], r: vec![0.5, 0.0, -0.5] };
    /// let spindle = Meridian::smooth(&[piece], 1e-8)?;
    /// assert!((spindle.mass_properties().volume - 16.0 * std::f64::consts::PI / 15.0).abs() < 1e-7);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for a coefficient, [`RevolveError::NotPositive`] for the tolerance, [`RevolveError::Gap`]
    /// between pieces, [`RevolveError::TooFine`] above ten million segments, and errors of [`Meridian::new`].
    pub fn smooth(pieces: &[Piece], tolerance: f64) -> Result<Self, RevolveError> {
        positive("tolerance", tolerance)?;
        let mut points: Vec<[f64; 2]> = Vec::new();
        for (index, piece) in pieces.iter().enumerate() {
            for c in piece.coefficients().into_iter().flatten() {
                finite("coefficient", *c)?;
            }
            let start = piece.at(0.0);
            match points.last() {
                None => points.push(start),
                Some(end) => {
                    let gap = (start[0] - end[0]).hypot(start[1] - end[1]);
                    if gap > tolerance {
                        return Err(RevolveError::Gap {
                            piece: index,
                            gap,
                            tolerance,
                        });
                    }
                }
            }
            let mut rest = Vec::new();
            piece.draw(tolerance, &mut rest)?;
            points.extend(rest.into_iter().map(|(_, point)| point));
        }
        Self::within(points, tolerance)
    }

    /// Creates a meridian from a function of a parameter s from 0 (base) to 1 (apex), with values (x, r). Points on a straight line are merged.
    ///
    /// `breakpoints` are the s inside (0, 1) at which the curve has a corner or a jump; a jump is connected by a straight segment. As for
    /// [`smooth`](Self::smooth), the curve is replaced by a polyline with vertices on it. The curve is sampled at least 256 times between
    /// breakpoints; oscillations between these samples remain undetected. The errors of chords near a silhouette, up to 2 sqrt(2 R tolerance), and
    /// of volumes are those of [`smooth`](Self::smooth).
    ///
    /// ```
    /// use revolve_voxel::Meridian;
    /// use std::f64::consts::PI;
    /// // A prolate spheroid with the half axes 3 and 2.
    /// let spheroid = Meridian::from_function(|s| [3.0 * -(PI * s).cos(), 2.0 * (PI * s).sin()], &[], 1e-8)?;
    /// assert!((spheroid.mass_properties().volume - 16.0 * PI).abs() < 1e-5);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`] for the tolerance and for breakpoints that are not strictly ascending inside (0, 1),
    /// [`RevolveError::NotFinite`] for either, [`RevolveError::NotFiniteAt`] for a value of the function, [`RevolveError::TooFine`] above ten million segments, and errors of
    /// [`Meridian::new`].
    #[doc(alias("parametric", "generatrix"))]
    pub fn from_function(
        curve: impl Fn(f64) -> [f64; 2],
        breakpoints: &[f64],
        tolerance: f64,
    ) -> Result<Self, RevolveError> {
        positive("tolerance", tolerance)?;
        let at = |s: f64| match curve(s) {
            [x, r] if x.is_finite() && r.is_finite() => Ok([x, r]),
            [x, r] => Err(RevolveError::NotFiniteAt { s, x, r }),
        };
        let mut points = vec![(0.0, at(0.0)?)];
        for pair in [&[0.0], breakpoints, &[1.0]].concat().windows(2) {
            let step = positive("interval between breakpoints", pair[1] - pair[0])? / 64.0;
            for k in 1..=64 {
                let (from, start) = points[points.len() - 1];
                let to = if k < 64 {
                    pair[0] + f64::from(k) * step
                } else {
                    pair[1]
                };
                flatten(&at, [from, to], [start, at(to)?], tolerance, &mut points)?;
            }
        }
        let size = points.iter().flat_map(|(_, p)| p);
        let near = 8.0 * f64::EPSILON * size.fold(0.0, |m: f64, v| m.max(v.abs()));
        let mut path: Vec<[f64; 2]> = Vec::new();
        for (_, p) in points {
            if let [.., a, b] = path[..]
                && between(a, b, p, near)
            {
                path.pop();
            }
            path.push(p);
        }
        Self::within(path, tolerance)
    }

    /// Creates a meridian from points with an error of at most `tolerance`.
    fn within(mut points: Vec<[f64; 2]>, tolerance: f64) -> Result<Self, RevolveError> {
        for p in &mut points {
            if p[1].abs() <= tolerance {
                p[1] = p[1].max(0.0);
            }
        }
        // An end within the tolerance of the axis is on it.
        let n = points.len();
        for k in [0, n.saturating_sub(1)] {
            if let Some(p) = points.get_mut(k)
                && p[1] <= tolerance
                && p[1] >= 0.0
            {
                p[1] = 0.0;
            }
        }
        Meridian::new(&points)
    }
}

/// Whether b is on the straight line from a to c.
fn between(a: [f64; 2], b: [f64; 2], c: [f64; 2], near: f64) -> bool {
    let [[x, r], [u, v]] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1]]);
    (x * v - r * u).abs() <= near * u.hypot(v) && x * (u - x) + r * (v - r) > 0.0
}

/// Limit of memory.
const MOST_SEGMENTS: usize = 10_000_000;

/// A point of the polyline: its parameter and position.
pub(crate) type Drawn = (f64, [f64; 2]);

/// Appends points after the first so that the curve stays within `tolerance` of the chords.
pub(crate) fn flatten(
    curve: &impl Fn(f64) -> Result<[f64; 2], RevolveError>,
    u: [f64; 2],
    ends: [[f64; 2]; 2],
    tolerance: f64,
    points: &mut Vec<Drawn>,
) -> Result<(), RevolveError> {
    let (dx, dr) = (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
    let length = dx.hypot(dr);
    let off = |p: [f64; 2]| {
        let (px, pr) = (p[0] - ends[0][0], p[1] - ends[0][1]);
        if length > 0.0 {
            (px * dr - pr * dx).abs() / length
        } else {
            px.hypot(pr)
        }
    };
    let at = |f: f64| curve(u[0] + f * (u[1] - u[0]));
    let [before, middle, after] = [at(0.25)?, at(0.5)?, at(0.75)?];
    // 0.9: the largest deviation need not be at one of the three points.
    let flat = [before, middle, after]
        .into_iter()
        .all(|p| off(p) <= 0.9 * tolerance);
    if flat || u[1] - u[0] < 1e-12 {
        if points.len() >= MOST_SEGMENTS {
            return Err(RevolveError::TooFine {
                tolerance,
                most: MOST_SEGMENTS,
            });
        }
        points.push((u[1], ends[1]));
        return Ok(());
    }
    let m = 0.5 * (u[0] + u[1]);
    flatten(curve, [u[0], m], [ends[0], middle], tolerance, points)?;
    flatten(curve, [m, u[1]], [middle, ends[1]], tolerance, points)
}
