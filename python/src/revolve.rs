//! `heart_phantom.revolve`: solids of revolution.

use crate::arrays::{array, numbers, points};
use crate::errors::Failure;
use crate::mesh::PyMesh;
use crate::pose::PyPose;
use crate::recipe::{Recipe, Reduced};
use crate::values::{Whole, choice};
use crate::work::{Progress, work};
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{
    Body, MassProperties, Meridian, ParallelDetector, Pose, Ray, RevolveError, Sample, Sampling,
    VoxelGrid,
};
use numpy::{Element, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::sync::Arc;

/// A meridian, the curve that is revolved: points (x along the axis, r >= 0 from it), base to apex, `float64[n][2]`.
///
/// Discs close ends off the axis. A `ring` is a closed curve that need not touch the axis, such as that of a torus.
///
/// >>> from heart_phantom.revolve import Meridian
/// >>> round(Meridian([[0, 1], [3, 0]]).measures()["volume"], 9)  # a cone: pi
/// 3.141592654
#[pyclass(name = "Meridian", module = "heart_phantom.revolve", frozen)]
#[derive(Debug)]
pub(crate) struct PyMeridian {
    meridian: Meridian,
    recipe: Recipe,
}

#[pymethods]
impl PyMeridian {
    #[new]
    #[pyo3(signature = (points, *, ring = false))]
    fn new(points: &Bound<'_, PyAny>, ring: bool) -> Result<Self, Failure> {
        let py = points.py();
        let points = crate::arrays::points::<2>("points", points)?;
        let options = PyDict::new(py);
        options.set_item("ring", ring)?;
        let own = py.get_type::<Self>();
        let given = array(py, points.as_flattened().to_vec(), &[points.len(), 2])?;
        Ok(Self {
            meridian: match ring {
                true => Meridian::ring(&points)?,
                false => Meridian::new(&points)?,
            },
            recipe: Recipe::new(py, own.as_any(), (given,))?.with_options(&options)?,
        })
    }

    /// Volume (cm^3), surface (cm^2), and moments about x = 0 and about the axis, of density 1: a dictionary.
    fn measures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        measures(py, &self.meridian.mass_properties())
    }

    /// Extent along the axis.
    #[getter]
    fn x_range(&self) -> (f64, f64) {
        self.meridian.x_range().into()
    }

    /// Largest radius.
    #[getter]
    fn r_max(&self) -> f64 {
        self.meridian.r_max()
    }

    fn __repr__(&self) -> String {
        let ([low, high], r) = (self.meridian.x_range(), self.meridian.r_max());
        let n = self.meridian.n_segments();
        format!("<Meridian: {n} segments, x from {low} to {high}, r up to {r}>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
    }
}

fn measures<'py>(py: Python<'py>, of: &MassProperties) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    for (name, value) in [
        ("volume", of.volume),
        ("surface", of.surface),
        ("first_moment", of.first_moment),
        ("second_moment", of.second_moment),
        ("polar_inertia", of.polar_inertia),
    ] {
        made.set_item(name, value)?;
    }
    Ok(made)
}

/// Nested solids of revolution about one axis, innermost first, in a pose.
///
/// `layers` are meridians, or arrays of their points. Region 0 is the inside of layer 0, region k is layer k without layer k - 1;
/// activities have one value per region. Centimetres; chords and measures are exact for the given polylines. `progress` receives the
/// completed fraction of a call: a function of it, a tqdm bar, or `True`.
///
/// >>> import numpy as np
/// >>> from heart_phantom.revolve import Body
/// >>> cone = Body([[[0.0, 1.0], [3.0, 0.0]]])
/// >>> cone.chords([[1.5, -5.0, 0.0]], [0.0, 1.0, 0.0]).tolist()
/// [1.0]
#[pyclass(name = "Body", module = "heart_phantom.revolve", frozen)]
#[derive(Debug)]
pub(crate) struct PyBody {
    body: Arc<Body>,
    recipe: Recipe,
}

impl PyBody {
    pub(crate) fn with_recipe(body: Body, recipe: Recipe) -> Self {
        Self {
            body: Arc::new(body),
            recipe,
        }
    }
}

