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
    /// [`RadonError::TooLarge`] if rows or weights exceed the memory.
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
        let (mut columns, mut weights) = (Vec::new(), Vec::new());
        let mut rays = Rays::default();
        for (view_idx, view) in self.views.iter().enumerate() {
            let window = match view.steps_are_rows() {
                true => &by_rows,
                false => &by_columns,
            };
            view.traverse(self.instructions, window, 0..n_bins, &mut rays);
            for (bin, range) in rays.iter() {
                let pairs = rays.pairs.iter(range);
                let taps =
                    pairs.flat_map(|(at, near, far)| [(at, near), (at + window.strides[0], far)]);
                let mut row: Vec<(usize, T)> = taps
                    .filter(|&(_, weight)| weight != T::ZERO)
                    .map(|(at, weight)| {
                        (
                            (at / stride).wrapping_sub(1),
                            (at % stride).wrapping_sub(1),
                            weight,
                        )
                    })
                    .filter(|&(y, x, _)| y < ny && x < nx)
                    .map(|(y, x, weight)| (y * nx + x, weight))
                    .collect();
                row.sort_unstable_by_key(|&(column, _)| column);
                row_starts[view_idx * n_bins + bin + 1] = row.len();
                let held = columns.len();
                let more = columns.try_reserve(row.len());
                if more.and(weights.try_reserve(row.len())).is_err() {
                    return Err(RadonError::TooLarge {
                        what: "weights of the matrix",
                        a: held + row.len(),
                        b: 1,
                    });
                }
                for (column, weight) in row {
                    columns.push(column);
                    weights.push(weight);
                }
            }
        }
        for i in 1..row_starts.len() {
            row_starts[i] += row_starts[i - 1];
        }
        let shape = (self.geometry.sinogram_len(), nx * ny);
        Ok(CsMat::new(shape, row_starts, columns, weights))
    }
}
