//! The SPECT operator and its adjoint.

use super::{Precision, PyGeometry, PyGrid};
use crate::arrays::{Given, Samples, array, check_shape, numbers, of, samples};
use crate::errors::Failure;
use crate::values::{Whole, named};
use crate::work::{Progress, work};
use heart_phantom::radon::{
    Collimator, LinearOperator, RadonError, SliceAxis, SpectGeometry, SpectOperator, SpectOptions,
    Subset,
};
use heart_phantom::scene::CollimatorSettings;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::{Arc, OnceLock};

/// SPECT projections A of a volume: attenuated, with depth-dependent resolution, and their exact adjoint.
///
/// Volumes are `[layer][y][x]` on `grid`, views `[view][row][bin]` at the angles and bins of `geometry`; value times cm. Layers and rows
/// are centred on z = 0. In view theta the collimator face is at `radius` (-sin theta, cos theta).
///
/// Parameters
/// ----------
/// geometry : Geometry
///     Angles and bins of the views.
/// grid : Grid
///     Pixels of a layer.
/// n_layers : int
///     Number of layers.
/// layer_spacing : float
///     Distance of layers in cm.
/// radius : float or array_like
///     Distance of the collimator face from the axis of rotation in cm, one number or one per view.
/// n_rows, row_pitch : optional
///     Rows of the detector and their distance in cm; by default those of the layers.
/// collimator : dict, optional
///     The section `[collimator]` of a scene, such as `{"holes": "ge-lehr", "intrinsic_fwhm": 0.38}`; by default perfect resolution.
/// attenuation : array_like, optional
///     Attenuation coefficients `[layer][y][x]` in 1/cm.
/// tolerance : float
///     Largest deviation of the image of a point from the lattice Gaussian of its plane, relative to the peak; 1e-6 to 0.1.
/// progress : callable, tqdm bar or True, optional
///     Receives the completed fraction of the preparation.
///
/// Raises
/// ------
/// RadonError
///     If a value is outside its range.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.radon import Geometry, Grid, SpectOperator, osem
/// >>> water = np.full((8, 20, 20), 0.15)
/// >>> camera = SpectOperator(Geometry.full_turn(16, 20, 0.5), Grid.square(20, 0.5), 8, 0.5, 12.0,
/// ...     collimator={"holes": "ge-lehr", "intrinsic_fwhm": 0.38}, attenuation=water)
/// >>> rng = np.random.default_rng(1)
/// >>> x, y = rng.normal(size=camera.image_shape), rng.normal(size=camera.data_shape)
/// >>> bool(np.isclose(np.vdot(camera.forward(x), y), np.vdot(x, camera.adjoint(y))))
/// True
#[pyclass(name = "SpectOperator", module = "heart_phantom.radon", frozen)]
#[derive(Debug)]
pub(crate) struct PySpectOperator(pub(super) Arc<Spect>);

/// A SPECT operator with one plan per precision, made on demand.
#[derive(Debug)]
pub(super) struct Spect {
    geometry: SpectGeometry,
    grid: PyGrid,
    layers: SliceAxis,
    options: SpectOptions<f64>,
    /// The section `[collimator]`, as JSON, for pickling.
    collimator: Option<serde_json::Value>,
    single: OnceLock<SpectOperator<f32>>,
    double: OnceLock<SpectOperator<f64>>,
}

/// A precision with its plan.
pub(super) trait SpectSample: Precision {
    fn known(spect: &Spect) -> &OnceLock<SpectOperator<Self>>;
}

impl SpectSample for f32 {
    fn known(spect: &Spect) -> &OnceLock<SpectOperator<f32>> {
        &spect.single
    }
}

impl SpectSample for f64 {
    fn known(spect: &Spect) -> &OnceLock<SpectOperator<f64>> {
        &spect.double
    }
}