/// Rays or points of a unit of work: fewer would cost more to count than to compute.
const RAYS: usize = 1024;

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
    #[new]
    #[pyo3(signature = (layers, pose = None))]
    fn new(
        py: Python<'_>,
        layers: Vec<Bound<'_, PyAny>>,
        pose: Option<&Bound<'_, PyPose>>,
    ) -> Result<Self, Failure> {
        let layers = layers.iter().map(|layer| match layer.cast::<PyMeridian>() {
            Ok(meridian) => Ok(meridian.clone()),
            Err(_) => Ok(Bound::new(py, PyMeridian::new(layer, false)?)?),
        });
        let layers = layers.collect::<Result<Vec<_>, Failure>>()?;
        let own = layers.iter().map(|layer| layer.get().meridian.clone());
        let body = Body::new(
            own.collect(),
            pose.map_or_else(Pose::identity, |pose| pose.get().pose),
        )?;
        let recipe = Recipe::new(py, py.get_type::<Self>().as_any(), (layers, pose))?;
        Ok(Self::with_recipe(body, recipe))
    }

    /// The pose.
    #[getter]
    fn pose(slf: &Bound<'_, Self>) -> PyResult<PyPose> {
        let recipe = Recipe::property(slf.as_any(), "pose")?;
        Ok(PyPose::with_recipe(*slf.get().body.pose(), recipe))
    }

    /// Number of layers.
    #[getter]
    fn n_layers(&self) -> usize {
        self.body.layers().len()
    }

    /// The same body in another pose.
    fn with_pose(slf: &Bound<'_, Self>, pose: &Bound<'_, PyPose>) -> PyResult<Self> {
        let body = slf.get().body.with_pose(pose.get().pose);
        let recipe = Recipe::new(slf.py(), &slf.getattr("with_pose")?, (pose,))?;
        Ok(Self::with_recipe(body, recipe))
    }

    /// Volume, surface and moments of a region at density 1, in the body's frame: a dictionary.
    fn measures<'py>(&self, py: Python<'py>, region: Whole) -> Result<Bound<'py, PyDict>, Failure> {
        Ok(measures(py, &self.body.region_measures(region.0)?)?)
    }

    /// Chord lengths within a layer, `float64[n]`, of lines through `origins` (`[n][3]`) along `directions` (`[n][3]`, or one).
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

    /// Line integrals of the activity along lines, `float64[n]`.
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

    /// Exact projections, `[view][row][bin]`: line integrals of the activity.
    ///
    /// The camera rotates about z: bins of view `theta` (radians) lie along (cos theta, sin theta, 0), rows along z, rays along (-sin
    /// theta, cos theta, 0). `pitch` and `offset` are (bin, row). `dtype`: `"float32"` or `"float64"`.
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

    /// Coverage of each voxel by each region, `[region][z][y][x]`, and the label with the largest volume fraction, `uint8[z][y][x]`: 0
    /// nothing, 1 + k region k.
    ///
    /// `shape` is (z, y, x), `spacing` a number or (z, y, x), `centre` that of the grid, (z, y, x). Coverages are accurate to `tolerance`.
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

    /// Triangle mesh of the surface of a layer, within `tolerance` (cm) of it.
    #[pyo3(signature = (layer = Whole(0), *, tolerance = 0.01), text_signature = "($self, layer=0, *, tolerance=0.01)")]
    fn mesh(&self, py: Python<'_>, layer: Whole, tolerance: f64) -> Result<PyMesh, Failure> {
        let body = self.body.clone();
        let mesh = work(py, None, move |_| body.mesh(layer.0, tolerance))?;
        Ok(mesh.into())
    }

    /// Signed distance of points `[n][3]` from the surface of a layer, negative inside: `float64[n]`.
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
        let made: Vec<f64> = work(py, progress, move |_| {
            let place = |(k, p): (usize, [f64; 3])| {
                count(k, n);
                body.signed_distance(layer.0, &Point3::from(p))
            };
            let places = places.into_par_iter().enumerate();
            places
                .with_min_len(RAYS)
                .map(place)
                .collect::<Result<_, _>>()
        })?;
        array(py, made, &[n])
    }

    /// Bounding box of a layer along the lab's axes: its lowest and highest corner, (x, y, z).
    #[pyo3(signature = (layer = Whole(0)), text_signature = "($self, layer=0)")]
    fn bounding_box(&self, layer: Whole) -> Result<([f64; 3], [f64; 3]), Failure> {
        let [low, high] = self.body.bounding_box(layer.0)?;
        Ok((low.coords.into(), high.coords.into()))
    }

    fn __repr__(&self) -> String {
        let volumes = self
            .body
            .layers()
            .iter()
            .map(|layer| layer.mass_properties().volume);
        let volumes: Vec<_> = volumes.map(|volume| format!("{volume:.4}")).collect();
        format!("<Body: layers of {} cm^3>", volumes.join(", "))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        self.recipe.reduced(py)
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
        let made: Vec<f64> = work(py, progress, move |_| {
            let rays = origins.into_par_iter().zip(directions).enumerate();
            rays.with_min_len(RAYS)
                .map(|(k, (from, along))| {
                    count(k, n);
                    of(&body, &Ray::new(Point3::from(from), Vector3::from(along))?)
                })
                .collect::<Result<_, _>>()
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
            body.regions::<T>(&grid, 0..nz, Sampling::Coverage { tolerance })
        })?;
        let coverage = array(py, made.coverage.concat(), &[n, nz, ny, nx])?;
        Ok((coverage.into_any(), made.labels))
    }
}

/// Counts the first of each `RAYS` of n rays as a unit of work.
fn count(k: usize, n: usize) {
    if k.is_multiple_of(RAYS) {
        simd_set::unit(n.div_ceil(RAYS));
    }
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
