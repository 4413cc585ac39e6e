//! Solid shapes whose line integrals and voxel averages are known exactly.

use super::round::{Vec3, add, cross, dot, norm};
use super::shape2::Shape2;
use super::{gaussian, place, round, size};
use crate::error::{RadonError, positive};
use std::f64::consts::PI;

/// A solid shape of height 1: an ellipsoid, a Gaussian hill, or an upright prism on any [`Shape2`].
///
/// Rays lie in planes of constant z, as in parallel-beam tomography about z. Lengths in cm; sizes between 1e-50 and 1e50, positions up to
/// 1e50: beyond, volumes and squares overflow.
///
/// ```
/// use radon::Shape3;
/// let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let ball = Shape3::ellipsoid([0.0, 0.0, 3.0], [2.0; 3], upright)?;
/// assert!((ball.line_integral(0.7, 0.0, 3.0) - 4.0).abs() < 1e-14); // through the centre
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Shape3 {
    centre: Vec3,
    /// Every point with weight above 1e-17 is this close to the centre.
    reach: f64,
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// Rows of the map to the frame in which the ellipsoid is the unit ball.
    Ellipsoid([Vec3; 3]),
    /// Rows of the map to the frame in which the hill is exp(-|q|²/2).
    Gaussian([Vec3; 3]),
    /// A plane shape between two heights.
    Prism(Shape2, [f64; 2]),
}

impl Shape3 {
    /// The ellipsoid with semi-axis `semi_axes[k]` along the unit vector `axes[k]`.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for a semi-axis, [`RadonError::OutOfRange`] beyond 1e-50 and 1e50,
    /// [`RadonError::NotOrthonormal`] when the axes are not perpendicular unit vectors to 1e-9.
    pub fn ellipsoid(
        centre: [f64; 3],
        semi_axes: [f64; 3],
        axes: [[f64; 3]; 3],
    ) -> Result<Self, RadonError> {
        let rows = frame(centre, semi_axes, axes, "ellipsoid semi-axis")?;
        Ok(Self {
            centre,
            reach: semi_axes.into_iter().fold(0.0, f64::max),
            kind: Kind::Ellipsoid(rows),
        })
    }

    /// The Gaussian hill exp(-Σ u_k²/2σ_k²), u_k along the unit vector `axes[k]`; peak 1.
    ///
    /// # Errors
    /// As [`ellipsoid`](Self::ellipsoid).
    pub fn gaussian(
        centre: [f64; 3],
        sigmas: [f64; 3],
        axes: [[f64; 3]; 3],
    ) -> Result<Self, RadonError> {
        let rows = frame(centre, sigmas, axes, "Gaussian standard deviation")?;
        let reach = gaussian::REACH * sigmas.into_iter().fold(0.0, f64::max);
        Ok(Self {
            centre,
            reach,
            kind: Kind::Gaussian(rows),
        })
    }

    /// The upright prism on `section` between the heights `z[0]` < `z[1]`: boxes, elliptical cylinders, polygonal prisms.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::OutOfRange`]; [`RadonError::NotPositive`] when the height is not positive.
    pub fn prism(section: Shape2, z: [f64; 2]) -> Result<Self, RadonError> {
        place("prism height", z[0])?;
        place("prism height", z[1])?;
        positive("prism height", z[1] - z[0])?;
        let ([x, y], radius) = section.bounding_circle();
        Ok(Self {
            centre: [x, y, 0.5 * (z[0] + z[1])],
            reach: radius.hypot(0.5 * (z[1] - z[0])),
            kind: Kind::Prism(section, z),
        })
    }

    /// Value at a point: 1 inside, 0 outside, or the height of the hill.
    #[must_use]
    pub fn value(&self, p: [f64; 3]) -> f64 {
        match &self.kind {
            Kind::Ellipsoid(rows) => {
                let q = self.to_frame(rows, p);
                f64::from(u8::from(dot(q, q) <= 1.0))
            }
            Kind::Gaussian(rows) => gaussian::mean(self.to_frame(rows, p), &[]),
            Kind::Prism(section, z) => section.value([p[0], p[1]]) * share(*z, p[2], 0.0),
        }
    }

