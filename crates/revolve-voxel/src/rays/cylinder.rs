//! Elliptic cylinders (a torso) and their voxels.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::solid::segment::ROUNDING;
use crate::voxels::coverage::check_range;
use crate::{Body, Meridian, Ray, RevolveError, Sample, Span, VoxelGrid};

/// Vertices of the polygon around a circle about the axis; it extends beyond it by 1 / cos(pi / 256) - 1 = 7.5e-5.
const CORNERS: usize = 256;

/// An infinite elliptic cylinder along the z axis of the lab, such as a torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticCylinder {
    centre: [f64; 2],
    semi_axes: [f64; 2],
}

impl EllipticCylinder {
    /// A cylinder with its axis through `centre` (x, y) and semi-axes along x and y, in cm.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::NotPositive`].
    pub fn new(centre: [f64; 2], semi_axes: [f64; 2]) -> Result<Self, RevolveError> {
        for k in 0..2 {
            finite("centre of the torso", centre[k])?;
            positive("semi-axis of the torso", semi_axes[k])?;
        }
        Ok(Self { centre, semi_axes })
    }

    /// Returns the centre (x, y).
    #[must_use]
    pub fn centre(&self) -> [f64; 2] {
        self.centre
    }

    /// Returns the semi-axes along x and y.
    #[must_use]
    pub fn semi_axes(&self) -> [f64; 2] {
        self.semi_axes
    }

    /// Returns the segment of a ray inside the cylinder; `None` for a ray along z, which has no ends.
    #[must_use]
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        let [o, d] = [ray.origin().coords, ray.direction()];
        // In coordinates in which the cross-section is the unit circle.
        let p = [0, 1].map(|k| (o[k] - self.centre[k]) / self.semi_axes[k]);
        let v = [0, 1].map(|k| d[k] / self.semi_axes[k]);
        let vv = v[0] * v[0] + v[1] * v[1];
        if across(&d) == 0.0 {
            return None;
        }
        let cross = p[0] * v[1] - p[1] * v[0];
        let middle = -(p[0] * v[0] + p[1] * v[1]) / vv;
        let half = ((1.0 - cross / vv.sqrt()) * (1.0 + cross / vv.sqrt()) / vv).max(0.0);
        (half > 0.0).then(|| Span {
            enter: middle - half.sqrt(),
            exit: middle + half.sqrt(),
        })
    }

    /// Returns the smallest factor by which the cylinder must be scaled about its axis to contain the body; the body is inside if
    /// it is below 1. The result is an upper bound, too large by a relative error of at most 1e-4.
    ///
    /// ```
    /// use revolve_voxel::{Body, EllipticCylinder, Meridian, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?; // of radius 1/2
    /// let torso = EllipticCylinder::new([0.1, 0.0], [0.8, 0.9])?;
    /// let growth = torso.scale_to_contain(&body);
    /// assert!(growth >= 0.6 / 0.8 && growth < 0.6 / 0.8 + 1e-4);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn scale_to_contain(&self, body: &Body) -> f64 {
        let (centre, semi_axes) = (self.centre(), self.semi_axes());
        // The cross-section is convex, and the body is in the convex hull of the circles through the points of the meridian;
        // polygons around these circles are sufficient.
        let out = 1.0 / (PI / CORNERS as f64).cos();
        let corners: Vec<Vector3<f64>> = (0..CORNERS)
            .map(|k| (TAU * k as f64 / CORNERS as f64).sin_cos())
            .map(|(sin, cos)| body.pose().isometry().rotation * Vector3::new(0.0, cos, sin) * out)
            .collect();
        let segments = body.layers().iter().flat_map(Meridian::segments);
        let points = segments.flat_map(|segment| [segment.start(), segment.end()]);
        let share = |place: Vector3<f64>| {
            let share = [0, 1].map(|k| (place[k] - centre[k]) / semi_axes[k]);
            share[0].hypot(share[1])
        };
        points.fold(0.0, |most: f64, [x, r]| {
            let middle = body.pose().to_lab(&Point3::new(x, 0.0, 0.0)).coords;
            // Most circles are too far inside to matter.
            if share(middle) + r * out / semi_axes[0].min(semi_axes[1]) <= most {
                return most;
            }
            let corners = corners.iter().map(|corner| share(middle + r * corner));
            corners.fold(most, f64::max)
        })
    }

    /// Adds `value` times the exact covered fraction of every voxel in some slices to `out` (`[z][y][x]`, these slices only), such
    /// as an attenuation map.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a buffer of the wrong size, [`RevolveError::BadRange`] for slices outside the grid,
    /// [`RevolveError::NotFinite`] for the value.
    pub fn voxelize_add<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        value: f64,
        out: &mut [T],
    ) -> Result<(), RevolveError> {
        finite("value", value)?;
        check_slices(grid, &slices, out.len())?;
        if out.is_empty() {
            return Ok(());
        }
        let ([nx, ny, _], h) = (grid.shape(), grid.spacing());
        // All slices are equal.
        let section: Vec<T> = (0..nx * ny)
            .into_par_iter()
            .map(|k| {
                let at = grid.centre(k % nx, k / nx, 0);
                let [x, y] = [0, 1].map(|a| {
                    let edge =
                        |side: f64| (at[a] - self.centre[a] + side * h[a]) / self.semi_axes[a];
                    [edge(-0.5), edge(0.5)]
                });
                let whole = (x[1] - x[0]) * (y[1] - y[0]);
                T::from_f64(value * (disc_in_box(x, y) / whole).clamp(0.0, 1.0))
            })
            .collect();
        out.par_chunks_mut(nx * ny).for_each(|slice| {
            for (v, add) in slice.iter_mut().zip(&section) {
                *v += *add;
            }
        });
        Ok(())
    }
}

/// Returns the component of a unit direction perpendicular to a torso; `None` if it is parallel up to rounding.
pub(crate) fn across(d: &Vector3<f64>) -> f64 {
    let across = d.x.hypot(d.y);
    if across > ROUNDING { across } else { 0.0 }
}

/// Slices of the grid, and a buffer of their size.
pub(crate) fn check_slices(
    grid: &VoxelGrid,
    slices: &Range<usize>,
    given: usize,
) -> Result<(), RevolveError> {
    check_range(grid, slices)?;
    length("volume", grid.slice_len() * slices.len(), given)
}

/// Area of the unit disc within a rectangle.
pub(crate) fn disc_in_box(x: [f64; 2], y: [f64; 2]) -> f64 {
    // The area below y and left of x: differences over the four corners give the rectangle.
    let corner = |x: f64, y: f64| quadrant(x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0));
    let far = x[0].max(-x[1]).max(0.0).hypot(y[0].max(-y[1]).max(0.0));
    if far >= 1.0 {
        return 0.0;
    }
    if x[0].abs().max(x[1].abs()).hypot(y[0].abs().max(y[1].abs())) <= 1.0 {
        return (x[1] - x[0]) * (y[1] - y[0]);
    }
    corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
}

/// Signed area of the unit disc within the rectangle from the origin to (x, y), both in [-1, 1]: odd in x and in y.
fn quadrant(x: f64, y: f64) -> f64 {
    let (a, b) = (x.abs(), y.abs());
    let area = if a.hypot(b) <= 1.0 {
        a * b
    } else {
        // The area under the arc between heights b and a.
        let from = ((1.0 - b) * (1.0 + b)).sqrt();
        let under = |t: f64| 0.5 * (t * ((1.0 - t) * (1.0 + t)).sqrt() + t.asin());
        b * from + under(a) - under(from)
    };
    area * x.signum() * y.signum()
}
