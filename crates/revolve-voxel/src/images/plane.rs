//! The rays through all positions of a detector.

use nalgebra::{Point3, Vector3};

use crate::rays::lines::Kind;
use crate::{Lines, OrganShape, PointRaster, Pose, Ray, RevolveError};

/// The rays through all positions (u, v) of a detector, u along the bins and v along the rows in cm from its centre: parallel rays, or rays
/// from a point (cone beam), or rays from a line along the rows' direction (fan beam). All rays of one v lie in one plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RayPlane {
    /// Origin and direction of the ray (0, 0), with their changes per cm along u and v.
    origin: [Vector3<f64>; 3],
    direction: [Vector3<f64>; 3],
}

impl RayPlane {
    /// The rays between and around lines in a raster, whose bins and rows are `pitch` cm.
    ///
    /// # Errors
    /// [`RevolveError::NotRaster`] for a list of lines; [`RevolveError::NoDirection`] if the rays of a row lie in no plane, or all rays in one.
    pub(super) fn new(lines: &Lines, pitch: [f64; 2]) -> Result<Self, RevolveError> {
        let [bin, row] = lines.size().map(|n| 0.5 * (n as f64 - 1.0));
        let row = lines.first_row as f64 + row;
        let of = |raster: &PointRaster| {
            let middle = raster.first.coords + raster.bin_step * bin + raster.row_step * row;
            [
                middle,
                raster.bin_step / pitch[0],
                raster.row_step / pitch[1],
            ]
        };
        let still = Vector3::zeros();
        let (origin, direction) = match &lines.kind {
            Kind::Parallel(raster, direction) => (of(raster), [*direction, still, still]),
            Kind::Between([from, to]) => {
                let (from, to) = (of(from), of(to));
                (from, [0, 1, 2].map(|k| to[k] - from[k]))
            }
            Kind::Each(_) => return Err(RevolveError::NotRaster),
        };
        let [ahead, along, up] = [0, 1, 2].map(|k| match k {
            0 => direction[0],
            _ => origin[k] + direction[k],
        });
        let is_flat = ahead.cross(&along).dot(&up) == 0.0;
        // Rays whose origin and direction both change with u are in no plane.
        if is_flat || (origin[1] != still && direction[1] != still) {
            return Err(RevolveError::NoDirection);
        }
        Ok(Self { origin, direction })
    }

    /// Returns the rays at a height.
    pub(super) fn row(&self, v: f64) -> RayRow {
        RayRow {
            origin: Point3::from(self.origin[0] + self.origin[2] * v),
            along: self.origin[1],
            direction: self.direction[0] + self.direction[2] * v,
            turning: self.direction[1],
        }
    }

    /// Returns the height v of the row through a point.
    pub(super) fn height(&self) -> Quotient {
        let ([first, along, up], [ahead, turn, tilt]) = (self.origin, self.direction);
        let normal = ahead.cross(&(along + turn));
        match normal.dot(&tilt) {
            0.0 => Quotient::affine(normal / normal.dot(&up), first),
            // p = first + lambda (ahead + u turn + v tilt).
            tilted => {
                let depth = turn.cross(&tilt);
                Quotient::new([normal / tilted, depth / depth.dot(&ahead)], first)
            }
        }
    }
}

/// The rays at one height, in one plane: their origin or their direction changes with u.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayRow {
    origin: Point3<f64>,
    along: Vector3<f64>,
    direction: Vector3<f64>,
    turning: Vector3<f64>,
}

impl RayRow {
    /// Returns a ray.
    #[inline(always)]
    pub(super) fn ray(&self, u: f64) -> Ray {
        let direction = self.direction + self.turning * u;
        Ray::of_unit(self.origin + self.along * u, direction.normalize())
    }

    /// Returns normal and distance from the origin of the plane of the rays: `normal . p = distance`.
    pub(super) fn plane(&self) -> (Vector3<f64>, f64) {
        let normal = self
            .direction
            .cross(&(self.along + self.turning))
            .normalize();
        (normal, normal.dot(&self.origin.coords))
    }

    /// Returns the position u of the ray through a point of the plane.
    pub(super) fn position(&self) -> Quotient {
        let (normal, _) = self.plane();
        // Within the plane, perpendicular to the central ray.
        let over = normal.cross(&self.direction);
        let over = over / over.dot(&(self.along + self.turning));
        if self.turning == Vector3::zeros() {
            return Quotient::affine(over, self.origin.coords);
        }
        let under = normal.cross(&self.turning);
        Quotient::new(
            [over, under / under.dot(&self.direction)],
            self.origin.coords,
        )
    }
}

/// A projective coordinate of points: a quotient of affine functions `(a . p - a_0) / (b . p - b_0)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quotient {
    slopes: [Vector3<f64>; 2],
    offsets: [f64; 2],
}

impl Quotient {
    /// Zero over zero at `origin`.
    fn new(slopes: [Vector3<f64>; 2], origin: Vector3<f64>) -> Self {
        Self {
            slopes,
            offsets: slopes.map(|slope| slope.dot(&origin)),
        }
    }

    fn affine(slope: Vector3<f64>, origin: Vector3<f64>) -> Self {
        Self {
            slopes: [slope, Vector3::zeros()],
            offsets: [slope.dot(&origin), -1.0],
        }
    }