impl Spect {
    pub(super) fn operator<T: SpectSample>(&self) -> Result<&SpectOperator<T>, RadonError> {
        let known = T::known(self);
        if let Some(operator) = known.get() {
            return Ok(operator);
        }
        let map = self.options.attenuation.iter().map(|&mu| T::of(mu));
        let options = SpectOptions::default()
            .with_collimator(self.options.collimator)
            .with_attenuation(map.collect())
            .with_tolerance(self.options.tolerance);
        let made = SpectOperator::new(&self.geometry, &self.grid.0, &self.layers, &options)?;
        // Another thread may have stored the same plan first.
        Ok(known.get_or_init(|| made))
    }

    pub(super) fn image_shape(&self) -> [usize; 3] {
        let [ny, nx] = self.grid.sizes();
        [self.layers.n_slices(), ny, nx]
    }

    pub(super) fn data_shape(&self) -> [usize; 3] {
        let (views, rows) = (self.geometry.views(), self.geometry.rows());
        [views.n_views(), rows.n_slices(), views.n_bins()]
    }

    pub(super) fn subsets<T: SpectSample>(
        &self,
        n: usize,
    ) -> Result<Vec<Subset<SpectOperator<T>, T>>, RadonError> {
        self.operator::<T>()?.subsets(n)
    }

    fn apply<T: SpectSample>(&self, given: &[T], adjoint: bool) -> Result<Vec<T>, RadonError> {
        let operator = self.operator::<T>()?;
        match adjoint {
            true => operator.adjoint(given),
            false => operator.forward(given),
        }
    }
}

impl PySpectOperator {
    fn apply<'py>(
        &self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        given: Given<Samples>,
        adjoint: bool,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let spect = self.0.clone();
        let shape = match adjoint {
            true => spect.image_shape(),
            false => spect.data_shape(),
        };
        Ok(match given.samples {
            Samples::Single(x) => {
                let made = work(py, progress, move |_| spect.apply(&x, adjoint))?;
                array(py, made, &shape)?.into_any()
            }
            Samples::Double(x) => {
                let made = work(py, progress, move |_| spect.apply(&x, adjoint))?;
                array(py, made, &shape)?.into_any()
            }
        })
    }
}

fn one_or_each(what: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    let Given { samples, shape } = of::<f64>(what, given)?;
    match (shape.len(), &samples[..]) {
        (0, &[one]) => Ok(vec![one; n]),
        _ => numbers(what, given),
    }
}

#[pymethods]
impl PySpectOperator {
    #[new]
    #[pyo3(signature = (geometry, grid, n_layers, layer_spacing, radius, *, n_rows = None, row_pitch = None, collimator = None, attenuation = None, tolerance = 1e-3, progress = None))]
    #[expect(clippy::too_many_arguments, reason = "each by its name")]
    fn new(
        py: Python<'_>,
        geometry: &Bound<'_, PyGeometry>,
        grid: &Bound<'_, PyGrid>,
        n_layers: Whole,
        layer_spacing: f64,
        radius: &Bound<'_, PyAny>,
        n_rows: Option<Whole>,
        row_pitch: Option<f64>,
        collimator: Option<&Bound<'_, PyAny>>,
        attenuation: Option<&Bound<'_, PyAny>>,
        tolerance: f64,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, Failure> {
        let views = &geometry.get().0;
        let layers = SliceAxis::new(n_layers.0, layer_spacing)?;
        let n_rows = n_rows.map_or(n_layers.0, |n| n.0);
        let rows = SliceAxis::new(n_rows, row_pitch.unwrap_or(layer_spacing))?;
        let radii = one_or_each("radius", radius, views.n_views())?;
        let mut options = SpectOptions::default().with_tolerance(tolerance);
        let settings: Option<CollimatorSettings> = collimator
            .map(|given| named("collimator", given))
            .transpose()?;
        if let Some(settings) = &settings {
            options = options.with_collimator(settings.response()?);
        }
        let mut spect = Spect {
            geometry: SpectGeometry::new(views, &rows, radii)?,
            grid: *grid.get(),
            layers,
            options: SpectOptions::default(),
            collimator: settings
                .as_ref()
                .map(serde_json::to_value)
                .transpose()
                .map_err(|error| Failure::internal(&error))?,
            single: OnceLock::new(),
            double: OnceLock::new(),
        };
        if let Some(map) = attenuation {
            let map = of::<f64>("attenuation", map)?;
            check_shape("attenuation", &map.shape, &spect.image_shape())?;
            options = options.with_attenuation(map.samples);
        }
        spect.options = options;
        let spect = work(py, progress, move |_| {
            spect.operator::<f32>()?;
            Ok::<_, RadonError>(spect)
        })?;
        Ok(Self(Arc::new(spect)))
    }

    /// A x: the views `[view][row][bin]` of a volume `[layer][y][x]`.
    ///
    /// Parameters
    /// ----------
    /// image : array_like
    ///     The volume. `float32` gives `float32`, all other numbers `float64`.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Views, value times cm.
    #[pyo3(signature = (image, *, progress = None))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let given = samples("image", image)?;
        check_shape("image", &given.shape, &self.0.image_shape())?;
        self.apply(py, progress, given, false)
    }

