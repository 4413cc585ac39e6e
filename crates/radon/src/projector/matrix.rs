//! The projector as a sparse matrix.

use sprs::CsMat;

use super::rays::{Owner, RayTaps, Window};
use super::{Projector, row_stride};
use crate::Sample;

impl Projector {
    /// The matrix A of one slice in compressed rows: row `view * n_bins + bin`, column `y * nx + x`, the very weights of
    /// [`forward`](Self::forward). Entries of weight zero are left out.
    ///
    /// Cost and memory: about 2 entries (Joseph, Siddon) for each view and pixel row a bin crosses.
    ///
    /// ```
    /// use radon::{ImageGrid, Kernel, ParallelGeometry, Projector};
    /// let geometry = ParallelGeometry::uniform(3, std::f64::consts::PI, 5, 1.0)?;
    /// let projector = Projector::new(&geometry, &ImageGrid::square(5, 1.0)?, Kernel::Strip)?;
    /// let matrix = projector.matrix::<f64>();
    /// assert_eq!(matrix.shape(), (15, 25));
    /// assert_eq!(matrix.get(2, 2), Some(&1.0)); // first view, middle bin, top row of pixels
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    pub fn matrix<T: Sample>(&self) -> CsMat<T> {
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        let stride = row_stride(&self.grid);
        let everything = Window {
            x: 0..nx,
            y: 0..ny,
            row_stride: stride,
            origin: 0,
            owns: Owner::FirstPixel,
        };
        let n_bins = self.geometry.n_bins();
        let mut row_starts = vec![0; self.geometry.sinogram_len() + 1];
        let (mut columns, mut weights) = (Vec::new(), Vec::new());
        let mut rays = RayTaps::new(self.instructions);
        for (view_idx, view) in self.views.iter().enumerate() {
            view.traverse(&everything, &mut rays);
            for (bin, taps) in rays.iter() {
                let mut row: Vec<(usize, T)> = taps
                    .iter()
                    .filter(|tap| tap.weight != T::ZERO)
                    .map(|tap| {
                        let at = tap.pixel as usize;
                        (at / stride * nx + at % stride, tap.weight)
                    })
                    .collect();
                row.sort_unstable_by_key(|&(column, _)| column);
                row_starts[view_idx * n_bins + bin + 1] = row.len();
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
        CsMat::new(shape, row_starts, columns, weights)
    }
}
