//! The wall between two meridians with a common parameter, with layers of equal volume fractions.
//!
//! Straight lines `P(s, t) = (1 - t) A(s) + t B(s)` connect points of equal parameter s on the inner curve A and the outer curve B.
//! The volume element about the axis is
//!
//! ```text
//! dV = 2 pi r J ds dt,    r = (1 - t) r_A + t r_B,    J = P_s x P_t = (1 - t) A' x D + t B' x D,    D = B - A
//! ```
//!
//! with both factors linear in t. The fraction of an element ds below t is therefore a cubic in t, and the layer u is where this
//! fraction is u: the volume between layers u0 and u1 is the fraction u1 - u0 of every element and of the wall, for any curves.

use crate::error::{finite, positive};
use crate::solid::curve::Curve;
use crate::voxels::disc::cross;
use crate::wall::cells::{Cells, Line};
use crate::wall::isoline::{Isolines, ON_AXIS, below, mix};
use crate::wall::shares::Shares;
use crate::{Meridian, RevolveError};

/// Smallest number of lines for the search of a point.
const LINES: usize = 128;

/// Derivatives at an end on the axis are evaluated at this fraction of the parameter range before it, with an error of its square.
const OFF_AXIS: f64 = 1e-6;

/// The wall between two meridians in the half-plane (x, r), with material coordinates: the layer u, 0 on the inner and 1 on the
/// outer meridian, and the parameter s of the meridians.
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
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    pub(super) isolines: Isolines,
    /// Knots of both curves, and the ends of the range.
    knots: Vec<f64>,
    shares: Shares,
    /// Lines at all knots and between them, so close that the curves are nearly straight between two.
    pub(super) lines: Vec<Line>,
    pub(super) cells: Cells,
}

