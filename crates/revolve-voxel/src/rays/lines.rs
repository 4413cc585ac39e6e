//! Lines in any direction: parallel, fans, cones, rasters between two planes, lists.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{at_least, at_most, countable, finite, length, positive};
use crate::rays::organ::across;
use crate::{Body, Meridian, PointRaster, Ray, RayCounters, RevolveError, Sample};

/// Points of two rasters closer than this, relative to the largest coordinate, coincide.
const COINCIDENT: f64 = 1e-9;

/// Infinite lines in any direction, with an image `[row][bin]`, or `[row][slab][bin]` for parallel rays cut into slabs by planes
/// ([`Lines::with_planes`]).
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
    pub(crate) first_row: usize,
    pub(crate) kind: Kind,
    /// Planes between the slabs of parallel rays.
    planes: Arc<[f64]>,
    /// Bound of all coordinates from which positions are computed.
    pub(super) farthest: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    /// From each point of a raster in one direction.
    Parallel(PointRaster, Vector3<f64>),
    /// From each point of a raster to the same point of another.
    Between([PointRaster; 2]),
    Each(Arc<[Ray]>),
}

impl Lines {
    /// Parallel rays in a raster of `[n_bins, n_rows]`: ray (bin, row) passes through `first + bin * bin_step + row * row_step`. The
    /// direction is normalised.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a bin or a row, [`RevolveError::NoDirection`] for a zero direction, [`RevolveError::NotFinite`] for a
    /// number or the position of the last ray, [`RevolveError::TooLarge`].
    pub fn parallel(
        size: [usize; 2],
        first: Point3<f64>,
        bin_step: Vector3<f64>,
        row_step: Vector3<f64>,
        direction: Vector3<f64>,
    ) -> Result<Self, RevolveError> {
        countable("rays of a view", &size)?;
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
            size,
            first_row: 0,
            farthest: raster.farthest(size)?,
            kind: Kind::Parallel(raster, direction),
            planes: Arc::default(),
        })
    }

    /// Returns parallel rays cut into slabs by perpendicular planes, which separates contributions by depth. Plane `t` is at the
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
    /// [`RevolveError::NotParallel`] for other lines; [`RevolveError::NotFinite`] for a plane; [`RevolveError::NotPositive`] unless planes
    /// ascend; [`RevolveError::TooLarge`].
    pub fn with_planes(mut self, planes: &[f64]) -> Result<Self, RevolveError> {
        if !matches!(self.kind, Kind::Parallel(..)) {
            return Err(RevolveError::NotParallel);
        }
        for plane in planes {
            finite("plane across the rays", *plane)?;
        }
        for pair in planes.windows(2) {
            positive("distance between planes", pair[1] - pair[0])?;
        }
        let [n_bins, n_rows] = self.size;
        countable("rays of a view", &[n_bins, n_rows, planes.len() + 1])?;
        self.planes = planes.into();
        Ok(self)
    }

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
            planes: Arc::default(),
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
            planes: Arc::default(),
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
    pub(crate) fn line(&self, bin: usize, row: usize) -> Ray {
        let row = self.first_row + row;
        match &self.kind {
            Kind::Parallel(raster, direction) => {
                Ray::new(raster.at(bin, row), *direction).expect("finite raster")
            }
            Kind::Each(lines) => lines[row * self.size[0] + bin],
            Kind::Between([from, to]) => {
                let from = from.at(bin, row);
                Ray::new(from, to.at(bin, row) - from).expect("distinct points")
            }
        }
    }

    /// Returns the planes between the slabs.
    pub(crate) fn planes(&self) -> &[f64] {
        &self.planes
    }

    /// Returns the number of slabs; 1 without planes.
    pub(super) fn n_slabs(&self) -> usize {
        self.planes.len() + 1
    }

    /// Samples of an image.
    pub(crate) fn image_len(&self) -> usize {
        self.size[0] * self.size[1] * self.n_slabs()
    }

    /// An error if a ray is parallel to the axis of a torso.
    pub(super) fn check_across(&self) -> Result<(), RevolveError> {
        let least = match &self.kind {
            Kind::Parallel(_, direction) => across(direction),
            _ => {
                let [n_bins, n_rows] = self.size;
                let of = |k: usize| across(&self.line(k % n_bins, k / n_bins).direction());
                (0..n_bins * n_rows)
                    .into_par_iter()
                    .map(of)
                    .reduce(|| 1.0, f64::min)
            }
        };
        positive("rays' part across the torso", least).map(drop)
    }

    /// Adds `weight` times the integrals along each ray, which `cast` adds to those of its slabs. `cast` returns whether the ray meets any content;
    /// `None` for a ray that needs no search. Parallel rays that miss `ball`, if it is given, are not cast.
    pub(crate) fn add_each<T: Sample, S: Default>(
        &self,
        ball: Option<(Point3<f64>, f64)>,
        weight: f64,
        out: &mut [T],
        cast: impl Fn(&mut S, &Ray, &mut [f64]) -> Option<bool> + Sync,
    ) -> RayCounters {
        let [n_bins, _] = self.size;
        let rows = out.par_chunks_mut(self.n_slabs() * n_bins).enumerate();
        let scratch = || (S::default(), vec![0.0; self.n_slabs()]);
        let counters = rows.map_init(scratch, |(scratch, slabs), (row, image)| {
            simd_set::checkpoint();
            let mut counters = RayCounters::default();
            let near = ball.map_or(0..n_bins, |ball| self.bins_near(ball, row));
            counters.skipped += (n_bins - near.len()) as u64;
            for bin in near {
                slabs.fill(0.0);
                let Some(hit) = cast(scratch, &self.line(bin, row), slabs) else {
                    counters.skipped += 1;
                    continue;
                };
                counters.cast += 1;
                counters.hit += u64::from(hit);
                for (slab, sum) in slabs.iter().enumerate().filter(|(_, sum)| **sum != 0.0) {
                    image[slab * n_bins + bin] += T::from_f64(weight * sum);
                }
            }
            counters
        });
        counters.reduce(RayCounters::default, |a, b| a + b)
    }

    /// Returns the bins of a row whose lines may intersect a ball; all of them unless lines are parallel.
    fn bins_near(&self, (centre, radius): (Point3<f64>, f64), row: usize) -> Range<usize> {
        let [n_bins, _] = self.size;
        let Kind::Parallel(raster, d) = &self.kind else {
            return 0..n_bins;
        };
        // Larger by more than the rounding of positions.
        let radius = radius + 1e-12 * self.farthest;
        let across = |v: Vector3<f64>| v - d * v.dot(d);
        let from = across(raster.at(0, self.first_row + row) - centre);
        let step = across(raster.bin_step);
        let c = from.norm_squared() - radius * radius;
        let within = not_positive([step.norm_squared(), from.dot(&step), c]);
        within.map_or(0..0, |ends| indices(ends, n_bins))
    }

    /// Adds the integrals along all rays, with a weight per layer of the body.
    pub(super) fn project_body<T: Sample>(
        &self,
        body: &Body,
        weights: &[f64],
        out: &mut [T],
    ) -> RayCounters {
        let pose = body.pose();
        let layers: Vec<(&Meridian, f64)> = (body.layers().iter().zip(weights.iter().copied()))
            .filter(|(_, weight)| *weight != 0.0)
            .collect();
        match &self.kind {
            Kind::Parallel(raster, direction) => {
                let rays = (raster.in_body(pose), pose.vector_to_body(direction));
                self.project_parallel(rays, pose, &layers, out)
            }
            Kind::Between(ends) => {
                let ends = ends.map(|raster| raster.in_body(pose));
                self.project_each(Some(ends), pose, &layers, out)
            }
            Kind::Each(_) => self.project_each(None, pose, &layers, out),
        }
    }
}

/// Returns the range of t in which `a t^2 + 2 b t + c`, with a >= 0, is not positive.
pub(crate) fn not_positive([a, b, c]: [f64; 3]) -> Option<[f64; 2]> {
    if a == 0.0 {
        return (c <= 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let square = b * b - a * c;
    (square >= 0.0).then(|| [(-b - square.sqrt()) / a, (-b + square.sqrt()) / a])
}

/// Returns the indices below `n` in a range, and one more on either side, for rounding.
pub(crate) fn indices([low, high]: [f64; 2], n: usize) -> Range<usize> {
    let first = (low - 1.0).max(0.0) as usize;
    first..((high + 2.0).max(0.0) as usize).min(n).max(first)
}
