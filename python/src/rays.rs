//! Rays that are not parallel: fan and cone beams, projection matrices, lines.

use crate::arrays::{self, Given, numbers, wrong_shape};
use crate::errors::Failure;
use crate::values::Whole;
use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::revolve_voxel::{Lines, ParallelDetector, Ray, RevolveError};
use heart_phantom::{PhantomError, RayGeometry};
use pyo3::prelude::*;

/// The rays of every view of an acquisition in the lab frame, in cm, for `Phantom.along`. Angles in radians.
///
/// A sample is the integral along the whole line, also behind the source.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom import Phantom, RayGeometry, Scene
/// >>> angles = np.arange(60) * np.radians(6)
/// >>> cone = RayGeometry.cone([60.0, 100.0], angles, n_bins=48, n_rows=48, pitch=[0.6, 0.6], times=0.005 * np.arange(60))
/// >>> scene = Scene().replace(acquisition={"mode": "instants"})
/// >>> Phantom(scene).along(cone).views().shape
/// (60, 48, 48)
#[pyclass(
    name = "RayGeometry",
    module = "heart_phantom",
    frozen,
    eq,
    from_py_object
)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PyRayGeometry(pub(crate) RayGeometry);

impl PyRayGeometry {
    fn at(rays: RayGeometry, times: Option<&Bound<'_, PyAny>>) -> Result<Self, Failure> {
        Ok(Self(match times {
            None => rays,
            Some(times) => rays.with_times(&numbers("times", times)?)?,
        }))
    }
}

fn detector(bins: Whole, rows: Whole, pitch: [f64; 2]) -> Result<ParallelDetector, Failure> {
    Ok(ParallelDetector::new(bins.0, rows.0, pitch)?)
}

#[pymethods]
impl PyRayGeometry {
    /// Returns cone beams onto a flat detector.
    ///
    /// At angle theta the source is at `-distances[0] (-sin theta, cos theta, 0)`. The detector is perpendicular to the central ray, with bins
    /// along (cos theta, sin theta, 0) and rows along z.
    ///
    /// Parameters
    /// ----------
    /// distances : (float, float)
    ///     From the source to the axis of rotation, and to the detector, in cm.
    /// angles : array_like
    ///     Angles of the views in radians.
    /// n_bins, n_rows : int
    ///     Size of the detector.
    /// pitch : (float, float)
    ///     Distance of bins and of rows on the detector in cm.
    /// times : array_like, optional
    ///     Start times of the views in seconds; by default those of the scene's camera.
    ///
    /// Returns
    /// -------
    /// RayGeometry
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (distances, angles, *, n_bins, n_rows, pitch, times = None))]
    fn cone(
        distances: [f64; 2],
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        n_rows: Whole,
        pitch: [f64; 2],
        times: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let detector = detector(n_bins, n_rows, pitch)?;
        let rays = RayGeometry::cone(distances, &numbers("angles", angles)?, detector)?;
        Self::at(rays, times)
    }

    /// Returns fan beams: as `cone`, with a focal line along z in the place of the source.
    ///
    /// Parameters
    /// ----------
    /// distances, angles, n_bins, n_rows, pitch, times
    ///     As in `cone`.
    ///
    /// Returns
    /// -------
    /// RayGeometry
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (distances, angles, *, n_bins, n_rows, pitch, times = None))]
    fn fan(
        distances: [f64; 2],
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        n_rows: Whole,
        pitch: [f64; 2],
        times: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let detector = detector(n_bins, n_rows, pitch)?;
        let rays = RayGeometry::fan(distances, &numbers("angles", angles)?, detector)?;
        Self::at(rays, times)
    }

    /// Returns the rays of projection matrices P: `P (x, y, z, 1) = w (bin, row, 1)` for a point in cm.
    ///
    /// The centre of the first bin and row is (0, 0).
    ///
    /// Parameters
    /// ----------
    /// matrices : array_like
    ///     `[view][3][4]`.
    /// n_bins, n_rows, pitch, times
    ///     As in `cone`.
    ///
    /// Returns
    /// -------
    /// RayGeometry
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (matrices, *, n_bins, n_rows, pitch, times = None))]
    fn from_matrices(
        matrices: &Bound<'_, PyAny>,
        n_bins: Whole,
        n_rows: Whole,
        pitch: [f64; 2],
        times: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let Given { samples, shape } = arrays::of::<f64>("matrices", matrices)?;
        if shape.len() != 3 || shape[1..] != [3, 4] {
            return Err(wrong_shape("matrices", &shape, "(n, 3, 4)").into());
        }
        let (rows, _) = samples.as_chunks::<4>();
        let (matrices, _) = rows.as_chunks::<3>();
        let detector = detector(n_bins, n_rows, pitch)?;
        Self::at(RayGeometry::from_matrices(matrices, detector)?, times)
    }

    /// Returns lines through pairs of points.
    ///
    /// Parameters
    /// ----------
    /// points : array_like
    ///     `[view][row][bin][2][3]` in cm; with attenuation the detector is at the end of the second point.
    /// times : array_like, optional
    ///     As in `cone`.
    ///
    /// Returns
    /// -------
    /// RayGeometry
    ///
    /// Raises
    /// ------
    /// HeartPhantomError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (points, *, times = None))]
    fn from_lines(
        points: &Bound<'_, PyAny>,
        times: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let Given { samples, shape } = arrays::of::<f64>("points", points)?;
        let [_, rows, bins, 2, 3] = shape[..] else {
            return Err(wrong_shape("points", &shape, "(views, rows, bins, 2, 3)").into());
        };
        let (points, _) = samples.as_chunks::<3>();
        let (pairs, _) = points.as_chunks::<2>();
        let ray = |[from, to]: &[[f64; 3]; 2]| {
            let from = Point3::from(*from);
            Ray::new(from, Point3::from(*to) - from)
        };
        let views = pairs.chunks((rows * bins).max(1)).map(|view| {
            let rays: Vec<Ray> = view.iter().map(ray).collect::<Result<_, RevolveError>>()?;
            Lines::each([bins, rows], rays)
        });
        let views: Result<Vec<Lines>, RevolveError> = views.collect();
        Self::at(
            RayGeometry::from_lines(views.map_err(PhantomError::from)?)?,
            times,
        )
    }

    /// Number of views.
    #[getter]
    fn n_views(&self) -> usize {
        self.0.n_views()
    }

    fn __repr__(&self) -> String {
        let detector = self.0.detector();
        let [bins, rows] = [detector.n_bins(), detector.n_rows()];
        format!(
            "<RayGeometry: {} views of {rows} x {bins} rays>",
            self.n_views()
        )
    }
}
