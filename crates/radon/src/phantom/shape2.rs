//! Plane shapes whose line integrals and pixel averages are known exactly.

use super::round::{Vec2, Vec3};
use super::{gaussian, polygon, round};
use super::{place, size};
use crate::error::{RadonError, within};
use std::f64::consts::{PI, TAU};

/// A plane shape of height 1: a filled ellipse, rectangle or polygon, or a Gaussian hill.
///
/// Lengths in cm, angles in radians counter-clockwise from x. A line along an edge of a polygon gets the mean of the limits from both
/// sides. Sizes between 1e-50 and 1e50, positions up to 1e50: beyond, areas and squares overflow.
///
/// ```
/// use radon::Shape2;
/// let disc = Shape2::ellipse([1.0, 2.0], [3.0, 3.0], 0.0)?;
/// assert_eq!(disc.line_integral(0.0, 1.0), 6.0); // the line x = 1 passes through the centre
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Shape2 {
    centre: Vec2,
    /// Every point with weight above 1e-17 is this close to the centre.
    reach: f64,
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// Rows of the map from the plane to the frame in which the ellipse is the unit disc.
    Ellipse([Vec2; 2]),
    /// Rows of the map to the frame in which the hill is exp(-|q|²/2).
    Gaussian([Vec2; 2]),
    /// Counter-clockwise corners.
    Polygon(Vec<Vec2>),
}

impl Shape2 {
    /// The ellipse with semi-axis `semi_axes[0]` rotated by `angle` from x, and `semi_axes[1]` perpendicular to it.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for a semi-axis, [`RadonError::OutOfRange`] beyond 1e-50 and 1e50
    /// and for an angle beyond 2 pi, such as most in degrees.
    pub fn ellipse(centre: [f64; 2], semi_axes: [f64; 2], angle: f64) -> Result<Self, RadonError> {
        let rows = frame(centre, semi_axes, angle, "ellipse semi-axis")?;
        Ok(Self {
            centre,
            reach: semi_axes[0].max(semi_axes[1]),
            kind: Kind::Ellipse(rows),
        })
    }

    /// The Gaussian hill exp(-u²/2σ₀² - v²/2σ₁²), u rotated by `angle` from x; peak 1.
    ///
    /// # Errors
    /// As [`ellipse`](Self::ellipse), for a standard deviation.
    pub fn gaussian(centre: [f64; 2], sigmas: [f64; 2], angle: f64) -> Result<Self, RadonError> {
        let rows = frame(centre, sigmas, angle, "Gaussian standard deviation")?;
        Ok(Self {
            centre,
            reach: gaussian::REACH * sigmas[0].max(sigmas[1]),
            kind: Kind::Gaussian(rows),
        })
    }

