//! Chords, projections, voxels and distances of bodies.

use super::PyBody;
use crate::arrays::{array, numbers, points};
use crate::errors::Failure;
use crate::values::{Whole, choice};
use crate::work::{Progress, work};
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Body, ParallelDetector, Ray, RevolveError, Sample, VoxelGrid};
use numpy::{Element, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;

/// Rays or points of a unit of work: fewer would cost more to count than to compute.
const UNIT: usize = 1024;

/// One number for all axes, or one for each: z, y, x.
#[derive(Debug, Clone, Copy, FromPyObject)]
enum Spacing {
    All(f64),
    Each([f64; 3]),
}

/// The precision of an output.
#[derive(Debug, Clone, Copy)]
enum Precision {
    Single,
    Double,
}

const PRECISIONS: [(&str, Precision); 2] = [
    ("float32", Precision::Single),
    ("float64", Precision::Double),
];

#[pymethods]
impl PyBody {
    /// Computes chord lengths of lines within a layer.
    ///
    /// Parameters
    /// ----------
    /// origins : array_like
    ///     Points of the lines, `[n][3]`.
    /// directions : array_like
    ///     Directions, `[n][3]`, or one for all lines.
    /// layer : int
    ///     Index of the layer.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[n]`, cm.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If there is no such layer, or a direction is zero.
    #[pyo3(signature = (origins, directions, layer = Whole(0), *, progress = None), text_signature = "($self, origins, directions, layer=0, *, progress=None)")]
    fn chords<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        layer: Whole,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        self.along(py, progress, origins, directions, move |body, ray| {
            body.chord(layer.0, ray)
        })
    }

    /// Computes line integrals of the activity.
    ///
    /// Parameters
    /// ----------
    /// origins : array_like
    ///     Points of the lines, `[n][3]`.
    /// directions : array_like
    ///     Directions, `[n][3]`, or one for all lines.
    /// activity : array_like
    ///     One value per region.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[n]`.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If activities are missing, or a direction is zero.
    #[pyo3(signature = (origins, directions, activity, *, progress = None))]
    fn line_integrals<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        activity: &Bound<'py, PyAny>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let activity = numbers("activity", activity)?;
        self.along(py, progress, origins, directions, move |body, ray| {
            body.line_integral(ray, &activity)
        })
    }

    /// Computes exact projections: line integrals of the activity along parallel rays.
    ///
    /// The camera rotates about z: bins of view theta lie along (cos theta, sin theta, 0), rows along z, rays along (-sin theta, cos theta, 0).
    ///
    /// Parameters
    /// ----------
    /// angles : array_like
    ///     Angles of the views in radians.
    /// n_bins, n_rows : int
    ///     Size of the detector.
    /// pitch : (float, float)
    ///     Distance of bins and of rows.
    /// activity : array_like
    ///     One value per region.
    /// offset : (float, float)
    ///     Position of the middle of the detector, along bins and rows.
    /// dtype : {"float32", "float64"}
    ///     Precision of the result.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `[view][row][bin]`.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a value is outside its range.
    #[pyo3(signature = (angles, n_bins, n_rows, pitch, activity, *, offset = [0.0, 0.0], dtype = "float32", progress = None), text_signature = "($self, angles, n_bins, n_rows, pitch, activity, *, offset=(0.0, 0.0), dtype='float32', progress=None)")]
    #[expect(clippy::too_many_arguments, reason = "a camera")]
    fn views<'py>(
        &self,
        py: Python<'py>,
        angles: &Bound<'py, PyAny>,
        n_bins: Whole,
        n_rows: Whole,
        pitch: [f64; 2],
        activity: &Bound<'py, PyAny>,
        offset: [f64; 2],
        dtype: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let scan = Scan {
            body: self.body.clone(),
            angles: numbers("angles", angles)?,
            activity: numbers("activity", activity)?,
            detector: ParallelDetector::new(n_bins.0, n_rows.0, pitch)?.with_offset(offset)?,
        };
        let shape = [scan.angles.len(), n_rows.0, n_bins.0];
        Ok(match choice("dtype", dtype, &PRECISIONS)? {
            Precision::Single => scan.taken::<f32>(py, progress, &shape)?.into_any(),
            Precision::Double => scan.taken::<f64>(py, progress, &shape)?.into_any(),
        })
    }

    /// Computes the volume fraction of each region in each voxel.
    ///
    /// Parameters
    /// ----------
    /// shape : (int, int, int)
    ///     Number of voxels, (z, y, x).
    /// spacing : float or (float, float, float)
    ///     Size of a voxel, (z, y, x).
    /// centre : (float, float, float)
    ///     Centre of the grid, (z, y, x).
    /// tolerance : float
    ///     Accuracy of the fractions.
    /// dtype : {"float32", "float64"}
    ///     Precision of the fractions.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// coverage : ndarray
    ///     `[region][z][y][x]`.
    /// labels : ndarray
    ///     `uint8[z][y][x]`, the label with the largest volume fraction: 0 nothing, 1 + k region k.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If a value is outside its range.
    #[pyo3(signature = (shape, spacing, *, centre = [0.0, 0.0, 0.0], tolerance = 1e-3, dtype = "float32", progress = None), text_signature = "($self, shape, spacing, *, centre=(0.0, 0.0, 0.0), tolerance=1e-3, dtype='float32', progress=None)")]
    #[expect(clippy::too_many_arguments, reason = "a grid")]
    fn coverage<'py>(
        &self,
        py: Python<'py>,
        shape: [Whole; 3],
        spacing: Spacing,
        centre: [f64; 3],
        tolerance: f64,
        dtype: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<(Bound<'py, PyAny>, Bound<'py, PyArrayDyn<u8>>), Failure> {
        let grid = grid(shape, spacing, centre)?;
        let (coverage, labels) = match choice("dtype", dtype, &PRECISIONS)? {
            Precision::Single => self.covered::<f32>(py, progress, grid, tolerance)?,
            Precision::Double => self.covered::<f64>(py, progress, grid, tolerance)?,
        };
        Ok((coverage, array(py, labels, &shape.map(|n| n.0))?))
    }

    /// Computes signed distances of points from the surface of a layer.
    ///
    /// Parameters
    /// ----------
    /// places : array_like
    ///     Points, `[n][3]`.
    /// layer : int
    ///     Index of the layer.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `float64[n]`, negative inside.
    ///
    /// Raises
    /// ------
    /// RevolveError
    ///     If there is no such layer.
    #[pyo3(signature = (places, layer = Whole(0), *, progress = None), text_signature = "($self, places, layer=0, *, progress=None)")]
    fn signed_distances<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
        layer: Whole,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let (body, places) = (self.body.clone(), points::<3>("places", places)?);
        let n = places.len();
        let made = work(py, progress, move |_| {
            in_units(n, |k| {
                body.signed_distance(layer.0, &Point3::from(places[k]))
            })
        })?;
        array(py, made, &[n])
    }
}

