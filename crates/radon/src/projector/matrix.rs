//! The projector as a sparse matrix.

use sprs::CsMat;

use super::rays::{Rays, Window};
use super::{Projector, row_stride};
use crate::Sample;
use crate::error::{RadonError, zeros};

impl Projector {
    /// Returns the matrix A of one slice in compressed rows: row `view * n_bins + bin`, column `y * nx + x`, with the weights of
    /// [`forward`](crate::LinearOperator::forward). Zeros are omitted.
    ///
    /// Cost and memory: about 2 entries (Joseph) for each view and pixel row that a bin crosses.
    ///
    /// ```
    /// use radon::{ImageGrid, Kernel, ParallelGeometry, Projector};
    /// let geometry = ParallelGeometry::half_turn(3, 5, 1.0)?;
    /// let projector = Projector::new(&geometry, &ImageGrid::square(5, 1.0)?, Kernel::Strip)?;
    /// let matrix = projector.matrix::<f64>()?;
    /// assert_eq!(matrix.shape(), (15, 25));
    /// assert_eq!(matrix.get(2, 2), Some(&1.0)); // first view, middle bin, top row of pixels
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    ///
    /// # Errors
    /// [`RadonError::TooLarge`] if rows, weights or the pixels of a ray exceed the memory.
    #[cfg_attr(docsrs, doc(cfg(feature = "sprs")))]
    pub fn matrix<T: Sample>(&self) -> Result<CsMat<T>, RadonError> {
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        // The image within a margin of a pixel.
        let stride = row_stride(nx);
        let window = |across, along, strides| Window {
            across,
            along,
            strides,
            origin: stride + 1,
        };
        let by_rows = window(0..nx, 0..ny, [1, stride]);
        let by_columns = window(0..ny, 0..nx, [stride, 1]);
        let n_bins = self.geometry.n_bins();
        let mut row_starts = zeros("rows of the matrix", self.geometry.sinogram_len() + 1, 1)?;
        let (what, b) = ("weights of the matrix", 1);
        let too_large = |a| RadonError::TooLarge { what, a, b };
        let (mut columns, mut weights) = (Vec::new(), Vec::new());
        let (mut rays, mut row) = (Rays::default(), Vec::new());
        for (i, row_len) in row_starts[1..].iter_mut().enumerate() {
            let (view, bin) = (&self.views[i / n_bins], i % n_bins);
            let window = match view.steps_are_rows() {
                true => &by_rows,
                false => &by_columns,
            };
            let most = view.most_pairs(window);
            rays.pairs.try_reserve(most).map_err(|_| too_large(most))?;
            view.traverse(self.instructions, window, bin..bin + 1, &mut rays);
            let pairs = rays.pairs.iter(0..rays.pairs.len());
            let taps =
                pairs.flat_map(|(at, near, far)| [(at, near), (at + window.strides[0], far)]);
            let entry = |(at, weight): (usize, T)| {
                let [y, x] = [at / stride, at % stride].map(|k| k.wrapping_sub(1));
                (weight != T::ZERO && y < ny && x < nx).then(|| (y * nx + x, weight))
            };
            let most = 2 * rays.pairs.len();
            row.clear();
            row.try_reserve(most).map_err(|_| too_large(most))?;
            row.extend(taps.filter_map(entry));
            row.sort_unstable_by_key(|&(column, _)| column);
            *row_len = row.len();
            let more = columns.try_reserve(row.len());
            more.and(weights.try_reserve(row.len()))
                .map_err(|_| too_large(columns.len() + row.len()))?;
            columns.extend(row.iter().map(|&(column, _)| column));
            weights.extend(row.iter().map(|&(_, weight)| weight));
        }
        for i in 1..row_starts.len() {
            row_starts[i] += row_starts[i - 1];
        }
        let shape = (self.geometry.sinogram_len(), nx * ny);
        Ok(CsMat::new(shape, row_starts, columns, weights))
    }
}
