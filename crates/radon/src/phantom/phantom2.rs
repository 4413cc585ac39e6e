//! Sums of plane shapes.

use super::shape2::Shape2;
use super::{BinSampling, Phantom};
use crate::error::{RadonError, zeros};
use crate::{ImageGrid, ParallelGeometry, Sample, parallel};

/// A sum of plane shapes, each times a value: its images, line integrals and sinograms are exact.
///
/// ```
/// use radon::{BinSampling, ImageGrid, ParallelGeometry, Phantom2, Shape2};
/// let disc = Shape2::ellipse([0.5, -0.3], [2.0, 2.0], 0.0)?;
/// let phantom = Phantom2::new([(1.5, disc)])?;
/// let image: Vec<f64> = phantom.image(&ImageGrid::square(64, 0.1)?)?;
/// let mass: f64 = image.iter().sum::<f64>() * 0.1 * 0.1;
/// assert!((mass - phantom.integral()).abs() < 1e-10); // pixel averages preserve the integral
/// let geometry = ParallelGeometry::half_turn(8, 64, 0.1)?;
/// let sinogram: Vec<f64> = phantom.sinogram(&geometry, BinSampling::Mean)?;
/// assert!((sinogram[..64].iter().sum::<f64>() * 0.1 - phantom.integral()).abs() < 1e-10);
/// # Ok::<(), radon::RadonError>(())
/// ```
pub type Phantom2 = Phantom<Shape2>;

impl Phantom<Shape2> {
    /// Value at a point.
    #[must_use]
    pub fn value(&self, point: [f64; 2]) -> f64 {
        self.sum(|shape| shape.value(point))
    }

    /// Integral over the plane.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.sum(Shape2::integral)
    }

    /// Integral along the line x cos θ + y sin θ = s.
    #[must_use]
    pub fn line_integral(&self, theta: f64, s: f64) -> f64 {
        self.sum(|shape| shape.line_integral(theta, s))
    }

    /// The image `[y][x]` of pixel means, as [`Shape2::rectangle_mean`]: exact for ellipses, rectangles and polygons; Gaussians to 1e-15 of
    /// their peak.
    ///
    /// Cost: pixels times shapes, with more work only where an outline cuts a pixel. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`].
    pub fn image<T: Sample>(&self, grid: &ImageGrid) -> Result<Vec<T>, RadonError> {
        let mut image = zeros("image", grid.nx(), grid.ny())?;
        parallel::chunks(&mut image, grid.nx(), &|iy, row| {
            for (ix, pixel) in row.iter_mut().enumerate() {
                let centre = grid.pixel_centre(ix, iy);
                let sides = grid.spacing();
                *pixel = T::of(self.sum(|shape| shape.rectangle_mean(centre, sides)));
            }
        });
        Ok(image)
    }

    /// The sinogram `[view][bin]`, in closed form.
    ///
    /// Cost: bins times shapes. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`].
    pub fn sinogram<T: Sample>(
        &self,
        geometry: &ParallelGeometry,
        sampling: BinSampling,
    ) -> Result<Vec<T>, RadonError> {
        let mut sinogram = zeros("sinogram", geometry.n_views(), geometry.n_bins())?;
        parallel::chunks(&mut sinogram, geometry.n_bins(), &|view, row| {
            let theta = geometry.angles()[view];
            for (bin_idx, bin) in row.iter_mut().enumerate() {
                let s = geometry.bin_centre(bin_idx);
                *bin = T::of(match sampling {
                    BinSampling::Centre => self.line_integral(theta, s),
                    BinSampling::Mean => {
                        self.sum(|shape| shape.bin_mean(theta, s, geometry.pitch()))
                    }
                });
            }
        });
        Ok(sinogram)
    }
}