impl PyBody {
    fn along<'py>(
        &self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        of: impl Fn(&Body, &Ray) -> Result<f64, RevolveError> + Send + Sync + 'static,
    ) -> Result<Bound<'py, PyArrayDyn<f64>>, Failure> {
        let origins = points::<3>("origins", origins)?;
        let directions = match numbers("directions", directions) {
            Ok(one) => match <[f64; 3]>::try_from(one) {
                Ok(one) => vec![one; origins.len()],
                Err(_) => points::<3>("directions", directions)?,
            },
            Err(_) => points::<3>("directions", directions)?,
        };
        let n = origins.len();
        if directions.len() != n {
            let text = format!("{} directions for {n} origins", directions.len());
            return Err(PyValueError::new_err(text).into());
        }
        let body = self.body.clone();
        let made = work(py, progress, move |_| {
            in_units(n, |k| {
                let along = Vector3::from(directions[k]);
                of(&body, &Ray::new(Point3::from(origins[k]), along)?)
            })
        })?;
        array(py, made, &[n])
    }

    fn covered<'py, T: Sample + Element + 'static>(
        &self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        grid: VoxelGrid,
        tolerance: f64,
    ) -> Result<(Bound<'py, PyAny>, Vec<u8>), Failure> {
        let (body, [nx, ny, nz]) = (self.body.clone(), grid.shape());
        let n = body.layers().len();
        let made = work(py, progress, move |_| {
            body.regions::<T>(&grid, 0..nz, tolerance)
        })?;
        let coverage = array(py, made.coverage.concat(), &[n, nz, ny, nx])?;
        Ok((coverage.into_any(), made.labels))
    }
}

/// Computes n values in units of work.
fn in_units(
    n: usize,
    of: impl Fn(usize) -> Result<f64, RevolveError> + Sync,
) -> Result<Vec<f64>, RevolveError> {
    let mut values = vec![0.0; n];
    let units = values.par_chunks_mut(UNIT).enumerate();
    units.try_for_each(|(unit, values)| {
        simd_set::unit(n.div_ceil(UNIT));
        for (k, value) in values.iter_mut().enumerate() {
            *value = of(unit * UNIT + k)?;
        }
        Ok(())
    })?;
    Ok(values)
}

/// The arguments of `PyBody::views`.
struct Scan {
    body: Arc<Body>,
    angles: Vec<f64>,
    activity: Vec<f64>,
    detector: ParallelDetector,
}

impl Scan {
    fn taken<'py, T: Sample + Element + 'static>(
        self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        shape: &[usize],
    ) -> Result<Bound<'py, PyArrayDyn<T>>, Failure> {
        array(py, work(py, progress, move |_| self.samples())?, shape)
    }

    fn samples<T: Sample>(&self) -> Result<Vec<T>, RevolveError> {
        let mut all = Vec::new();
        for (_part, (k, &angle)) in simd_set::parts(self.angles.iter().enumerate()) {
            let rays = self.detector.rays(angle)?;
            let (view, _) = self.body.project::<T>(&rays, &self.activity)?;
            if k == 0 {
                all.reserve_exact(view.len() * self.angles.len());
            }
            all.extend(view);
        }
        Ok(all)
    }
}

fn grid(shape: [Whole; 3], spacing: Spacing, centre: [f64; 3]) -> Result<VoxelGrid, RevolveError> {
    let xyz = |[z, y, x]: [f64; 3]| [x, y, z];
    let spacing = match spacing {
        Spacing::All(spacing) => [spacing; 3],
        Spacing::Each(spacing) => xyz(spacing),
    };
    let [nz, ny, nx] = shape.map(|n| n.0);
    VoxelGrid::centred([nx, ny, nz], spacing, xyz(centre))
}
