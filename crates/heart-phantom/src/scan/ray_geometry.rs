//! Views along rays that are not parallel: fan and cone beams, projection matrices, lists of lines.

use crate::error::{PhantomError, check, check_count, check_length};
use revolve_voxel::nalgebra::{Matrix3, Point3, Vector3};
use revolve_voxel::{Lines, ParallelDetector, PointRaster, RevolveError};
use std::sync::Arc;

/// Smallest determinant of the left block of a projection matrix, relative to the product of the lengths of its rows.
const SINGULAR: f64 = 1e-12;

/// The rays of every view of an acquisition, in the lab frame (cm), with the start time of each view.
///
/// A sample is the integral along the whole line, also behind the source; with attenuation the detector is at the far end
/// of the ray. With [`BinSample::Averages`](crate::BinSample::Averages) it is the average over the area of a bin of the detector.
/// [`Phantom::along`](crate::Phantom::along) acquires the views.
///
/// ```
/// use heart_phantom::revolve_voxel::ParallelDetector;
/// use heart_phantom::{Mode, Phantom, RayGeometry, Scene, no_observer};
/// // A turn of 0.3 s: 60 views from a source at 60 cm, on a flat detector at 40 cm beyond the axis.
/// let angles: Vec<f64> = (0..60).map(|k| f64::from(k) * 6f64.to_radians()).collect();
/// let times: Vec<f64> = (0..60).map(|k| 0.005 * f64::from(k)).collect();
/// let detector = ParallelDetector::new(32, 32, [0.8; 2])?;
/// let cone = RayGeometry::cone([60.0, 100.0], &angles, detector)?.with_times(&times)?;
/// let phantom = Phantom::new(Scene::default().with_mode(Mode::Instants))?.along(cone)?;
/// let views = phantom.sinograms(0, &no_observer)?;
/// assert_eq!(views.samples.len(), 60 * 32 * 32);
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RayGeometry {
    detector: ParallelDetector,
    views: Views,
    times: Option<Arc<[f64]>>,
}

#[derive(Debug, Clone, PartialEq)]
enum Views {
    /// From sources to the centres of the bins.
    Rasters(Arc<[[PointRaster; 2]]>),
    Lists(Arc<[Lines]>),
}

impl RayGeometry {
    /// Cone beams: at angle theta the source is at `-source_to_isocentre (-sin theta, cos theta, 0)`, the flat detector
    /// perpendicular to the central ray at `source_to_detector` from it, with bins along (cos theta, sin theta, 0) and rows along z.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless `0 < source_to_isocentre <= source_to_detector`, and for an angle that is not finite;
    /// [`PhantomError::Count`] without a view.
    pub fn cone(
        [source_to_isocentre, source_to_detector]: [f64; 2],
        angles: &[f64],
        detector: ParallelDetector,
    ) -> Result<Self, PhantomError> {
        Self::rotating(
            [source_to_isocentre, source_to_detector],
            angles,
            detector,
            0.0,
        )
    }

    /// Fan beams: as [`RayGeometry::cone`] with a focal line along z in the place of the source, so that the rays of a row lie in a plane
    /// perpendicular to z.
    ///
    /// # Errors
    /// As [`RayGeometry::cone`].
    pub fn fan(
        distances: [f64; 2],
        angles: &[f64],
        detector: ParallelDetector,
    ) -> Result<Self, PhantomError> {
        Self::rotating(distances, angles, detector, 1.0)
    }

    /// `fan` is the distance of the sources of two rows over that of their bins.
    fn rotating(
        [near, far]: [f64; 2],
        angles: &[f64],
        detector: ParallelDetector,
        fan: f64,
    ) -> Result<Self, PhantomError> {
        check("source_to_isocentre", near, [1e-6, 1e6])?;
        check("source_to_detector", far, [near, 1e6])?;
        let (pitch, offset) = (detector.pitch(), detector.offset());
        let counts = [detector.n_bins(), detector.n_rows()].map(|n| n as f64);
        let first = [0, 1].map(|k| offset[k] - 0.5 * (counts[k] - 1.0) * pitch[k]);
        let rasters = |theta: &f64| {
            let (sin, cos) = check("view angle", *theta, [-1e6, 1e6])?.sin_cos();
            let (bins, ahead) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
            let at = |along: f64, bins: Vector3<f64>, rows: f64| PointRaster {
                first: Point3::from(
                    ahead * along + bins * first[0] + Vector3::z() * rows * first[1],
                ),
                bin_step: bins * pitch[0],
                row_step: Vector3::z() * (rows * pitch[1]),
            };
            Ok([at(-near, Vector3::zeros(), fan), at(far - near, bins, 1.0)])
        };
        let rasters: Result<Vec<_>, PhantomError> = angles.iter().map(rasters).collect();
        Self::new(detector, Views::Rasters(rasters?.into()))
    }