    /// Integral over space (cm³).
    #[must_use]
    pub fn integral(&self) -> f64 {
        match &self.kind {
            Kind::Ellipsoid(rows) => 4.0 * PI / 3.0 / det(rows),
            Kind::Gaussian(rows) => (2.0 * PI).powf(1.5) / det(rows),
            Kind::Prism(section, z) => section.integral() * (z[1] - z[0]),
        }
    }

    /// Integral (cm) along the ray x cos θ + y sin θ = s at height `z`.
    #[must_use]
    pub fn line_integral(&self, theta: f64, s: f64, z: f64) -> f64 {
        match &self.kind {
            Kind::Ellipsoid(rows) => {
                let ray = Ray::new(self, rows, theta, s, z);
                2.0 * (1.0 - dot(ray.start, ray.start)).max(0.0).sqrt() / ray.speed
            }
            Kind::Gaussian(rows) => {
                let ray = Ray::new(self, rows, theta, s, z);
                (2.0 * PI).sqrt() / ray.speed * gaussian::mean(ray.start, &[])
            }
            Kind::Prism(section, heights) => {
                share(*heights, z, 0.0) * section.line_integral(theta, s)
            }
        }
    }

    /// Mean of [`line_integral`](Self::line_integral) over the detector cell of size `size` = (along s, along z) about (`s`, `z`): exact
    /// for ellipsoids and prisms; Gaussians to 1e-15 of the peak. The rounding error of an ellipsoid is below 1e-15 of its longest line integral
    /// times the ratio of the area of its projection to that of the cell. A cell whose area underflows has the line integral at its centre, one
    /// whose area overflows 0.
    #[must_use]
    pub fn bin_mean(&self, theta: f64, [s, z]: [f64; 2], size: [f64; 2]) -> f64 {
        match &self.kind {
            Kind::Ellipsoid(rows) => {
                let ray = Ray::new(self, rows, theta, s, z);
                let (a, b) = (
                    ray.across.map(|x| 0.5 * size[0] * x),
                    ray.up.map(|x| 0.5 * size[1] * x),
                );
                if norm(a) == f64::INFINITY || norm(b) == f64::INFINITY {
                    return 0.0;
                }
                // A plane frame perpendicular to the ray, in which the ball's projection is the unit disc.
                let first = a.map(|x| x / norm(a));
                let mut second = add(b, -dot(b, first), first);
                let height = norm(second);
                second = second.map(|x| x / height);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(i, j)| {
                    let p = add(add(ray.start, i, a), j, b);
                    [dot(p, first), dot(p, second)]
                });
                let area = 4.0 * norm(a) * height;
                if area.is_nan() || area == 0.0 {
                    return self.line_integral(theta, s, z);
                }
                2.0 / ray.speed * (round::hemisphere_over_polygon(&corners) / area).clamp(0.0, 1.0)
            }
            Kind::Gaussian(rows) => {
                let ray = Ray::new(self, rows, theta, s, z);
                let edges = [
                    ray.across.map(|x| 0.5 * size[0] * x),
                    ray.up.map(|x| 0.5 * size[1] * x),
                ];
                (2.0 * PI).sqrt() / ray.speed * gaussian::mean(ray.start, &edges)
            }
            Kind::Prism(section, heights) => match share(*heights, z, size[1]) {
                0.0 => 0.0,
                part => part * section.bin_mean(theta, s, size[0]),
            },
        }
    }

    /// Mean over the axis-parallel box with centre `centre` and full sides `sides`: exact for ellipsoids and prisms; Gaussians to 1e-15 of
    /// the peak. The rounding error of a box that the surface of an ellipsoid cuts is below 1e-15 times the ratio of the volume of the ellipsoid
    /// to that of the box: 5e-6 for a sphere and voxels of a thousandth of its radius. A box whose volume underflows has the value at its
    /// centre, one whose volume overflows 0.
    #[must_use]
    pub fn box_mean(&self, centre: [f64; 3], sides: [f64; 3]) -> f64 {
        match &self.kind {
            Kind::Ellipsoid(rows) => {
                let c = self.to_frame(rows, centre);
                let e = half_edges(rows, sides);
                // Farthest corner from the cell's centre: the longest of the four diagonals.
                let radius = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                    .map(|(i, j)| norm(add(add(e[0], i, e[1]), j, e[2])))
                    .into_iter()
                    .fold(0.0, f64::max);
                let distance = norm(c);
                if distance >= 1.0 + radius || radius == f64::INFINITY {
                    0.0
                } else if distance + radius <= 1.0 {
                    1.0
                } else {
                    let cell = 8.0 * dot(cross(e[0], e[1]), e[2]).abs();
                    if cell == 0.0 || e.iter().any(|&e| dot(e, e) == 0.0) {
                        return self.value(centre);
                    }
                    (round::ball_in_parallelepiped(c, e) / cell).clamp(0.0, 1.0)
                }
            }
            Kind::Gaussian(rows) => {
                gaussian::mean(self.to_frame(rows, centre), &half_edges(rows, sides))
            }
            Kind::Prism(section, z) => match share(*z, centre[2], sides[2]) {
                0.0 => 0.0,
                part => part * section.rectangle_mean([centre[0], centre[1]], [sides[0], sides[1]]),
            },
        }
    }

    /// Centre and radius of a ball outside which the shape is zero (below 1e-17 for a Gaussian).
    #[must_use]
    pub fn bounding_ball(&self) -> ([f64; 3], f64) {
        (self.centre, self.reach)
    }

    fn to_frame(&self, rows: &[Vec3; 3], p: Vec3) -> Vec3 {
        let d = add(p, -1.0, self.centre);
        rows.map(|r| dot(r, d))
    }
}

