//! Gaussian filters of volumes.

use crate::error::{length, product, within, zeros};
use crate::lattice::lattice_gaussian;
use crate::{RadonError, Sample, parallel};

/// Smallest weight of a filter, relative to the largest.
const CUT: f64 = 1e-8;
/// Voxels that a thread filters at a time.
const CHUNK: usize = 4096;

/// Filters a volume of `shape` `[n_z, n_y, n_x]`, x fastest, by Gaussians with the standard deviations `sigma` along z, y and x, in voxels;
/// 0 leaves an axis unchanged.
///
/// ```text
/// filtered_i = sum over j of w_(i - j) volume_j along each axis,   sum of w_k = 1,   sum of k^2 w_k = sigma^2
/// ```
///
/// The weights are the discrete normal distribution, whose variance is exact at any width, without those below 1e-8 of the largest. Voxels
/// outside the volume are zero, so that the sum over the volume is conserved except near its ends. Voxels that are not finite spread over the
/// filter's width. Costs about 12 sigma
/// multiplications per voxel and axis, and memory for a second volume.
///
/// ```
/// let mut volume = vec![0.0f32; 9 * 9 * 9];
/// volume[4 * 81 + 4 * 9 + 4] = 1.0;
/// radon::gaussian_filter(&mut volume, [9, 9, 9], [0.0, 0.5, 0.5])?;
/// assert!((volume.iter().sum::<f32>() - 1.0).abs() < 1e-6);
/// assert_eq!(volume[3 * 81 + 4 * 9 + 4], 0.0); // not along z
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// [`RadonError::WrongLength`] if the volume has another length; [`RadonError::OutOfRange`] or [`RadonError::NotFinite`] unless each `sigma` is
/// between 0 and 1e6; [`RadonError::TooLarge`].
#[doc(alias("smooth", "blur", "postfilter", "gaussian"))]
pub fn gaussian_filter<T: Sample>(
    volume: &mut [T],
    [nz, ny, nx]: [usize; 3],
    sigma: [f64; 3],
) -> Result<(), RadonError> {
    let slice = product("pixels of a slice", ny, nx)?;
    length("volume", volume.len(), product("voxels", nz, slice)?)?;
    let mut weights = Vec::with_capacity(3);
    for sigma in sigma {
        within("standard deviation of a filter in voxels", sigma, 0.0, 1e6)?;
        weights.push(lattice_gaussian(sigma * sigma, CUT)?);
    }
    let mut before: Vec<T> = zeros("voxels of a filter", nz, slice)?;
    for (weights, [n, stride]) in weights.iter().zip([[nz, slice], [ny, nx], [nx, 1]]) {
        if weights.len() > 1 {
            before.copy_from_slice(volume);
            along(&before, volume, weights, [n, stride]);
        }
    }
    Ok(())
}

/// Filters along an axis with `n` voxels, `stride` apart.
fn along<T: Sample>(before: &[T], volume: &mut [T], weights: &[f64], [n, stride]: [usize; 2]) {
    parallel::chunks(volume, CHUNK, &|chunk, values| {
        for (k, value) in values.iter_mut().enumerate() {
            let own = chunk * CHUNK + k;
            let at = own / stride % n;
            let mut sum = weights[0] * before[own].f64();
            for (k, weight) in weights.iter().enumerate().skip(1).take(at.max(n - 1 - at)) {
                if k <= at {
                    sum += weight * before[own - k * stride].f64();
                }
                if k < n - at {
                    sum += weight * before[own + k * stride].f64();
                }
            }
            *value = T::of(sum);
        }
    });
}
