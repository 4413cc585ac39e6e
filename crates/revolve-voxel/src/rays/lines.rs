//! Lines in any direction: fans, cones, rasters between two planes, lists.

use std::ops::Range;
use std::sync::Arc;

use crate::error::{at_least, at_most, countable, length};
use crate::{ParallelRays, PointRaster, Ray, RevolveError};

/// Points of two rasters closer than this, relative to the largest coordinate, coincide.
const COINCIDENT: f64 = 1e-9;

/// Infinite lines in any direction, with an image `[row][bin]`.
///
/// Line integrals are along the whole line, on both sides of its first point. With attenuation the detector is at the end to
/// which the line points.
///
/// ```
/// use revolve_voxel::nalgebra::{Point3, Vector3};
/// use revolve_voxel::{Body, Lines, Meridian, PointRaster, Pose};
/// let cylinder = Meridian::new(&[[-1.0, 2.0], [1.0, 2.0]])?;
/// let body = Body::new(vec![cylinder], Pose::axis_along_z(0.0)?)?; // radius 2 about z
/// let source = Point3::new(0.0, -10.0, 0.0);
/// let detector = PointRaster {
///     first: Point3::new(-10.0, 10.0, 0.0),
///     bin_step: Vector3::x() * 5.0,
///     row_step: Vector3::z(),
/// };
/// let fan = Lines::between([5, 1], source, detector)?;
/// let (image, _) = body.project::<f64>(&fan, &[1.0])?;
/// let at = |tan: f64| 2.0 * (4.0 - (10.0 * tan).powi(2) / (1.0 + tan * tan)).max(0.0).sqrt();
/// for (bin, sample) in image.iter().enumerate() {
///     assert!((sample - at((bin as f64 - 2.0) / 4.0)).abs() < 1e-12);
/// }
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Lines {
    pub(super) size: [usize; 2],
    /// Index of the first row in the raster or list.
    pub(super) first_row: usize,
    pub(super) kind: Kind,
    /// Bound of all coordinates from which positions are computed.
    pub(super) farthest: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// From each point of a raster to the same point of another.
    Between([PointRaster; 2]),
    Each(Arc<[Ray]>),
}

impl Lines {
    /// The lines from each point of a raster of `[n_bins, n_rows]` to that of another one, or from one point to all of them.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a bin or a row, [`RevolveError::TooLarge`], [`RevolveError::NotFinite`],
    /// [`RevolveError::NoDirection`] if two points are closer than 1e-9 of the largest coordinate: their direction is rounding.
    pub fn between(
        size: [usize; 2],
        from: impl Into<PointRaster>,
        to: impl Into<PointRaster>,
    ) -> Result<Self, RevolveError> {
        countable("rays of a view", &size)?;
        let ends = [from.into(), to.into()];
        let farthest = ends[0].farthest(size)?.max(ends[1].farthest(size)?);
        let lines = Self {
            size,
            first_row: 0,
            kind: Kind::Between(ends),
            farthest,
        };
        let way = |[bin, row]: [usize; 2]| ends[1].at(bin, row) - ends[0].at(bin, row);
        let corners = [0, size[0] - 1].map(|bin| [0, size[1] - 1].map(|row| way([bin, row])));
        let coincident = COINCIDENT * farthest;
        // Differences are linear: a component with one sign at all corners is never small.
        let apart = (0..3).any(|k| {
            let corners = corners.iter().flatten().map(|way| way[k]);
            let (least, most) = (
                corners.clone().fold(f64::MAX, f64::min),
                corners.fold(f64::MIN, f64::max),
            );
            least > coincident || most < -coincident
        });
        let none = |k: usize| way([k % size[0], k / size[0]]).norm() <= coincident;
        if !apart && (0..size[0] * size[1]).any(none) {
            return Err(RevolveError::NoDirection);
        }
        Ok(lines)
    }

    /// A list of lines as an image of `[n_bins, n_rows]`, `[row][bin]`.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`], [`RevolveError::TooLarge`], [`RevolveError::WrongLength`] unless there is one line per sample.
    pub fn each(size: [usize; 2], lines: impl Into<Arc<[Ray]>>) -> Result<Self, RevolveError> {
        countable("rays of a view", &size)?;
        let lines = lines.into();
        length("rays", size[0] * size[1], lines.len())?;
        let coordinates = lines.iter().map(|line| line.origin().coords.amax());
        Ok(Self {
            size,
            first_row: 0,
            farthest: coordinates.fold(0.0, f64::max),
            kind: Kind::Each(lines),
        })
    }

    /// Returns some rows of the lines; their projections are bitwise identical to those rows of the whole.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a row; [`RevolveError::WrongLength`] for rows beyond the raster.
    pub fn rows(&self, rows: Range<usize>) -> Result<Self, RevolveError> {
        at_least("rows", rows.len(), 1)?;
        let [n_bins, n_rows] = self.size;
        at_most("rows (at most)", rows.end, n_rows)?;
        Ok(Self {
            size: [n_bins, rows.len()],
            first_row: self.first_row + rows.start,
            ..self.clone()
        })
    }

    /// Returns the numbers of bins and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Returns one line; `None` beyond the raster.
    #[must_use]
    pub fn ray(&self, bin: usize, row: usize) -> Option<Ray> {
        (bin < self.size[0] && row < self.size[1]).then(|| self.line(bin, row))
    }

    #[expect(clippy::expect_used, reason = "validated when the lines were made")]
    pub(super) fn line(&self, bin: usize, row: usize) -> Ray {
        let row = self.first_row + row;
        match &self.kind {
            Kind::Each(lines) => lines[row * self.size[0] + bin],
            Kind::Between([from, to]) => {
                let from = from.at(bin, row);
                Ray::new(from, to.at(bin, row) - from).expect("distinct points")
            }
        }
    }
}

impl From<&ParallelRays> for Lines {
    /// The same lines, without slabs.
    fn from(rays: &ParallelRays) -> Self {
        let [n_bins, n_rows] = [rays.n_bins(), rays.n_rows()];
        let all = (0..n_rows).flat_map(|row| (0..n_bins).map(move |bin| rays.line(bin, row)));
        Self {
            size: [n_bins, n_rows],
            first_row: 0,
            kind: Kind::Each(all.collect()),
            farthest: rays.farthest,
        }
    }
}