impl Shell {
    /// Creates the wall between `inner` and `outer` for s in `range`, in the direction in which the solid is on the right (base to
    /// apex).
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] or [`RevolveError::NotPositive`] for the range, [`RevolveError::Folded`] if lines between the
    /// curves cross in the wall or a radius is negative, so that s and u are not coordinates.
    pub fn new(inner: Curve, outer: Curve, range: [f64; 2]) -> Result<Self, RevolveError> {
        let [first, last] = range;
        finite("start of the parameter", first)?;
        positive("length of the parameter's range", last - first)?;
        let mut knots: Vec<f64> = [inner.knots(), outer.knots()].concat();
        // Merges knots that differ by rounding.
        let near = 1e-12 * (last - first);
        knots.retain(|&s| s > first + near && s < last - near);
        knots.extend(range);
        knots.sort_by(f64::total_cmp);
        knots.dedup_by(|b, a| *b - *a < near);
        let per_interval = LINES.div_ceil(knots.len() - 1);
        let mut places: Vec<f64> = Vec::new();
        for pair in knots.windows(2) {
            let at = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / per_interval as f64;
            places.extend((0..per_interval).map(at));
        }
        places.push(last);
        // The volume per unit of s is a polynomial of degree 3 p - 1 in s.
        let n = 3 * inner.degree().max(outer.degree()).max(1);
        let isolines = Isolines::new(inner, outer, range, &places);
        // J has the dimension of a squared length.
        let least = -1e-12 * isolines.size;
        let mut lines = Vec::with_capacity(places.len());
        for s in places {
            let isoline = isolines.at(s);
            for k in 0..2 {
                let (r, jacobian) = (isoline.r[k], isoline.jacobian[k]);
                if r.is_nan() || jacobian.is_nan() || r < least || jacobian < least * isolines.size
                {
                    return Err(RevolveError::Folded { s, r, jacobian });
                }
            }
            lines.push(Line {
                s,
                start: isoline.inner.position,
                along: isoline.line,
            });
        }
        let shares = Shares::new(&knots, n, isolines.on_axis, |s| isolines.at(s).volume());
        positive("volume of the wall", shares.volume())?;
        Ok(Self {
            cells: Cells::new(&isolines, &lines),
            isolines,
            knots,
            shares,
            lines,
        })
    }

    /// Returns the volume of the wall, cm^3, exact for the polynomials of the curves.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.shares.volume()
    }

    /// Returns the volume per unit of s, `dV/ds`.
    #[must_use]
    pub fn volume_rate(&self, s: f64) -> f64 {
        self.isolines.at(self.clamped(s)).volume()
    }

    /// Returns the point (x, r) on the layer at s, both clamped to their ranges.
    #[must_use]
    pub fn point(&self, layer: f64, s: f64) -> [f64; 2] {
        let isoline = self.isolines.at(self.clamped(s));
        isoline.point(isoline.height(layer.clamp(0.0, 1.0)))
    }

    /// Returns the derivatives of the point (x, r) with respect to the layer at fixed s, and to s along the layer.
    ///
    /// At an end on the axis, where the first is a limit, both are evaluated 1e-6 of the parameter range before it.
    #[must_use]
    pub fn tangents(&self, layer: f64, s: f64) -> [[f64; 2]; 2] {
        let isoline = self.isolines.at(self.off_axis(s));
        let t = isoline.height(layer.clamp(0.0, 1.0));
        let (d, e) = (
            isoline.line,
            [0, 1].map(|k| isoline.outer.first[k] - isoline.inner.first[k]),
        );
        // The fraction below t is g(t) / g(1), constant along the layer.
        let rate = isoline.r_rate();
        let jacobian_rate =
            [&isoline.inner, &isoline.outer].map(|c| cross(c.second, d) + cross(c.first, e));
        let change = |t: f64| below(rate, isoline.jacobian, t) + below(isoline.r, jacobian_rate, t);
        let whole = below(isoline.r, isoline.jacobian, 1.0);
        let slope = mix(isoline.r, t) * mix(isoline.jacobian, t);
        let by_layer = whole / slope;
        let by_s =
            (below(isoline.r, isoline.jacobian, t) / whole * change(1.0) - change(t)) / slope;
        [
            d.map(|v| v * by_layer),
            [0, 1].map(|k| mix([isoline.inner.first[k], isoline.outer.first[k]], t) + d[k] * by_s),
        ]
    }

    /// Returns the s of another wall with the same fraction of volume before its line as before the line of `s` in this one.
    ///
    /// If both end on the axis, the distance from the end has full relative accuracy.
    #[must_use]
    pub fn corresponding(&self, s: f64, to: &Shell) -> f64 {
        if std::ptr::eq(self, to) {
            return self.clamped(s);
        }
        to.shares.place(self.shares.split(s))
    }

    /// Returns the solid between two layers and the lines of two s, as a meridian with layers accurate to `tolerance` (cm).
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`] for the tolerance or an empty range; errors of
    /// [`Meridian::ring`].
    pub fn region(
        &self,
        layers: [f64; 2],
        s: [f64; 2],
        tolerance: f64,
    ) -> Result<Meridian, RevolveError> {
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
            if p[1].abs() <= ON_AXIS * self.isolines.size {
                p[1] = 0.0;
            }
        }
        Meridian::ring(&outer)
    }

    /// Returns a layer from one s to another as a polyline within `tolerance`.
    fn arc(&self, layer: f64, s: [f64; 2], tolerance: f64) -> Result<Vec<[f64; 2]>, RevolveError> {
        let mut stops = vec![s[0]];
        // A knot that equals an end up to rounding is omitted.
        let near = 1e-12 * (self.isolines.range[1] - self.isolines.range[0]);
        let inside = |k: &&f64| **k > s[0] + near && **k < s[1] - near;
        stops.extend(self.knots.iter().filter(inside));
        stops.push(s[1]);
        let mut points = vec![(s[0], self.point(layer, s[0]))];
        let at = |s: f64| Ok(self.point(layer, s));
        for pair in stops.windows(2) {
            // Intervals short enough that no oscillation remains undetected.
            let Isolines { inner, outer, .. } = &self.isolines;
            let n = inner.degree().max(outer.degree()).max(1);
            for k in 0..n {
                let s = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / n as f64;
                let ends = [points[points.len() - 1].1, at(s(k + 1))?];
                crate::solid::pieces::flatten(&at, [s(k), s(k + 1)], ends, tolerance, &mut points)?;
            }
        }
        Ok(points.into_iter().map(|(_, point)| point).collect())
    }

    fn clamped(&self, s: f64) -> f64 {
        let [first, last] = self.isolines.range;
        s.clamp(first, last)
    }

    /// Returns `s`, moved away from an end on the axis.
    fn off_axis(&self, s: f64) -> f64 {
        let [first, last] = self.isolines.range;
        let by = OFF_AXIS * (last - first);
        let s = self.clamped(s);
        match self.isolines.on_axis {
            [true, _] if s < first + by => first + by,
            [_, true] if s > last - by => last - by,
            _ => s,
        }
    }
}