    /// Projection matrices, one per view: `P (x, y, z, 1) = w (bin, row, 1)` for a point in cm. The centre of the first bin and row is
    /// (0, 0) (the convention of OpenCV), w is positive on the detector's side of the source. Only pitch and numbers of `detector` are
    /// used; the matrix of RTK, in mm on the detector, is converted with the origin and the spacing of the projections.
    ///
    /// # Errors
    /// [`PhantomError::Matrix`] for an entry that is not finite and for a singular left block (parallel rays); [`PhantomError::Count`]
    /// without a view.
    pub fn from_matrices(
        matrices: &[[[f64; 4]; 3]],
        detector: ParallelDetector,
    ) -> Result<Self, PhantomError> {
        let raster = |(view_idx, rows): (usize, &[[f64; 4]; 3])| {
            let block = Matrix3::from_fn(|i, j| rows[i][j]);
            let lengths: f64 = block.row_iter().map(|row| row.norm()).product();
            let determinant = block.determinant();
            let finite = rows.iter().flatten().all(|entry| entry.is_finite());
            // A NaN is no larger.
            if !(finite && determinant.abs() > SINGULAR * lengths) {
                let determinant = determinant / lengths;
                return Err(PhantomError::Matrix {
                    view_idx,
                    determinant,
                });
            }
            let inverse = block.try_inverse().unwrap_or_default();
            let source = Point3::from(-(inverse * Vector3::from_fn(|i, _| rows[i][3])));
            // At the distance at which bins have their pitch.
            let ways = inverse * (detector.pitch()[0] / inverse.column(0).norm());
            let first = source + ways.column(2);
            let [bin_step, row_step] = [0, 1].map(|k| ways.column(k).into_owned());
            let bins = PointRaster {
                first,
                bin_step,
                row_step,
            };
            Ok([source.into(), bins])
        };
        let rasters: Vec<_> = { matrices.iter().enumerate() }
            .map(raster)
            .collect::<Result<_, _>>()?;
        Self::new(detector, Views::Rasters(rasters.into()))
    }

    /// Any lines, all views with the same numbers of bins and rows; samples are line integrals.
    ///
    /// # Errors
    /// [`PhantomError::Count`] without a view; [`PhantomError::WrongLength`] unless all views have the same size.
    pub fn from_lines(views: Vec<Lines>) -> Result<Self, PhantomError> {
        check_count("views", views.len(), [1, usize::MAX])?;
        let [bins, rows] = views[0].size();
        for view in &views {
            let [n, m] = view.size();
            check_length("bins of a view", n, bins)?;
            check_length("rows of a view", m, rows)?;
        }
        let detector = ParallelDetector::new(bins, rows, [1.0; 2])?;
        Self::new(detector, Views::Lists(views.into()))
    }

    fn new(detector: ParallelDetector, views: Views) -> Result<Self, PhantomError> {
        let made = Self {
            detector,
            views,
            times: None,
        };
        check_count("views", made.n_views(), [1, usize::MAX])?;
        Ok(made)
    }

    /// Sets the time at which each view starts, in seconds; by default view k starts at k times the interval of the scene's camera.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] unless there is one per view; [`PhantomError::OutOfRange`] beyond 0 to 1e9 s.
    pub fn with_times(mut self, times: &[f64]) -> Result<Self, PhantomError> {
        check_length("times of views", times.len(), self.n_views())?;
        for time in times {
            check("time of a view", *time, [0.0, 1e9])?;
        }
        self.times = Some(times.into());
        Ok(self)
    }

    /// Returns the number of views.
    #[must_use]
    pub fn n_views(&self) -> usize {
        match &self.views {
            Views::Rasters(rasters) => rasters.len(),
            Views::Lists(lists) => lists.len(),
        }
    }

    /// Returns numbers and pitch of bins and rows; a list of lines has a pitch of 1.
    #[must_use]
    pub fn detector(&self) -> &ParallelDetector {
        &self.detector
    }

    /// Returns the start times of the views, if they were set.
    pub(crate) fn times(&self) -> Option<&[f64]> {
        self.times.as_deref()
    }

    /// Returns the lines of a view.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such view; [`PhantomError::Solid`] if source and a bin coincide.
    pub fn lines(&self, view_idx: usize) -> Result<Lines, PhantomError> {
        check_count("view_idx", view_idx, [0, self.n_views() - 1])?;
        Ok(self.lines_on(&self.detector.with_offset([0.0; 2])?, view_idx)?)
    }

    /// Returns source (a focal line for a fan) and bins of a view; `None` for a list.
    pub(crate) fn rasters(&self, view_idx: usize) -> Option<[PointRaster; 2]> {
        match &self.views {
            Views::Lists(_) => None,
            Views::Rasters(rasters) => Some(rasters[view_idx]),
        }
    }

    /// Returns the lines of a view to the bins of another raster in the plane of the detector, about its centre.
    pub(super) fn lines_on(
        &self,
        raster: &ParallelDetector,
        view_idx: usize,
    ) -> Result<Lines, RevolveError> {
        let ends = match &self.views {
            Views::Lists(lists) => return Ok(lists[view_idx].clone()),
            Views::Rasters(rasters) => rasters[view_idx],
        };
        let (size, own) = ([raster.n_bins(), raster.n_rows()], &self.detector);
        // First bin and steps of the raster in units of bins.
        let steps = [0, 1].map(|k| raster.pitch()[k] / own.pitch()[k]);
        let first = [own.n_bins(), own.n_rows()].map(|n| 0.5 * (n as f64 - 1.0));
        let first = [0, 1].map(|k| {
            first[k] + raster.offset()[k] / own.pitch()[k] - 0.5 * (size[k] as f64 - 1.0) * steps[k]
        });
        let [from, to] = ends.map(|end| PointRaster {
            first: end.first + end.bin_step * first[0] + end.row_step * first[1],
            bin_step: end.bin_step * steps[0],
            row_step: end.row_step * steps[1],
        });
        Lines::between(size, from, to)
    }

    /// Whether bins have areas, over which samples can be averaged.
    pub(crate) fn has_bins(&self) -> bool {
        matches!(self.views, Views::Rasters(_))
    }

    /// Returns the angle of a view as that of a parallel view: of the line to the middle of the detector, or of the first line of a list.
    pub(super) fn angle(&self, view_idx: usize) -> Result<f64, PhantomError> {
        let middle = ParallelDetector::new(1, 1, self.detector.pitch())?;
        let ray = self.lines_on(&middle, view_idx)?.ray(0, 0);
        let ahead = ray.map(|ray| ray.direction()).unwrap_or_default();
        Ok((-ahead.x).atan2(ahead.y))
    }
}
