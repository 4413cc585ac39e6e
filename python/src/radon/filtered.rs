//! Filtered back-projection.

use super::{Precision, PyGeometry, PyGrid, Stack, order_of};
use crate::arrays::{Given, Samples, array, samples};
use crate::errors::Failure;
use crate::values::{Whole, choice, named};
use crate::work::work;
use heart_phantom::radon::{
    EdgePolicy, FbpMethod, FbpOptions, FbpPlan, ImageGrid, Interpolation, ParallelGeometry,
    StackOrder,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, OnceLock};

/// Filtered back-projection from a geometry to a grid, planned once for many data.
///
/// Parameters
/// ----------
/// geometry : Geometry
///     Views and bins of the data.
/// grid : Grid
///     Pixels of the image.
/// window : str or dict, optional
///     `"ram-lak"`, `"shepp-logan"`, `"cosine"`, `"hamming"`, `"hann"`, `{"butterworth": {"order": 4}}` or `{"custom": [1.0, 0.5, 0.0]}`, gains
///     from frequency 0 to the cutoff.
/// cutoff : float
///     Fraction of the Nyquist frequency.
/// interpolation : {"linear", "band-limited"}
///     Interpolation of filtered rows.
/// edge : {"zero", "ellipse"}
///     Extrapolation beyond the ends of a row.
/// arc : {"complete", "extend", "truncate", "rescale"}, optional
///     Treatment of missing directions; by default an error.
/// ramp : bool
///     Whether rows are filtered.
/// region : tuple, optional
///     `((x0, x1), (y0, y1))`, the pixels to reconstruct.
/// method : {"auto", "direct", "fourier"}
///     Sum over views, or gridding.
/// memory : int, optional
///     Limit of work arrays in bytes.
///
/// Raises
/// ------
/// RadonError
///     If an option is out of its range, or directions are missing.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.radon import FbpPlan, Geometry, Grid
/// >>> geometry = Geometry.half_turn(90, 64, 0.5)
/// >>> chords = 2 * np.sqrt(np.maximum(100 - geometry.bins**2, 0))  # a disc of radius 10 and value 1
/// >>> image = FbpPlan(geometry, Grid.square(64, 0.5)).reconstruct(np.tile(chords, (90, 1)))
/// >>> bool(abs(image[32, 40] - 1) < 0.01)
/// True
#[pyclass(name = "FbpPlan", module = "heart_phantom.radon", frozen)]
#[derive(Debug)]
pub(crate) struct PyFbpPlan {
    plans: Arc<Plans>,
    /// The arguments by name, for pickling.
    options: Py<PyDict>,
}

/// One plan per precision, made on demand.
#[derive(Debug)]
struct Plans {
    geometry: ParallelGeometry,
    grid: ImageGrid,
    options: FbpOptions,
    single: OnceLock<FbpPlan<f32>>,
    double: OnceLock<FbpPlan<f64>>,
}

/// A precision with its plan.
trait Planned: Precision {
    fn known(plans: &Plans) -> &OnceLock<FbpPlan<Self>>;
}

impl Planned for f32 {
    fn known(plans: &Plans) -> &OnceLock<FbpPlan<f32>> {
        &plans.single
    }
}

impl Planned for f64 {
    fn known(plans: &Plans) -> &OnceLock<FbpPlan<f64>> {
        &plans.double
    }
}

impl Plans {
    fn plan<T: Planned>(&self) -> Result<&FbpPlan<T>, Failure> {
        let known = T::known(self);
        if let Some(plan) = known.get() {
            return Ok(plan);
        }
        let made = FbpPlan::new(&self.geometry, &self.grid, &self.options)?;
        // Another thread may have stored the same plan first.
        Ok(known.get_or_init(|| made))
    }

    fn reconstruct<T: Planned>(
        &self,
        data: &[T],
        stack: Stack,
        order: &str,
    ) -> Result<Vec<T>, Failure> {
        let plan = self.plan::<T>()?;
        Ok(plan.reconstruct_stack(data, stack.n(), order_of(order)?)?)
    }

    fn adjoint<T: Planned>(&self, images: &[T]) -> Result<Vec<T>, Failure> {
        let plan = self.plan::<T>()?;
        let images = images.chunks(plan.image_len());
        let sinograms = simd_set::parts(images).map(|(_part, image)| plan.adjoint(image));
        Ok(sinograms.collect::<Result<Vec<_>, _>>()?.concat())
    }
}

impl PyFbpPlan {
    fn make(
        py: Python<'_>,
        geometry: ParallelGeometry,
        grid: ImageGrid,
        options: FbpOptions,
        given: Bound<'_, PyDict>,
    ) -> Result<Self, Failure> {
        let plans = Plans {
            geometry,
            grid,
            options,
            single: OnceLock::new(),
            double: OnceLock::new(),
        };
        let plans = work(py, None, move |_| {
            plans.plan::<f32>()?;
            Ok::<_, Failure>(plans)
        })?;
        Ok(Self {
            plans: Arc::new(plans),
            options: given.unbind(),
        })
    }
}

