//! Geometry of views, bins and pixels.

use crate::arrays::{array, numbers};
use crate::errors::Failure;
use crate::values::Whole;
use heart_phantom::radon::{ImageGrid, ParallelGeometry};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::types::PyTuple;

type Doubles<'py> = Result<Bound<'py, PyArrayDyn<f64>>, Failure>;

/// A parallel-beam geometry: angles of the views, and a row of bins.
///
/// View theta has its bins along (cos theta, sin theta) and its rays along (-sin theta, cos theta). Bin k of n is centred at
/// `(k - (n - 1) / 2) * pitch + offset`, measured from the axis of rotation, the origin of the image plane. A sinogram is
/// `[view][bin]`.
///
/// Parameters
/// ----------
/// angles : array_like
///     Angles of the views in radians, which span at most two turns.
/// n_bins : int
///     Number of bins.
/// pitch : float
///     Distance of the bins.
/// offset : float
///     Position of the middle of the row, from the axis of rotation.
///
/// Raises
/// ------
/// RadonError
///     If a value is outside its range.
///
/// Examples
/// --------
/// >>> from heart_phantom.radon import Geometry
/// >>> Geometry.half_turn(90, 64, 0.5).shape
/// (90, 64)
#[pyclass(name = "Geometry", module = "heart_phantom.radon", frozen, eq)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PyGeometry(pub(crate) ParallelGeometry);

impl PyGeometry {
    /// Numbers of views and bins.
    pub(crate) fn sizes(&self) -> [usize; 2] {
        [self.0.n_views(), self.0.n_bins()]
    }
}

#[pymethods]
impl PyGeometry {
    #[new]
    #[pyo3(signature = (angles, n_bins, pitch = 1.0, *, offset = 0.0))]
    pub(crate) fn new(
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        pitch: f64,
        offset: f64,
    ) -> Result<Self, Failure> {
        let angles = numbers("angles", angles)?;
        let made = ParallelGeometry::new(angles, n_bins.0, pitch)?;
        Ok(Self(made.with_offset(offset)?))
    }

    /// Returns a geometry over any number of turns, such as that of a golden-angle acquisition.
    ///
    /// Parameters
    /// ----------
    /// angles : array_like
    ///     Angles of the views in radians.
    /// n_bins, pitch, offset
    ///     As in `Geometry`.
    ///
    /// Returns
    /// -------
    /// Geometry
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (angles, n_bins, pitch = 1.0, *, offset = 0.0))]
    fn from_radians(
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        pitch: f64,
        offset: f64,
    ) -> Result<Self, Failure> {
        let angles = numbers("angles", angles)?;
        let made = ParallelGeometry::from_radians(angles, n_bins.0, pitch)?;
        Ok(Self(made.with_offset(offset)?))
    }

    /// Returns a geometry with angles in degrees.
    ///
    /// Parameters
    /// ----------
    /// angles : array_like
    ///     Angles of the views in degrees.
    /// n_bins, pitch, offset
    ///     As in `Geometry`.
    ///
    /// Returns
    /// -------
    /// Geometry
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (angles, n_bins, pitch = 1.0, *, offset = 0.0))]
    fn from_degrees(
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        pitch: f64,
        offset: f64,
    ) -> Result<Self, Failure> {
        let angles = numbers("angles", angles)?;
        let made = ParallelGeometry::from_degrees(&angles, n_bins.0, pitch)?;
        Ok(Self(made.with_offset(offset)?))
    }

    /// Returns a geometry over half a turn: view k of n at k pi / n, every line once.
    ///
    /// Parameters
    /// ----------
    /// n_views : int
    ///     Number of views.
    /// n_bins, pitch
    ///     As in `Geometry`.
    ///
    /// Returns
    /// -------
    /// Geometry
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (n_views, n_bins, pitch = 1.0))]
    fn half_turn(n_views: Whole, n_bins: Whole, pitch: f64) -> Result<Self, Failure> {
        let made = ParallelGeometry::half_turn(n_views.0, n_bins.0, pitch)?;
        Ok(Self(made))
    }

    /// Returns a geometry over a full turn: view k of n at 2 k pi / n, every line from both sides.
    ///
    /// Parameters
    /// ----------
    /// n_views : int
    ///     Number of views.
    /// n_bins, pitch
    ///     As in `Geometry`.
    ///
    /// Returns
    /// -------
    /// Geometry
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (n_views, n_bins, pitch = 1.0))]
    fn full_turn(n_views: Whole, n_bins: Whole, pitch: f64) -> Result<Self, Failure> {
        let made = ParallelGeometry::full_turn(n_views.0, n_bins.0, pitch)?;
        Ok(Self(made))
    }

    /// Returns the geometry with the axis of rotation at a given bin.
    ///
    /// Parameters
    /// ----------
    /// bin : float
    ///     Index, which may be fractional.
    ///
    /// Returns
    /// -------
    /// Geometry
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    fn with_rotation_bin(&self, bin: f64) -> Result<Self, Failure> {
        Ok(Self(self.0.clone().with_rotation_bin(bin)?))
    }

    /// Angles in radians, `float64[view]`.
    #[getter]
    fn angles<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        array(py, self.0.angles().to_vec(), &[self.0.n_views()])
    }

    /// Centres of the bins, `float64[bin]`.
    #[getter]
    fn bins<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let n = self.0.n_bins();
        let centres = (0..n).map(|k| self.0.bin_centre(k)).collect();
        array(py, centres, &[n])
    }

    /// Shape of a sinogram, `(views, bins)`.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        self.sizes().into()
    }

    /// Distance between bins.
    #[getter]
    fn pitch(&self) -> f64 {
        self.0.pitch()
    }

    /// Position of the middle of the row, from the axis of rotation.
    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset()
    }

    fn __repr__(&self) -> String {
        let [views, bins] = self.sizes();
        let (pitch, offset) = (self.0.pitch(), self.0.offset());
        format!("<Geometry: {views} views of {bins} bins {pitch} apart, offset {offset}>")
    }

    /// A geometry of its values, for pickling.
    #[staticmethod]
    fn _restore(
        angles: &Bound<'_, PyAny>,
        n_bins: Whole,
        pitch: f64,
        offset: f64,
    ) -> Result<Self, Failure> {
        Self::from_radians(angles, n_bins, pitch, offset)
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> Result<(Bound<'py, PyAny>, Bound<'py, PyTuple>), Failure> {
        let (angles, made) = (self.angles(py)?, &self.0);
        let values = (angles, made.n_bins(), made.pitch(), made.offset());
        let own = py.get_type::<Self>().getattr("_restore")?;
        Ok((own, values.into_pyobject(py)?))
    }
}

