//! SPECT views as an operator for the iterative solvers.

use std::sync::Arc;

use super::geometry::SpectGeometry;
use super::options::SpectOptions;
use super::plan::Plan;
use super::run::Scratch;
use crate::error::{RadonError, length, room};
use crate::iterative::{check_samples, interleaved};
use crate::pool::Pool;
use crate::{ImageGrid, LinearOperator, Sample, SliceAxis, Subset};

/// SPECT projections of a volume: parallel, attenuated, with depth-dependent resolution.
///
/// ```text
/// (A x)[view, row, bin] = mean over row and bin of  ∫ G_sigma(d) * ( x(p) exp(-∫ from p to the camera of mu) ) dd      (value x cm)
/// ```
///
/// d is the distance from the collimator's face, G a Gaussian of the [`Collimator`](crate::Collimator)'s width at d along bins and rows,
/// mu the attenuation map. Volumes are `[layer][y][x]`, views `[view][row][bin]`.
///
/// # Method
///
/// Each view rotates the volume into planes parallel to its detector by the exact overlap areas of pixels and cells of the rotated grid
/// (layers and rows: lengths). This conserves counts and keeps a uniform volume uniform; without blur and attenuation the views are those
/// of [`Kernel::Strip`](crate::Kernel::Strip). The attenuation map is rotated in the same way. Emission is uniform over the depth of a
/// cell, so that its escape has a closed form. The distance of planes is the shorter side of a pixel. A few Gaussians blur all planes: the
/// variances of these Gaussians are exact means over the depth of a plane, and [`SpectOptions::tolerance`] bounds the deviation of a point's
/// image from the Gaussian of its plane. All entries of A are >= 0.
///
/// Voxels and bins add to the variance of a view of a smooth object, by an amount that depends on the angle. With pixels of side h and bins of
/// pitch p it exceeds that of the projection along the bins by p^2/12 in views along the grid whose bins coincide with pixels, and by up to
/// p^2/12 + h^2/6 in oblique views, reached from about 15 degrees on: h^2/12 because voxels contain means, h^2/12 because the rotation spreads
/// each voxel over its square. With h = p = 0.5 cm this is 0.021 and 0.0625 cm^2, with 0.25 cm a quarter. Along the rows it is p^2/12.
/// In a body of water 0.28 h^2 in all was measured in oblique views.
///
/// Zeng & Gullberg 1992, IEEE Trans. Nucl. Sci. 39, 1444, blur rotated planes depth by depth.
///
/// One traversal of the cells computes the weights of both directions: <A x, y> = <x, Aᵀ y> to rounding. Results are bitwise identical for
/// any number of threads.
///
/// # Limitations
///
/// Planes whose middle is behind the collimator face of a view are omitted: the orbit may cut corners of the grid, but not the body. A
/// map with attenuation behind a face is an error. Activity behind a face is not: it is missing in that view, so the radii must clear it.
/// Scatter and septal penetration are not modelled: see [`EmOptions::background`](crate::EmOptions::background).
///
/// # Cost
///
/// Either direction, per view and voxel: about ten multiply-adds, twice as many where there is attenuation; per view some tens of blurs of
/// an image. Memory: 4 to 5 overlaps per view and pixel, which all [`subsets`](Self::subsets) share, a copy of the volume and of the
/// attenuation map, and some tens of images for each of eight views per thread. Concurrent calls have separate work arrays, which are kept for later
/// calls.
///
/// ```
/// use radon::{
///     Collimator, EmOptions, ImageGrid, LinearOperator, ParallelGeometry, ParallelHoles, SliceAxis, SpectGeometry,
///     SpectOperator, SpectOptions, Stopping, osem,
/// };
/// let (views, axis) = (ParallelGeometry::full_turn(16, 20, 0.5)?, SliceAxis::new(6, 0.5)?);
/// let geometry = SpectGeometry::circular(&views, &axis, 8.0)?;
/// let grid = ImageGrid::square(20, 0.5)?;
/// let inside = |i: usize| { let [x, y] = grid.pixel_centre(i % 20, i / 20 % 20); x.hypot(y) < 4.0 };
/// let map: Vec<f64> = (0..6 * 400).map(|i| if inside(i) { 0.15 } else { 0.0 }).collect();
/// let options = SpectOptions::default()
///     .with_collimator(Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38)?)
///     .with_attenuation(map.clone());
/// let camera = SpectOperator::new(&geometry, &grid, &axis, &options)?;
///
/// // A hot rod in a warm cylinder, reconstructed from its projections.
/// let rod = |i: usize| { let [x, y] = grid.pixel_centre(i % 20, i / 20 % 20); (x - 1.5).hypot(y) < 1.2 };
/// let truth: Vec<f64> = (0..6 * 400).map(|i| map[i] / 0.15 + f64::from(u8::from(rod(i)))).collect();
/// let counts = camera.forward(&truth)?;
/// let mut image = vec![1.0; truth.len()];
/// let stopping = Stopping::default().with_max_iterations(20);
/// osem(&camera.subsets(4)?, &counts, &mut image, &EmOptions::default().with_stopping(stopping), radon::no_observer)?;
/// let mean = |x: &[f64]| { let hot: Vec<f64> = (0..x.len()).filter(|&i| rod(i)).map(|i| x[i]).collect();
///     hot.iter().sum::<f64>() / hot.len() as f64 };
/// assert!((mean(&image) / mean(&truth) - 1.0).abs() < 0.05);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[doc(alias("system matrix", "attenuation correction"))]
#[derive(Debug, Clone)]
pub struct SpectOperator<T> {
    plan: Arc<Plan<T>>,
    scratch: Arc<Pool<Scratch<T>>>,
    views: Vec<usize>,
}