/// An index range per axis, x and y.
type Region = ((Whole, Whole), (Whole, Whole));

#[pymethods]
impl PyFbpPlan {
    #[new]
    #[pyo3(signature = (geometry, grid, *, window = None, cutoff = 1.0, interpolation = "linear", edge = "zero", arc = None, ramp = true, region = None, method = "auto", memory = None))]
    #[expect(clippy::too_many_arguments, reason = "each by its name")]
    fn new(
        py: Python<'_>,
        geometry: &Bound<'_, PyGeometry>,
        grid: &Bound<'_, PyGrid>,
        window: Option<&Bound<'_, PyAny>>,
        cutoff: f64,
        interpolation: &str,
        edge: &str,
        arc: Option<&Bound<'_, PyAny>>,
        ramp: bool,
        region: Option<Region>,
        method: &str,
        memory: Option<Whole>,
    ) -> Result<Self, Failure> {
        let mut options = FbpOptions::default()
            .with_cutoff(cutoff)
            .with_interpolation(interpolation_of(interpolation)?)
            .with_edge(edge_of(edge)?)
            .with_method(method_of(method)?)
            .with_ramp(ramp);
        if let Some(window) = window {
            options = options.with_window(named("window", window)?);
        }
        if let Some(arc) = arc {
            options = options.with_arc(named("arc", arc)?);
        }
        if let Some(((x0, x1), (y0, y1))) = region {
            options = options.with_region(x0.0..x1.0, y0.0..y1.0);
        }
        if let Some(memory) = memory {
            options = options.with_memory(memory.0);
        }
        let given = PyDict::new(py);
        for (name, value) in [("window", window), ("arc", arc)] {
            given.set_item(name, value)?;
        }
        for (name, value) in [
            ("interpolation", interpolation),
            ("edge", edge),
            ("method", method),
        ] {
            given.set_item(name, value)?;
        }
        given.set_item("cutoff", cutoff)?;
        given.set_item("ramp", ramp)?;
        let region = region.map(|((x0, x1), (y0, y1))| ((x0.0, x1.0), (y0.0, y1.0)));
        given.set_item("region", region)?;
        given.set_item("memory", memory.map(|memory| memory.0))?;
        Self::make(py, geometry.get().0.clone(), grid.get().0, options, given)
    }

    /// Reconstructs the image of a sinogram, or the images of a stack.
    ///
    /// Parameters
    /// ----------
    /// sinogram : array_like
    ///     `[view][bin]`, or a stack in the given order. `float32` gives `float32`, all other numbers `float64`.
    /// order : {"view-slice-bin", "slice-view-bin"}
    ///     Index order of a stack of sinograms; the first is that of detector images, as `Phantom.views` returns them.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `[y][x]`, or `[slice][y][x]`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the sinogram has another shape.
    #[pyo3(signature = (sinogram, *, order = "view-slice-bin", progress = None))]
    fn reconstruct<'py>(
        &self,
        py: Python<'py>,
        sinogram: &Bound<'py, PyAny>,
        order: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let plans = self.plans.clone();
        let given = samples("sinogram", sinogram)?;
        let sizes = PyGeometry(plans.geometry.clone()).sizes();
        let stack = Stack::of_data(&given.shape, sizes, order_of(order)?)?;
        let shape = stack.image_shape(self.image());
        let order = order.to_owned();
        Ok(match given.samples {
            Samples::Single(data) => {
                let made = work(py, progress, move |_| {
                    plans.reconstruct(&data, stack, &order)
                })?;
                array(py, made, &shape)?.into_any()
            }
            Samples::Double(data) => {
                let made = work(py, progress, move |_| {
                    plans.reconstruct(&data, stack, &order)
                })?;
                array(py, made, &shape)?.into_any()
            }
        })
    }

    /// The transpose of the reconstruction, applied to an image `[y][x]` or to images `[slice][y][x]`.
    ///
    /// Parameters
    /// ----------
    /// image : array_like
    ///     `float32` gives `float32`, all other numbers `float64`.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     A sinogram `[view][bin]`, or sinograms `[slice][view][bin]`.
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If the plan has the `edge` `"ellipse"`, or band-limited interpolation.
    #[pyo3(signature = (image, *, progress = None))]
    fn adjoint<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let plans = self.plans.clone();
        let given = samples("image", image)?;
        let stack = Stack::of_images("image", &given.shape, self.image())?;
        let shape = stack.data_shape(self.geometry().sizes(), StackOrder::SliceViewBin);
        Ok(match given.samples {
            Samples::Single(images) => array(
                py,
                work(py, progress, move |_| plans.adjoint(&images))?,
                &shape,
            )?
            .into_any(),
            Samples::Double(images) => array(
                py,
                work(py, progress, move |_| plans.adjoint(&images))?,
                &shape,
            )?
            .into_any(),
        })
    }

    /// Shape of a reconstructed image, `(ny, nx)`: of the grid, or of the region.
    #[getter]
    fn image_shape(&self) -> (usize, usize) {
        self.image().into()
    }

    /// The geometry of the data.
    #[getter]
    fn geometry(&self) -> PyGeometry {
        PyGeometry(self.plans.geometry.clone())
    }

    /// The whole grid.
    #[getter]
    fn grid(&self) -> PyGrid {
        PyGrid(self.plans.grid)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> ((PyGeometry, PyGrid), Bound<'py, PyDict>) {
        (
            (self.geometry(), self.grid()),
            self.options.bind(py).clone(),
        )
    }

    fn __repr__(&self) -> String {
        let ([views, bins], [ny, nx]) = (self.geometry().sizes(), self.image());
        let window = format!("{:?}", self.plans.options.window);
        format!("<FbpPlan: {views} views of {bins} bins to {ny} x {nx} pixels, {window}>")
    }
}