/// A rectangular grid of pixels: images `[y][x]`.
///
/// Pixel (ix, iy) is centred at `centre + (dx * (ix - (nx - 1) / 2), dy * (iy - (ny - 1) / 2))`.
///
/// Parameters
/// ----------
/// nx, ny : int
///     Number of columns and rows.
/// spacing : float or (float, float)
///     Distance of the pixels, (dx, dy).
/// centre : (float, float)
///     Centre of the grid, (x, y).
///
/// Raises
/// ------
/// RadonError
///     If a value is outside its range.
///
/// Examples
/// --------
/// >>> from heart_phantom.radon import Grid
/// >>> Grid(4, 3, 0.5, centre=(1.0, 0.0)).x.tolist()
/// [0.25, 0.75, 1.25, 1.75]
#[pyclass(name = "Grid", module = "heart_phantom.radon", frozen, eq)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PyGrid(pub(crate) ImageGrid);

impl PyGrid {
    /// Numbers of rows and columns.
    pub(crate) fn sizes(&self) -> [usize; 2] {
        [self.0.ny(), self.0.nx()]
    }
}

/// One number for both axes, or one for each.
#[derive(Debug, FromPyObject)]
enum Spacing {
    Both(f64),
    Each([f64; 2]),
}

#[pymethods]
impl PyGrid {
    #[new]
    #[pyo3(signature = (nx, ny, spacing = Spacing::Both(1.0), *, centre = [0.0, 0.0]), text_signature = "(nx, ny, spacing=1.0, *, centre=(0.0, 0.0))")]
    fn new(nx: Whole, ny: Whole, spacing: Spacing, centre: [f64; 2]) -> Result<Self, Failure> {
        let spacing = match spacing {
            Spacing::Both(spacing) => [spacing; 2],
            Spacing::Each(spacing) => spacing,
        };
        let made = ImageGrid::anisotropic(nx.0, ny.0, spacing)?;
        Ok(Self(made.with_centre(centre)?))
    }

    /// Returns a grid of square pixels about the origin.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     Pixels per side.
    /// spacing : float
    ///     Distance of the pixels.
    ///
    /// Returns
    /// -------
    /// Grid
    ///
    /// Raises
    /// ------
    /// RadonError
    ///     If a value is outside its range.
    #[staticmethod]
    #[pyo3(signature = (n, spacing = 1.0))]
    pub(crate) fn square(n: Whole, spacing: f64) -> Result<Self, Failure> {
        Ok(Self(ImageGrid::square(n.0, spacing)?))
    }

    /// Shape of an image, `(ny, nx)`.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        self.sizes().into()
    }

    /// Distances between pixels, (dx, dy).
    #[getter]
    fn spacing(&self) -> (f64, f64) {
        self.0.spacing().into()
    }

    /// Centre of the grid, (x, y).
    #[getter]
    fn centre(&self) -> (f64, f64) {
        self.0.centre().into()
    }

    /// Centres of the columns, `float64[x]`.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let n = self.0.nx();
        let x = (0..n).map(|ix| self.0.pixel_centre(ix, 0)[0]).collect();
        array(py, x, &[n])
    }

    /// Centres of the rows, `float64[y]`.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Doubles<'py> {
        let n = self.0.ny();
        let y = (0..n).map(|iy| self.0.pixel_centre(0, iy)[1]).collect();
        array(py, y, &[n])
    }

    fn __repr__(&self) -> String {
        let [ny, nx] = self.sizes();
        let ([dx, dy], [x, y]) = (self.0.spacing(), self.0.centre());
        format!("<Grid: {ny} x {nx} pixels of {dy} x {dx} about ({x}, {y})>")
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<NewGridArguments<'py>> {
        let options = PyDict::new(py);
        options.set_item("centre", self.0.centre())?;
        Ok(((self.0.nx(), self.0.ny(), self.spacing()), options))
    }
}

/// Arguments that restore a grid, positional and by name.
type NewGridArguments<'py> = ((usize, usize, (f64, f64)), Bound<'py, PyDict>);
