//! Parallel rays on a detector.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::error::{at_least, at_most, countable, finite, positive, view_angle};
use crate::{PointRaster, Ray, RevolveError};

/// A flat parallel-beam detector that rotates about the z axis of the lab.
///
/// At view angle theta (radians) bins run along (cos theta, sin theta, 0), rows along z, rays along
/// (-sin theta, cos theta, 0). The centre of bin k of n is at `(k - (n-1)/2) * pitch + offset`; rows follow the same rule.
/// Images are indexed `[row][bin]`, bin fastest. [`Body::project`](crate::Body::project) samples at the centres of bins, a
/// [`View`](crate::View) also gives means over bins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParallelDetector {
    n_bins: usize,
    n_rows: usize,
    pitch: [f64; 2],
    offset: [f64; 2],
}

impl ParallelDetector {
    /// A detector centred on the axis of rotation; `pitch` is [bin, row].
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a bin or a row; [`RevolveError::NotPositive`], [`RevolveError::NotFinite`],
    /// [`RevolveError::TooLarge`].
    pub fn new(n_bins: usize, n_rows: usize, pitch: [f64; 2]) -> Result<Self, RevolveError> {
        countable("rays of a view", &[n_bins, n_rows])?;
        positive("bin pitch", pitch[0])?;
        positive("row pitch", pitch[1])?;
        Ok(Self {
            n_bins,
            n_rows,
            pitch,
            offset: [0.0; 2],
        })
    }

    /// Returns the detector with its centre at `offset` = [along the bins, along z].
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn with_offset(mut self, offset: [f64; 2]) -> Result<Self, RevolveError> {
        finite("bin offset", offset[0])?;
        finite("row offset", offset[1])?;
        self.offset = offset;
        Ok(self)
    }

    /// Returns the pitch [bin, row].
    #[must_use]
    pub fn pitch(&self) -> [f64; 2] {
        self.pitch
    }

    /// Returns the offset of the centre, [along the bins, along z].
    #[must_use]
    pub fn offset(&self) -> [f64; 2] {
        self.offset
    }

    /// Returns the number of bins in a row.
    #[must_use]
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Returns the rays of one view, through the centres of the bins; `theta` is in radians.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`]; [`RevolveError::OutOfRange`] beyond 76 radians (twelve turns), as most angles in degrees.
    pub fn rays(&self, theta: f64) -> Result<ParallelRays, RevolveError> {
        let (sin, cos) = view_angle(theta)?.sin_cos();
        let bins = Vector3::new(cos, sin, 0.0);
        let at = |a: usize, n: usize| self.offset[a] - 0.5 * (n as f64 - 1.0) * self.pitch[a];
        ParallelRays::new(
            [self.n_bins, self.n_rows],
            Point3::from(bins * at(0, self.n_bins) + Vector3::z() * at(1, self.n_rows)),
            bins * self.pitch[0],
            Vector3::z() * self.pitch[1],
            Vector3::new(-sin, cos, 0.0),
        )
    }
}

/// A raster of parallel rays in any position: ray (bin, row) passes through `first + bin * bin_step + row * row_step`.
///
/// Their projection is an image `[row][bin]`, or `[row][slab][bin]` for rays cut into slabs by planes
/// ([`ParallelRays::with_planes`]).
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelRays {
    pub(super) n_bins: usize,
    n_rows: usize,
    /// Index of the first row in the raster.
    pub(super) first_row: usize,
    /// Bound of all coordinates, including omitted rows.
    pub(super) farthest: f64,
    pub(super) raster: PointRaster,
    pub(super) direction: Vector3<f64>,
    planes: Arc<[f64]>,
}

impl ParallelRays {
    /// A raster of `[n_bins, n_rows]` rays; the direction is normalised.
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`] for a count of zero or a zero direction, [`RevolveError::NotFinite`] for a number or the
    /// position of the last ray, [`RevolveError::TooLarge`].
    pub fn new(
        [n_bins, n_rows]: [usize; 2],
        first: Point3<f64>,
        bin_step: Vector3<f64>,
        row_step: Vector3<f64>,
        direction: Vector3<f64>,
    ) -> Result<Self, RevolveError> {
        countable("rays of a view", &[n_bins, n_rows])?;
        for v in bin_step.iter().chain(row_step.iter()) {
            finite("step between rays", *v)?;
        }
        let direction = Ray::new(first, direction)?.direction();
        let raster = PointRaster {
            first,
            bin_step,
            row_step,
        };
        Ok(Self {
            n_bins,
            n_rows,
            first_row: 0,
            farthest: raster.farthest([n_bins, n_rows])?,
            raster,
            direction,
            planes: Arc::default(),
        })
    }

    /// Returns the rays cut into slabs by perpendicular planes, which separates contributions by depth. Plane `t` is at the
    /// distance `t` beyond the raster point of a ray. Slab 0 is before the first plane, the last slab beyond the last plane.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, ParallelDetector, Pose};
    /// let rod = Meridian::new(&[[-1.0, 0.5], [1.0, 0.5]])?;
    /// let body = Body::new(vec![rod], Pose::axis_along_z(0.0)?)?;
    /// let rays = ParallelDetector::new(1, 1, [1.0, 1.0])?.rays(0.0)?; // along +y, through the rod from -1/2 to 1/2
    /// let (slabs, _) = body.project::<f64>(&rays.with_planes(&[-0.25, 0.125])?, &[1.0])?;
    /// assert_eq!(slabs, [0.25, 0.375, 0.375]);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] for a plane; [`RevolveError::NotPositive`] unless planes ascend; [`RevolveError::TooLarge`].
    pub fn with_planes(mut self, planes: &[f64]) -> Result<Self, RevolveError> {
        for plane in planes {
            finite("plane across the rays", *plane)?;
        }
        for pair in planes.windows(2) {
            positive("distance between planes", pair[1] - pair[0])?;
        }
        countable(
            "rays of a view",
            &[self.n_bins, self.n_rows, planes.len() + 1],
        )?;
        self.planes = planes.into();
        Ok(self)
    }

    /// Returns the number of slabs; 1 without planes.
    pub(crate) fn n_slabs(&self) -> usize {
        self.planes.len() + 1
    }

    pub(crate) fn planes(&self) -> &[f64] {
        &self.planes
    }

    /// Returns the number of bins in a row.
    #[must_use]
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Returns the unit direction of the rays.
    #[must_use]
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Returns some rows of the raster; their projections are bitwise identical to those rows of the whole.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a row; [`RevolveError::WrongLength`] for rows beyond the raster.
    pub fn rows(&self, rows: Range<usize>) -> Result<Self, RevolveError> {
        at_least("rows", rows.len(), 1)?;
        at_most("rows (at most)", rows.end, self.n_rows)?;
        Ok(Self {
            first_row: self.first_row + rows.start,
            n_rows: rows.len(),
            ..self.clone()
        })
    }

    /// Returns one ray; `None` beyond the raster.
    #[must_use]
    pub fn ray(&self, bin: usize, row: usize) -> Option<Ray> {
        (bin < self.n_bins && row < self.n_rows).then(|| self.line(bin, row))
    }

    /// Returns the line of a ray of the raster.
    #[expect(clippy::expect_used, reason = "validated when the raster was made")]
    pub(crate) fn line(&self, bin: usize, row: usize) -> Ray {
        let origin = self.raster.at(bin, self.first_row + row);
        Ray::new(origin, self.direction).expect("finite raster")
    }
}