impl PyFbpPlan {
    /// Shape of a reconstructed image.
    fn image(&self) -> [usize; 2] {
        match &self.plans.options.region {
            None => PyGrid(self.plans.grid).sizes(),
            Some((x, y)) => [y.len(), x.len()],
        }
    }
}

fn interpolation_of(name: &str) -> PyResult<Interpolation> {
    let among = [
        ("linear", Interpolation::Linear),
        ("band-limited", Interpolation::BandLimited),
    ];
    choice("interpolation", name, &among)
}

fn edge_of(name: &str) -> PyResult<EdgePolicy> {
    let among = [("zero", EdgePolicy::Zero), ("ellipse", EdgePolicy::Ellipse)];
    choice("edge", name, &among)
}

fn method_of(name: &str) -> PyResult<FbpMethod> {
    let tolerance = FbpMethod::AUTO_TOLERANCE;
    let among = [
        ("auto", FbpMethod::Auto),
        ("direct", FbpMethod::Direct),
        ("fourier", FbpMethod::Fourier { tolerance }),
    ];
    choice("method", name, &among)
}

/// Reconstructs the image `[y][x]` of a sinogram `[view][bin]` at `angles` in radians, in one call.
///
/// For many sinograms and all options use `FbpPlan`.
///
/// Parameters
/// ----------
/// sinogram : array_like
///     Line integrals `[view][bin]`.
/// angles : array_like
///     Angles of the views in radians.
/// pitch, offset : float
///     Distance of the bins, and position of the middle of a row.
/// n : int, optional
///     Pixels per side, of the size of the pitch; by default the number of bins.
/// window, cutoff
///     As in `FbpPlan`.
/// progress : callable, tqdm bar or True, optional
///     Receives the completed fraction.
///
/// Returns
/// -------
/// ndarray
///     An image `[y][x]`; values are per length in the unit of the pitch.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.radon import fbp
/// >>> angles = np.arange(90) * np.pi / 90
/// >>> bins = np.arange(64) - 31.5
/// >>> image = fbp(np.tile(2 * np.sqrt(np.maximum(400 - bins**2, 0)), (90, 1)), angles)
/// >>> bool(abs(image[32, 40] - 1) < 0.01)
/// True
#[pyfunction]
#[pyo3(signature = (sinogram, angles, *, pitch = 1.0, offset = 0.0, n = None, window = None, cutoff = 1.0, progress = None))]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn fbp<'py>(
    py: Python<'py>,
    sinogram: &Bound<'py, PyAny>,
    angles: &Bound<'py, PyAny>,
    pitch: f64,
    offset: f64,
    n: Option<Whole>,
    window: Option<&Bound<'py, PyAny>>,
    cutoff: f64,
    progress: Option<&Bound<'py, PyAny>>,
) -> Result<Bound<'py, PyAny>, Failure> {
    let Given { shape, .. } = samples("sinogram", sinogram)?;
    let [_, bins] = shape[..] else {
        let error = crate::arrays::wrong_shape("sinogram", &shape, "[view][bin]");
        return Err(error.into());
    };
    let geometry = PyGeometry::new(angles, Whole(bins), pitch, offset)?;
    let grid = PyGrid::square(n.unwrap_or(Whole(bins)), pitch)?;
    let mut options = FbpOptions::default().with_cutoff(cutoff);
    if let Some(window) = window {
        options = options.with_window(named("window", window)?);
    }
    let given = PyDict::new(py);
    PyFbpPlan::make(py, geometry.0, grid.0, options, given)?.reconstruct(
        py,
        sinogram,
        "view-slice-bin",
        progress,
    )
}
