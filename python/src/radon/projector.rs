//! The projector and its adjoint.

use super::{PyGeometry, PyGrid, Stack, order_of};
use crate::arrays::{Given, Samples, array, samples};
use crate::errors::Failure;
use crate::values::choice;
use crate::work::{Progress, work};
use heart_phantom::radon::{Kernel, LinearOperator, Projector, RadonError, StackOrder};
use pyo3::prelude::*;
use std::sync::Arc;

/// The discrete Radon transform A of images on a grid, and its exact adjoint.
///
/// Parameters
/// ----------
/// geometry : Geometry
///     Views and bins of the data.
/// grid : Grid
///     Pixels of the images.
/// kernel : {"joseph", "strip"}
///     Linear interpolation, or exact bin averages.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from heart_phantom.radon import Geometry, Grid, Projector
/// >>> projector = Projector(Geometry.half_turn(12, 20, 0.5), Grid(16, 14, 0.5))
/// >>> rng = np.random.default_rng(1)
/// >>> x, y = rng.normal(size=(14, 16)), rng.normal(size=(12, 20))
/// >>> bool(np.isclose(np.vdot(projector.forward(x), y), np.vdot(x, projector.adjoint(y))))
/// True
#[pyclass(name = "Projector", module = "heart_phantom.radon", frozen)]
#[derive(Debug)]
pub(crate) struct PyProjector(pub(crate) Arc<Projector>);

const KERNELS: [(&str, Kernel); 2] = [("joseph", Kernel::Joseph), ("strip", Kernel::Strip)];

#[pymethods]
impl PyProjector {
    #[new]
    #[pyo3(signature = (geometry, grid, kernel = "joseph"))]
    fn new(
        py: Python<'_>,
        geometry: &Bound<'_, PyGeometry>,
        grid: &Bound<'_, PyGrid>,
        kernel: &str,
    ) -> Result<Self, Failure> {
        let kernel = choice("kernel", kernel, &KERNELS)?;
        let (geometry, grid) = (geometry.get().0.clone(), grid.get().0);
        let made = work(py, None, move |_| Projector::new(&geometry, &grid, kernel))?;
        Ok(Self(Arc::new(made)))
    }

    /// A x: the sinogram of an image, or of a stack of images.
    ///
    /// Parameters
    /// ----------
    /// image : array_like
    ///     `[y][x]`, or `[slice][y][x]`. `float32` gives `float32`, all other numbers `float64`.
    /// order : {"view-slice-bin", "slice-view-bin"}
    ///     Index order of a stack of sinograms; the first is that of detector images, as `Phantom.views` returns them.
    /// progress : callable, tqdm bar or True, optional
    ///     Receives the completed fraction.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     `[view][bin]`, or a stack in the given order; value times length.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the image has another shape.
    #[pyo3(signature = (image, *, order = "view-slice-bin", progress = None))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        order: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let given = samples("image", image)?;
        let stack = Stack::of_images("image", &given.shape, self.grid().sizes())?;
        let order = order_of(order)?;
        let shape = stack.data_shape(self.geometry().sizes(), order);
        self.apply(py, progress, given, &shape, move |projector, x| {
            x.forward(projector, stack.n(), order)
        })
    }

    /// The adjoint of A, applied to a sinogram or to a stack. It is not the back-projection of FBP.
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
    fn adjoint<'py>(
        &self,
        py: Python<'py>,
        sinogram: &Bound<'py, PyAny>,
        order: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let given = samples("sinogram", sinogram)?;
        let order = order_of(order)?;
        let stack = Stack::of_data(&given.shape, self.geometry().sizes(), order)?;
        let shape = stack.image_shape(self.grid().sizes());
        self.apply(py, progress, given, &shape, move |projector, y| {
            y.adjoint(projector, stack.n(), order)
        })
    }

    /// The geometry of the data.
    #[getter]
    pub(super) fn geometry(&self) -> PyGeometry {
        PyGeometry(self.0.geometry().clone())
    }

    /// The grid of the images.
    #[getter]
    pub(super) fn grid(&self) -> PyGrid {
        PyGrid(*self.0.grid())
    }

    /// Shape of an image, `(ny, nx)`.
    #[getter]
    fn image_shape(&self) -> (usize, usize) {
        self.grid().sizes().into()
    }

    /// Shape of a sinogram, `(views, bins)`.
    #[getter]
    fn data_shape(&self) -> (usize, usize) {
        self.geometry().sizes().into()
    }

    fn __getnewargs__(&self) -> (PyGeometry, PyGrid, &'static str) {
        (self.geometry(), self.grid(), self.kernel())
    }

    fn __repr__(&self) -> String {
        let ([views, bins], [ny, nx]) = (self.geometry().sizes(), self.grid().sizes());
        let kernel = self.kernel();
        format!("<Projector: {ny} x {nx} pixels to {views} views of {bins} bins, {kernel}>")
    }
}

impl PyProjector {
    fn kernel(&self) -> &'static str {
        let known = KERNELS.iter().find(|(_, k)| *k == self.0.kernel());
        known.map_or("", |(name, _)| name)
    }

    fn apply<'py>(
        &self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        given: Given<Samples>,
        shape: &[usize],
        make: impl FnOnce(&Projector, Samples) -> Result<Samples, RadonError> + Send + 'static,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let projector = self.0.clone();
        let made = work(py, progress, move |_| make(&projector, given.samples))?;
        Ok(match made {
            Samples::Single(made) => array(py, made, shape)?.into_any(),
            Samples::Double(made) => array(py, made, shape)?.into_any(),
        })
    }
}

impl Samples {
    fn forward(self, a: &Projector, n: usize, order: StackOrder) -> Result<Self, RadonError> {
        Ok(match self {
            Self::Single(x) => {
                Self::Single(a.stack_operator(n, order).and_then(|a| a.forward(&x))?)
            }
            Self::Double(x) => {
                Self::Double(a.stack_operator(n, order).and_then(|a| a.forward(&x))?)
            }
        })
    }

    fn adjoint(self, a: &Projector, n: usize, order: StackOrder) -> Result<Self, RadonError> {
        Ok(match self {
            Self::Single(y) => {
                Self::Single(a.stack_operator(n, order).and_then(|a| a.adjoint(&y))?)
            }
            Self::Double(y) => {
                Self::Double(a.stack_operator(n, order).and_then(|a| a.adjoint(&y))?)
            }
        })
    }
}
