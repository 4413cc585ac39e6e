//! The transpose of filtered back-projection.

use super::FbpPlan;
use super::options::EdgePolicy;
use crate::error::{RadonError, length, zeros};
use crate::fourier::GriddingScratch;
use crate::iterative::check_samples;
use crate::{Sample, parallel};

impl<T: Sample> FbpPlan<T> {
    /// Applies the transpose of [`reconstruct`](Self::reconstruct) to an image `[y][x]`: the gradient of a function of the image with respect
    /// to the sinogram `[view][bin]`.
    ///
    /// ```text
    /// g_v(k) = w_v * sum_j  pitch * h(s_k - s_j) * sum over (x, y) of  f(x, y) * max(0, 1 - |bin(x, y, v) - j|)
    /// ```
    ///
    /// <R p, f> = <p, Rᵀ f> to the rounding of the positions. Cost: two additions per view and pixel.
    ///
    /// # Errors
    /// [`RadonError::WrongLength`], [`RadonError::BadSample`]; [`RadonError::NoAdjoint`] with band-limited interpolation by the direct method, with
    /// [`EdgePolicy::Ellipse`], or a region with the Fourier method.
    pub fn adjoint(&self, image: &[T]) -> Result<Vec<T>, RadonError> {
        length("image", image.len(), self.image_len())?;
        check_samples("image", image)?;
        let (n_bins, (x, y)) = (self.geometry.n_bins(), self.steps.region());
        let part = self.image_len() != self.grid.image_len();
        for (missing, what) in [
            (self.filter.out_len() != n_bins, "linear interpolation"),
            (
                self.options.edge != EdgePolicy::Zero,
                "the edge policy zero",
            ),
            (
                part && self.gridding.is_some(),
                "the whole grid, or the direct method",
            ),
        ] {
            if missing {
                return Err(RadonError::NoAdjoint { what });
            }
        }
        let mut rows = zeros("sinogram", self.geometry.n_views(), n_bins)?;
        let steps = 1 + usize::from(self.gridding.is_some());
        if let Some(gridding) = &self.gridding {
            let _part = simd_set::part(0..1, steps);
            gridding.project(image, &mut rows, &mut GriddingScratch::default());
        }
        let _part = simd_set::part(steps - 1..steps, steps);
        let new = || self.filter.scratch();
        parallel::chunks_with(&mut rows, n_bins, &new, &|scratch, view, row| {
            simd_set::unit(self.geometry.n_views());
            let (sin, cos) = self.geometry.angles()[view].sin_cos();
            let pixels = image.chunks_exact(x.len()).zip(y.clone());
            let pixels = pixels.take(if self.gridding.is_some() { 0 } else { y.len() });
            for (pixels, iy) in pixels {
                for (&pixel, ix) in pixels.iter().zip(x.clone()) {
                    let [x, y] = self.grid.pixel_centre(ix, iy);
                    let bin = self.geometry.bin_at(x * cos + y * sin) + 1.0;
                    if bin < 0.0 || bin >= (n_bins + 1) as f64 {
                        continue;
                    }
                    // Bin 0 has the index 1; beyond the ends a filtered row is zero.
                    let before = bin as usize;
                    let weight = T::of(bin - before as f64);
                    if before > 0 {
                        row[before - 1] += pixel * (T::of(1.0) - weight);
                    }
                    if before < n_bins {
                        row[before] += pixel * weight;
                    }
                }
            }
            let given = row.to_vec();
            let given = std::iter::once(&given[..]);
            for filtered in self.filter.filter(given, self.scales[view], scratch) {
                row.copy_from_slice(filtered);
            }
        });
        Ok(rows)
    }
}