/// A ray in the frame of a round shape.
struct Ray {
    /// The ray's point nearest to the centre.
    start: Vec3,
    /// Frame length per centimetre along the ray.
    speed: f64,
    /// Change of `start` per centimetre of s and of z.
    across: Vec3,
    up: Vec3,
}

impl Ray {
    fn new(shape: &Shape3, rows: &[Vec3; 3], theta: f64, s: f64, z: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        let along = rows.map(|r| r[1] * cos - r[0] * sin);
        let speed = norm(along);
        let unit = along.map(|x| x / speed);
        let perpendicular = |v: Vec3| add(v, -dot(v, unit), unit);
        Self {
            start: perpendicular(shape.to_frame(rows, [s * cos, s * sin, z])),
            speed,
            across: perpendicular(rows.map(|r| r[0] * cos + r[1] * sin)),
            up: perpendicular(rows.map(|r| r[2])),
        }
    }
}

fn half_edges(rows: &[Vec3; 3], sides: Vec3) -> [Vec3; 3] {
    [0, 1, 2].map(|k| rows.map(|r| 0.5 * sides[k] * r[k]))
}

fn det(rows: &[Vec3; 3]) -> f64 {
    dot(rows[0], cross(rows[1], rows[2])).abs()
}

/// Fraction of the cell of height `size` about `z` between two heights; a cell of zero height on a face counts half.
fn share([low, high]: [f64; 2], z: f64, size: f64) -> f64 {
    if size > 0.0 {
        ((z + 0.5 * size).min(high) - (z - 0.5 * size).max(low)).max(0.0) / size
    } else {
        0.5 * (f64::from(u8::from(low < z && z <= high))
            + f64::from(u8::from(low <= z && z < high)))
    }
}

fn frame(
    centre: Vec3,
    lengths: Vec3,
    axes: [Vec3; 3],
    what: &'static str,
) -> Result<[Vec3; 3], RadonError> {
    for x in centre.into_iter().chain(axes.into_iter().flatten()) {
        place("shape position or axis", x)?;
    }
    for l in lengths {
        size(what, l)?;
    }
    let mut deviation: f64 = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            deviation = deviation.max((dot(axes[i], axes[j]) - f64::from(u8::from(i == j))).abs());
        }
    }
    if deviation > 1e-9 {
        return Err(RadonError::NotOrthonormal { deviation });
    }
    Ok([0, 1, 2].map(|k| axes[k].map(|x| x / lengths[k])))
}