    /// The rectangle of the given full sides, rotated by `angle`.
    ///
    /// # Errors
    /// As [`ellipse`](Self::ellipse), for a side; as [`polygon`](Self::polygon) where rounding leaves no area.
    pub fn rectangle(centre: [f64; 2], sides: [f64; 2], angle: f64) -> Result<Self, RadonError> {
        frame(centre, sides, angle, "rectangle side")?;
        let (sin, cos) = angle.sin_cos();
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(a, b)| {
            let (u, v) = (a * sides[0], b * sides[1]);
            [centre[0] + u * cos - v * sin, centre[1] + u * sin + v * cos]
        });
        Self::polygon(corners.to_vec())
    }

    /// The simple polygon with the given corners, in either sense; it need not be convex.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::OutOfRange`] for a corner, [`RadonError::DegeneratePolygon`] for fewer than three corners,
    /// no area, or edges that cross. Cost of the check: the square of the number of corners.
    pub fn polygon(mut corners: Vec<[f64; 2]>) -> Result<Self, RadonError> {
        for &x in corners.iter().flatten() {
            place("polygon corner", x)?;
        }
        let degenerate = |area| RadonError::DegeneratePolygon {
            corners: corners.len(),
            area,
        };
        if corners.len() < 3 {
            return Err(degenerate(0.0));
        }
        let area = polygon::area(&corners);
        if area == 0.0 || !area.is_finite() || polygon::crosses_itself(&corners) {
            return Err(degenerate(area));
        }
        if area < 0.0 {
            corners.reverse();
        }
        let centre = [0, 1].map(|k| {
            let along = || corners.iter().map(|p| p[k]);
            let (low, high) = (along().reduce(f64::min), along().reduce(f64::max));
            0.5 * (low.unwrap_or(0.0) + high.unwrap_or(0.0))
        });
        let reach = corners
            .iter()
            .map(|p| (p[0] - centre[0]).hypot(p[1] - centre[1]))
            .fold(0.0, f64::max);
        Ok(Self {
            centre,
            reach,
            kind: Kind::Polygon(corners),
        })
    }

    /// Value at a point: 1 inside, 0 outside, or the height of the hill.
    #[must_use]
    pub fn value(&self, [x, y]: [f64; 2]) -> f64 {
        match &self.kind {
            Kind::Ellipse(rows) => {
                let [u, v] = self.to_frame(rows, [x, y]);
                f64::from(u8::from(u * u + v * v <= 1.0))
            }
            Kind::Gaussian(rows) => gaussian::mean(flat(self.to_frame(rows, [x, y])), &[]),
            Kind::Polygon(corners) => {
                // The chord of the part above the point, by parity of the crossings of the upward ray.
                let mut inside = false;
                for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                    if (p[0] <= x) != (q[0] <= x)
                        && y < p[1] + (q[1] - p[1]) * ((x - p[0]) / (q[0] - p[0]))
                    {
                        inside = !inside;
                    }
                }
                f64::from(u8::from(inside))
            }
        }
    }

    /// Integral over the plane (cm²).
    #[must_use]
    pub fn integral(&self) -> f64 {
        match &self.kind {
            Kind::Ellipse(rows) => PI / det(rows),
            Kind::Gaussian(rows) => 2.0 * PI / det(rows),
            Kind::Polygon(corners) => polygon::area(corners),
        }
    }

    /// Integral along the line x cos θ + y sin θ = s (cm): the Radon transform at (θ, s).
    #[must_use]
    pub fn line_integral(&self, theta: f64, s: f64) -> f64 {
        match &self.kind {
            Kind::Ellipse(rows) => {
                let (width, t) = self.support(rows, theta, s);
                2.0 / (width * det(rows)) * (1.0 - t * t).max(0.0).sqrt()
            }
            Kind::Gaussian(rows) => {
                let (width, t) = self.support(rows, theta, s);
                (2.0 * PI).sqrt() / (width * det(rows)) * (-0.5 * t * t).exp()
            }
            Kind::Polygon(corners) => polygon::chord(&polygon::turned(corners, theta), s),
        }
    }

    /// Mean of [`line_integral`](Self::line_integral) over the bin of width `width` about `s`, in closed form; over a bin narrower than
    /// rounding, the line integral at `s`.
    #[must_use]
    pub fn bin_mean(&self, theta: f64, s: f64, width: f64) -> f64 {
        let (low, high) = (s - 0.5 * width, s + 0.5 * width);
        match &self.kind {
            Kind::Ellipse(rows) => {
                let (half_width, t0) = self.support(rows, theta, low);
                let t1 = self.support(rows, theta, high).1;
                if t0 == t1 {
                    return self.line_integral(theta, s);
                }
                // The strip of the unit disc between the angles asin(t) of both sides, by the chord between their ends on the circle.
                let [a, b] = [t0, t1].map(|t| t.clamp(-1.0, 1.0));
                let [u, v] = [a, b].map(|t| (1.0 - t * t).sqrt());
                let lean = if u + v > 0.0 { (a + b) / (u + v) } else { 0.0 };
                let phi = 2.0
                    * (0.5 * (b - a) * 1.0_f64.hypot(lean))
                        .clamp(-1.0, 1.0)
                        .asin();
                let mean = (phi + (u * v - a * b) * phi.sin()) / (det(rows) * (t1 - t0));
                (mean / half_width).clamp(0.0, f64::MAX)
            }
            Kind::Gaussian(rows) => {
                let (half_width, t) = self.support(rows, theta, s);
                let half = [0.5 * width / half_width, 0.0, 0.0];
                (2.0 * PI).sqrt() / (half_width * det(rows))
                    * gaussian::mean([t, 0.0, 0.0], &[half])
            }
            Kind::Polygon(corners) if low == high => {
                polygon::chord(&polygon::turned(corners, theta), s)
            }
            Kind::Polygon(corners) => {
                let everything = [f64::NEG_INFINITY, f64::INFINITY];
                polygon::area_in(&polygon::turned(corners, theta), [low, high], everything) / width
            }
        }
    }

    /// Mean over the axis-parallel rectangle with centre `centre` and full sides `sides`: exact for ellipses and polygons; Gaussians to
    /// 1e-15 of the peak. The rounding error at the outline of an ellipse is below 1e-14 times the ratio of its area to that of the
    /// rectangle. A rectangle without area has the value at its centre, one whose area overflows 0. NaN if an argument is NaN.
    #[must_use]
    pub fn rectangle_mean(&self, centre: [f64; 2], sides: [f64; 2]) -> f64 {
        let [hx, hy] = sides.map(|s| 0.5 * s.abs());
        if [centre, sides].as_flattened().iter().any(|v| v.is_nan()) {
            return f64::NAN;
        }
        let distance = (centre[0] - self.centre[0]).hypot(centre[1] - self.centre[1]);
        if distance > self.reach + hx.hypot(hy) {
            return 0.0;
        }
        // Half sides in the frame of the shape.
        let halves = |m: &[Vec2; 2]| [(0, hx), (1, hy)].map(|(k, h)| [m[0][k] * h, m[1][k] * h]);
        match &self.kind {
            Kind::Ellipse(rows) => {
                let c = self.to_frame(rows, centre);
                let [ex, ey] = halves(rows);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                    .map(|(a, b)| [c[0] + a * ex[0] + b * ey[0], c[1] + a * ex[1] + b * ey[1]]);
                let norms = corners.map(|p| p[0] * p[0] + p[1] * p[1]);
                if norms.iter().all(|&n| n <= 1.0) {
                    return 1.0;
                }
                if norms.contains(&f64::INFINITY) {
                    return 0.0;
                }
                let area = 4.0 * (ex[0] * ey[1] - ex[1] * ey[0]).abs();
                if area == 0.0 {
                    return self.value(centre);
                }
                (round::disc_in_polygon(&corners).abs() / area).clamp(0.0, 1.0)
            }
            Kind::Gaussian(rows) => {
                gaussian::mean(flat(self.to_frame(rows, centre)), &halves(rows).map(flat))
            }
            Kind::Polygon(corners) => {
                let [x, y] = [(centre[0], hx), (centre[1], hy)].map(|(c, h)| [c - h, c + h]);
                let area = 4.0 * hx * hy;
                if area == 0.0 {
                    return self.value(centre);
                }
                (polygon::area_in(corners, x, y) / area).clamp(0.0, 1.0)
            }
        }
    }

    /// Centre and radius of a circle outside which the shape is zero (below 1e-17 for a Gaussian).
    pub(super) fn bounding_circle(&self) -> ([f64; 2], f64) {
        (self.centre, self.reach)
    }

    fn to_frame(&self, rows: &[Vec2; 2], [x, y]: Vec2) -> Vec2 {
        let d = [x - self.centre[0], y - self.centre[1]];
        rows.map(|r| r[0] * d[0] + r[1] * d[1])
    }

    /// Half width of the ellipse's support on the detector, and `s` in units of it from the support's centre.
    fn support(&self, rows: &[Vec2; 2], theta: f64, s: f64) -> (f64, f64) {
        let (sin, cos) = theta.sin_cos();
        // Support function of the unit disc's image: |M⁻ᵀ n|, and M⁻ᵀ = cofactors / det.
        let m = rows;
        let w = [m[1][1] * cos - m[1][0] * sin, m[0][0] * sin - m[0][1] * cos];
        let width = w[0].hypot(w[1]) / det(rows);
        (
            width,
            (s - self.centre[0] * cos - self.centre[1] * sin) / width,
        )
    }
}

fn det(rows: &[Vec2; 2]) -> f64 {
    (rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]).abs()
}

fn flat([x, y]: Vec2) -> Vec3 {
    [x, y, 0.0]
}

/// Rows of the map that rotates by -angle and divides by the lengths.
fn frame(
    centre: Vec2,
    lengths: Vec2,
    angle: f64,
    what: &'static str,
) -> Result<[Vec2; 2], RadonError> {
    for x in centre {
        place("shape position", x)?;
    }
    within("shape angle in radians", angle, -TAU, TAU)?;
    for l in lengths {
        size(what, l)?;
    }
    let (sin, cos) = angle.sin_cos();
    Ok([
        [cos / lengths[0], sin / lengths[0]],
        [-sin / lengths[1], cos / lengths[1]],
    ])
}