impl<T: Sample> SpectOperator<T> {
    /// Plans the views of volumes on `grid` in `layers`.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for a tolerance outside [1e-6, 0.1], a pitch that is not between 1e-2 and 1e2 voxels, a response four
    /// standard deviations of which are more than 10 000 bins, a grid or detector a million pixels or 1e9 bins away from the axis, a
    /// voxel more than 5 mean free paths thick, or a radius with voxels of the map behind the face (coefficients above 5 % of the largest one,
    /// by more than the diagonal of a pixel); [`RadonError::WrongLength`],
    /// [`RadonError::BadSample`], [`RadonError::NegativeSample`] for the attenuation map; [`RadonError::TooLarge`]
    /// if layers, cells or the rows of one view exceed the memory.
    pub fn new(
        geometry: &SpectGeometry,
        grid: &ImageGrid,
        layers: &SliceAxis,
        options: &SpectOptions<T>,
    ) -> Result<Self, RadonError> {
        Ok(Self {
            plan: Arc::new(Plan::new(geometry, grid, layers, options)?),
            scratch: Arc::default(),
            views: (0..geometry.views().n_views()).collect(),
        })
    }

    /// Returns the same views with another attenuation map, as of another gate; an empty one for none. Both operators share the overlaps
    /// if the same pixels attenuate in any layer.
    ///
    /// # Errors
    /// As [`new`](Self::new) for the map.
    pub fn with_attenuation(&self, map: &[T]) -> Result<Self, RadonError> {
        Ok(Self {
            plan: Arc::new(self.plan.with_attenuation(map)?),
            ..self.clone()
        })
    }

    fn view_len(&self) -> usize {
        self.plan.frame.geometry.view_len()
    }

    /// Returns the indices of these views in the orbit.
    #[must_use]
    pub fn views(&self) -> &[usize] {
        &self.views
    }

    /// Returns `n_subsets` parts of these views for OSEM, which share one plan: part k contains the views k, k + `n_subsets`, k + 2 `n_subsets` ...
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no subset, [`RadonError::OutOfRange`] for more subsets than views, [`RadonError::TooLarge`] if the
    /// indices of the samples exceed the memory.
    pub fn subsets(&self, n_subsets: usize) -> Result<Vec<Subset<Self, T>>, RadonError> {
        let n_views = self.views.len();
        interleaved(n_subsets, n_views, self.view_len(), |views| {
            self.subset(views)
        })
    }

    /// Returns the operator of the views at these positions in [`views`](Self::views), with the indices of their samples in the data of this
    /// operator.
    fn subset(&self, views: &[usize]) -> Result<Subset<Self, T>, RadonError> {
        let view_len = self.view_len();
        let mut data = room("indices of a subset", views.len(), view_len)?;
        data.extend((views.iter()).flat_map(|view| view * view_len..(view + 1) * view_len));
        let operator = Self {
            views: views.iter().map(|&view| self.views[view]).collect(),
            ..self.clone()
        };
        Ok(Subset::new(operator, data))
    }

    fn check(&self, volume: &[T], data: &[T]) -> Result<(), RadonError> {
        length("volume", volume.len(), self.image_len())?;
        length("views", data.len(), self.data_len())
    }
}

impl<T: Sample> LinearOperator<T> for SpectOperator<T> {
    fn image_len(&self) -> usize {
        self.plan.frame.n_voxels
    }

    fn data_len(&self) -> usize {
        self.views.len() * self.view_len()
    }

    /// As the trait's; rejects a wrong length, NaN and infinity.
    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        self.check(image, data)?;
        check_samples("volume", image)?;
        self.scratch.with(Scratch::default, |scratch| {
            self.plan.forward(&self.views, image, data, scratch)
        })
    }

    /// As the trait's; rejects a wrong length, NaN and infinity.
    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        self.check(image, data)?;
        check_samples("views", data)?;
        self.scratch.with(Scratch::default, |scratch| {
            self.plan.adjoint(&self.views, data, image, scratch)
        })
    }
}
