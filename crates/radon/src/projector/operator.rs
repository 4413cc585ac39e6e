//! Projectors as operators for the iterative solvers.

use super::{Projector, Scratch};
use crate::error::{RadonError, product, room};
use crate::iterative::interleaved;
use crate::pool::Pool;
use crate::{LinearOperator, ParallelGeometry, Sample, StackOrder, Subset};

/// The projector of one slice: images `[y][x]`, data `[view][bin]`. Rejects a wrong length and a sample that is NaN or infinite.
impl<T: Sample> LinearOperator<T> for Projector {
    fn image_len(&self) -> usize {
        self.grid.image_len()
    }

    fn data_len(&self) -> usize {
        self.geometry.sinogram_len()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        let order = StackOrder::SliceViewBin;
        self.run_forward(image, 1, order, data, &mut Scratch::default())
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        let order = StackOrder::SliceViewBin;
        self.run_adjoint(data, 1, order, image, &mut Scratch::default())
    }
}

/// The projector of a stack of slices: volumes `[slice][y][x]`, data in a given order. Rejects a wrong length and a sample that is NaN or infinite.
///
/// Cost forward: two multiply-adds for each slice, view and pixel (Joseph); adjoint: a store for each of them, too. Work arrays: a copy of
/// the projections of at most 256 slices and, forward, of a band of their images. The adjoint processes a few slices one by one: a copy of one
/// sinogram, and 20 bytes for each of its views and bins or rows of pixels. Concurrent calls have separate work arrays, which are kept for later
/// calls.
#[derive(Debug, Clone)]
pub struct StackOperator<T> {
    projector: Projector,
    n_slices: usize,
    order: StackOrder,
    scratch: Pool<Scratch<T>>,
}

impl Projector {
    /// This projector for `n_slices` slices, as an operator for the iterative solvers.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`] when the volume or the projections do not fit the address space.
    pub fn stack_operator<T: Sample>(
        &self,
        n_slices: usize,
        order: StackOrder,
    ) -> Result<StackOperator<T>, RadonError> {
        product("volume", n_slices, self.grid.image_len())?;
        product("projections", n_slices, self.geometry.sinogram_len())?;
        Ok(StackOperator {
            projector: self.clone(),
            n_slices,
            order,
            scratch: Pool::default(),
        })
    }
}

impl<T: Sample> StackOperator<T> {
    /// Returns `n_subsets` parts of the views for OSEM: part k contains the views k, k + `n_subsets`, k + 2 `n_subsets` ..., with the
    /// indices of their samples in the data of all views.
    ///
    /// ```
    /// use radon::{ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector, StackOrder};
    /// let geometry = ParallelGeometry::half_turn(8, 16, 1.0)?;
    /// let projector = Projector::new(&geometry, &ImageGrid::square(11, 1.0)?, Kernel::Strip)?;
    /// let operator = projector.stack_operator::<f32>(1, StackOrder::ViewSliceBin)?;
    /// let part = &operator.subsets(4)?[1]; // views 1 and 5
    /// assert_eq!(part.operator().data_len(), 2 * 16);
    /// assert_eq!((part.data()[0], part.data()[16]), (16, 5 * 16));
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no subset, [`RadonError::OutOfRange`] for more subsets than views, [`RadonError::TooLarge`] if the
    /// indices of the samples exceed the memory.
    pub fn subsets(&self, n_subsets: usize) -> Result<Vec<Subset<Self, T>>, RadonError> {
        let geometry = &self.projector.geometry;
        let view_len = self.n_slices * geometry.n_bins();
        interleaved(n_subsets, geometry.n_views(), view_len, |views| {
            self.subset(views)
        })
    }

    /// Returns the operator of some views, in this order, with the indices of their samples in the data of all views.
    fn subset(&self, views: &[usize]) -> Result<Subset<Self, T>, RadonError> {
        let geometry = &self.projector.geometry;
        let n_bins = geometry.n_bins();
        let angles: Vec<f64> = views.iter().map(|&v| geometry.angles()[v]).collect();
        let part = ParallelGeometry::from_radians(angles, n_bins, geometry.pitch())?
            .with_offset(geometry.offset())?;
        let (_, sinograms) = self.projector.stacks(self.n_slices, self.order);
        let row = |view: usize, slice: usize| {
            let start = sinograms.row_start(view, slice);
            start..start + n_bins
        };
        let slices = 0..self.n_slices;
        let mut data = room("indices of a subset", views.len() * self.n_slices, n_bins)?;
        match self.order {
            StackOrder::ViewSliceBin => data
                .extend((views.iter()).flat_map(|&v| slices.clone().flat_map(move |s| row(v, s)))),
            StackOrder::SliceViewBin => {
                data.extend(slices.flat_map(|s| views.iter().flat_map(move |&v| row(v, s))));
            }
        }
        let Projector { grid, kernel, .. } = &self.projector;
        let projector =
            Projector::new(&part, grid, *kernel)?.with_instructions(self.projector.instructions)?;
        let operator = projector.stack_operator(self.n_slices, self.order)?;
        Ok(Subset::new(operator, data))
    }
}

impl<T: Sample> LinearOperator<T> for StackOperator<T> {
    fn image_len(&self) -> usize {
        self.n_slices * self.projector.grid.image_len()
    }

    fn data_len(&self) -> usize {
        self.n_slices * self.projector.geometry.sinogram_len()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        let (n, order) = (self.n_slices, self.order);
        self.scratch.with(Default::default, |scratch| {
            (self.projector).run_forward(image, n, order, data, scratch)
        })
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        let (n, order) = (self.n_slices, self.order);
        self.scratch.with(Default::default, |scratch| {
            (self.projector).run_adjoint(data, n, order, image, scratch)
        })
    }
}
