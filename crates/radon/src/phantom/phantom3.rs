//! Sums of solid shapes.

use super::shape3::Shape3;
use super::{BinSampling, Phantom};
use crate::error::{RadonError, zeros};
use crate::{ImageGrid, ParallelGeometry, Sample, SliceAxis, StackOrder, parallel};

/// A sum of solid shapes, each times a value: its volumes, line integrals and sinograms are exact.
///
/// ```
/// use radon::{BinSampling, ParallelGeometry, Phantom3, SliceAxis, StackOrder};
/// let head = Phantom3::shepp_logan(10.0)?;
/// let geometry = ParallelGeometry::half_turn(4, 40, 0.5)?;
/// let slices = SliceAxis::new(40, 0.5)?;
/// let sinogram: Vec<f32> = head.sinogram(&geometry, &slices, BinSampling::Mean, StackOrder::ViewSliceBin)?;
/// let mass = sinogram[..1600].iter().map(|&x| f64::from(x)).sum::<f64>() * 0.25;
/// assert!((mass / head.integral() - 1.0).abs() < 1e-6);
/// # Ok::<(), radon::RadonError>(())
/// ```
pub type Phantom3 = Phantom<Shape3>;

impl Phantom<Shape3> {
    /// Value at a point.
    #[must_use]
    pub fn value(&self, point: [f64; 3]) -> f64 {
        self.sum(|shape| shape.value(point))
    }

    /// Integral over space.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.sum(Shape3::integral)
    }

    /// Integral along the ray x cos θ + y sin θ = s at height `z`.
    #[must_use]
    pub fn line_integral(&self, theta: f64, s: f64, z: f64) -> f64 {
        self.sum(|shape| shape.line_integral(theta, s, z))
    }

    /// The volume `[slice][y][x]` of voxel means, as [`Shape3::box_mean`]: exact for ellipsoids and prisms but for rounding, which grows as the
    /// voxels shrink; Gaussians to 1e-15 of their peak.
    ///
    /// Cost: voxels near a shape, with more work only where a surface cuts a voxel. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`].
    pub fn volume<T: Sample>(
        &self,
        grid: &ImageGrid,
        slices: &SliceAxis,
    ) -> Result<Vec<T>, RadonError> {
        let mut volume = zeros("volume", slices.n_slices(), grid.image_len())?;
        let [dx, dy] = grid.spacing();
        let sides = [dx, dy, slices.spacing()];
        let half_diagonal = 0.5 * sides.iter().map(|s| s * s).sum::<f64>().sqrt();
        parallel::chunks(&mut volume, grid.nx(), &|row_idx, row| {
            let (slice_idx, iy) = (row_idx / grid.ny(), row_idx % grid.ny());
            let z = slices.slice_centre(slice_idx);
            let y = grid.pixel_centre(0, iy)[1];
            let near: Vec<_> = self
                .objects
                .iter()
                .filter(|(_, shape)| {
                    let (c, reach) = shape.bounding_ball();
                    (y - c[1]).hypot(z - c[2]) <= reach + half_diagonal
                })
                .collect();
            for (ix, voxel) in row.iter_mut().enumerate() {
                let x = grid.pixel_centre(ix, iy)[0];
                let sum: f64 = near
                    .iter()
                    .map(|(value, shape)| value * shape.box_mean([x, y, z], sides))
                    .sum();
                *voxel = T::of(sum);
            }
        });
        Ok(volume)
    }

    /// The sinograms of all slices, in closed form; [`BinSampling::Mean`] averages over the bin and the slice's height.
    ///
    /// Cost: bins near a shape. Bitwise identical for any number of threads.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`].
    pub fn sinogram<T: Sample>(
        &self,
        geometry: &ParallelGeometry,
        slices: &SliceAxis,
        sampling: BinSampling,
        order: StackOrder,
    ) -> Result<Vec<T>, RadonError> {
        let mut sinogram = zeros("sinogram", slices.n_slices(), geometry.sinogram_len())?;
        let size = match sampling {
            BinSampling::Centre => [0.0; 2],
            BinSampling::Mean => [geometry.pitch(), slices.spacing()],
        };
        parallel::chunks(&mut sinogram, geometry.n_bins(), &|row_idx, row| {
            let (view_idx, slice_idx) = match order {
                StackOrder::ViewSliceBin => {
                    (row_idx / slices.n_slices(), row_idx % slices.n_slices())
                }
                StackOrder::SliceViewBin => {
                    (row_idx % geometry.n_views(), row_idx / geometry.n_views())
                }
            };
            let theta = geometry.angles()[view_idx];
            let z = slices.slice_centre(slice_idx);
            for (value, shape) in &self.objects {
                let (c, reach) = shape.bounding_ball();
                if (z - c[2]).abs() > reach + 0.5 * size[1] {
                    continue;
                }
                let middle = c[0] * theta.cos() + c[1] * theta.sin();
                for (bin_idx, bin) in row.iter_mut().enumerate() {
                    let s = geometry.bin_centre(bin_idx);
                    if (s - middle).abs() > reach + 0.5 * size[0] {
                        continue;
                    }
                    let integral = match sampling {
                        BinSampling::Centre => shape.line_integral(theta, s, z),
                        BinSampling::Mean => shape.bin_mean(theta, [s, z], size),
                    };
                    *bin += T::of(value * integral);
                }
            }
        });
        Ok(sinogram)
    }
}