    /// Returns the same coordinate of points in the frame of a body.
    pub(super) fn in_body(&self, pose: &Pose) -> Self {
        let shift = pose.isometry().translation.vector;
        let moved = |k: usize| self.offsets[k] - self.slopes[k].dot(&shift);
        Self {
            slopes: self.slopes.map(|slope| pose.vector_to_body(&slope)),
            offsets: [moved(0), moved(1)],
        }
    }

    /// Returns its value at a point.
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        let [over, under] = [0, 1].map(|k| self.slopes[k].dot(&p.coords) - self.offsets[k]);
        over / under
    }

    /// Returns numerator and denominator at `origin + x axes[0] + y axes[1]` as `[constant, of x, of y]`.
    pub(super) fn on_plane(
        &self,
        origin: &Vector3<f64>,
        axes: [&Vector3<f64>; 2],
    ) -> [[f64; 3]; 2] {
        [0, 1].map(|k| {
            let slope = &self.slopes[k];
            [
                slope.dot(origin) - self.offsets[k],
                slope.dot(axes[0]),
                slope.dot(axes[1]),
            ]
        })
    }

    /// Returns its smallest and largest value on the parallel of radius r at x, in the frame of a body.
    pub(super) fn on_parallel(&self, [x, r]: [f64; 2]) -> [f64; 2] {
        let across = self
            .slopes
            .map(|slope| Vector3::new(0.0, r * slope.y, r * slope.z));
        self.extremes(
            [0, 1].map(|k| self.slopes[k].x * x - self.offsets[k]),
            across,
        )
    }

    /// Returns a point (0, y, z) in the direction from the axis in which it is the given smallest or largest value on a parallel at x, in the frame of a
    /// body.
    pub(super) fn place(&self, x: f64, value: f64) -> Point3<f64> {
        let [over, under] = self.slopes;
        let offset = (over.x * x - self.offsets[0]) - value * (under.x * x - self.offsets[1]);
        let ahead = (over - under * value) * -offset.signum();
        Point3::new(0.0, ahead.y, ahead.z)
    }

    /// Returns its smallest and largest value on an ellipsoid.
    pub(super) fn on_ellipsoid(&self, ellipsoid: &OrganShape) -> [f64; 2] {
        let [centre, axes] = <[_; 2]>::from(ellipsoid.bounds()).map(Vector3::from);
        let middle = [0, 1].map(|k| self.slopes[k].dot(&centre) - self.offsets[k]);
        self.extremes(middle, self.slopes.map(|slope| slope.component_mul(&axes)))
    }

    /// Returns its smallest and largest value where a plane `normal . p = distance` cuts an ellipsoid; `None` if it does not.
    pub(super) fn on_cut(
        &self,
        ellipsoid: &OrganShape,
        (normal, distance): (Vector3<f64>, f64),
    ) -> Option<[f64; 2]> {
        let [centre, axes] = <[_; 2]>::from(ellipsoid.bounds()).map(Vector3::from);
        // In coordinates in which it is the unit ball.
        let scaled = normal.component_mul(&axes);
        let size = scaled.norm();
        let (ahead, depth) = (scaled / size, (distance - normal.dot(&centre)) / size);
        let radius = ((1.0 - depth) * (1.0 + depth)).max(0.0).sqrt();
        let slopes = self.slopes.map(|slope| slope.component_mul(&axes));
        let middle = |k: usize| {
            self.slopes[k].dot(&centre) + depth * slopes[k].dot(&ahead) - self.offsets[k]
        };
        let across = slopes.map(|slope| radius * (slope - ahead * slope.dot(&ahead)));
        (radius > 0.0).then(|| self.extremes([middle(0), middle(1)], across))
    }

    /// Returns its smallest and largest value where a plane cuts a cylinder along z; `None` if the plane contains z.
    pub(super) fn on_cylinder(
        &self,
        cylinder: &OrganShape,
        (normal, distance): (Vector3<f64>, f64),
    ) -> Option<[f64; 2]> {
        let ([x, y, _], [a, b, _]) = cylinder.bounds();
        // As functions of x and y on the plane.
        let slopes = self
            .slopes
            .map(|slope| slope - normal * (slope.z / normal.z));
        let lift = |k: usize| self.slopes[k].z / normal.z * distance - self.offsets[k];
        let middle = [0, 1].map(|k| slopes[k].x * x + slopes[k].y * y + lift(k));
        let across = slopes.map(|slope| Vector3::new(a * slope.x, b * slope.y, 0.0));
        (normal.z != 0.0).then(|| self.extremes(middle, across))
    }

    /// The extremes of `(a + a' . e) / (b + b' . e)` over unit vectors e: (a - v b)^2 = |a' - v b'|^2 has both as roots.
    fn extremes(&self, [a, b]: [f64; 2], [across, below]: [Vector3<f64>; 2]) -> [f64; 2] {
        let square = b * b - below.norm_squared();
        let middle = a * b - across.dot(&below);
        let root = (middle * middle - square * (a * a - across.norm_squared()))
            .max(0.0)
            .sqrt();
        [(middle - root) / square, (middle + root) / square]
    }
}