    /// The adjoint of A, applied to views `[view][row][bin]`.
    ///
    /// Parameters
    /// ----------
    /// data : array_like
    ///     The views. `float32` gives `float32`, all other numbers `float64`.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     A volume `[layer][y][x]`.
    #[pyo3(signature = (data, *, progress = None))]
    fn adjoint<'py>(
        &self,
        py: Python<'py>,
        data: &Bound<'py, PyAny>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let given = samples("data", data)?;
        check_shape("data", &given.shape, &self.0.data_shape())?;
        self.apply(py, progress, given, true)
    }

    /// Shape of a volume, `(layers, ny, nx)`.
    #[getter]
    fn image_shape(&self) -> (usize, usize, usize) {
        self.0.image_shape().into()
    }

    /// Shape of the views, `(views, rows, bins)`.
    #[getter]
    fn data_shape(&self) -> (usize, usize, usize) {
        self.0.data_shape().into()
    }

    /// Angles and bins of the views.
    #[getter]
    fn geometry(&self) -> PyGeometry {
        PyGeometry(self.0.geometry.views().clone())
    }

    /// Pixels of a layer.
    #[getter]
    fn grid(&self) -> PyGrid {
        self.0.grid
    }

    fn __repr__(&self) -> String {
        let ([nz, ny, nx], [views, rows, bins]) = (self.0.image_shape(), self.0.data_shape());
        let [blurred, attenuated] = [
            self.0.options.collimator != Collimator::default(),
            !self.0.options.attenuation.is_empty(),
        ]
        .map(|has| if has { "with" } else { "without" });
        format!(
            "<SpectOperator: {nz} x {ny} x {nx} voxels to {views} views of {rows} x {bins} bins, {blurred} collimator, {attenuated} attenuation>"
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> Result<(Bound<'py, PyTuple>, Bound<'py, PyDict>), Failure> {
        let spect = &self.0;
        let n_views = spect.geometry.views().n_views();
        let arguments = (
            self.geometry(),
            self.grid(),
            spect.layers.n_slices(),
            spect.layers.spacing(),
            array(py, spect.geometry.radii().to_vec(), &[n_views])?,
        );
        let options = PyDict::new(py);
        let rows = spect.geometry.rows();
        options.set_item("n_rows", rows.n_slices())?;
        options.set_item("row_pitch", rows.spacing())?;
        options.set_item("tolerance", spect.options.tolerance)?;
        if let Some(collimator) = &spect.collimator {
            options.set_item("collimator", crate::values::to_python(py, collimator)?)?;
        }
        if !spect.options.attenuation.is_empty() {
            let map = array(py, spect.options.attenuation.clone(), &spect.image_shape())?;
            options.set_item("attenuation", map)?;
        }
        Ok((arguments.into_pyobject(py)?, options))
    }
}

/// Rejects views of another number than the parts.
pub(super) fn check_subsets(n: usize, views: usize) -> PyResult<()> {
    match (1..=views).contains(&n) {
        true => Ok(()),
        false => Err(PyValueError::new_err(format!(
            "subsets is {n}; it must be between 1 and {views}, the number of views"
        ))),
    }
}
