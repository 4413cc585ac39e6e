//! Choice of the method by a model of its cost.

use super::options::{FbpMethod, FbpOptions};
use crate::error::RadonError;
use crate::fourier::{Counts, Gridding, Response, check_tolerance};
use crate::simd::InstructionSet;
use crate::{ImageGrid, ParallelGeometry, Sample};

/// Limit of [`FbpMethod::Auto`] on work arrays and one slice of data for the Fourier method: half of the default of [`FbpOptions::memory`];
/// the other half is for the work arrays of the threads.
const MOST_AUTO_BYTES: usize = 256 << 20;

/// Returns the plan of the Fourier method, if these options and `n_pixels` pixels select it.
pub(super) fn plan<T: Sample>(
    geometry: &ParallelGeometry,
    grid: &ImageGrid,
    options: &FbpOptions,
    instructions: InstructionSet,
    n_pixels: usize,
) -> Result<Option<Gridding<T>>, RadonError> {
    let response = Response::Lines(options.interpolation.upsampling());
    let new = |tolerance| Gridding::new(geometry, grid, tolerance, instructions, response);
    match options.method {
        FbpMethod::Direct => Ok(None),
        FbpMethod::Fourier { tolerance } => {
            check_tolerance(tolerance)?;
            new(tolerance).map(Some)
        }
        FbpMethod::Auto => {
            let Ok(counts) = Counts::new(geometry, grid, response) else {
                return Ok(None);
            };
            let updates = n_pixels as f64 * geometry.n_views() as f64;
            if fourier_cost::<T>(&counts) > updates {
                return Ok(None);
            }
            let data = (geometry.sinogram_len() + grid.image_len()) * size_of::<T>();
            let fits = |plan: &Gridding<T>| plan.work_bytes(0) + data <= MOST_AUTO_BYTES;
            Ok(new(FbpMethod::AUTO_TOLERANCE).ok().filter(fits))
        }
    }
}

/// Returns the cost of a slice by Fourier transforms, in updates of the direct sum.
///
/// The unit costs are ratios of times of the benchmark `slices` on one processor with AVX2. They depend only on the sample type, so that
/// all machines choose alike; with AVX-512 or the baseline the crossover is at somewhat larger or smaller images.
fn fourier_cost<T>(counts: &Counts) -> f64 {
    // Costs of a spread sample, and of a number in a transform per doubling of its length.
    let (spread, transform) = match size_of::<T>() {
        4 => (125.0, 1.5),
        _ => (167.0, 2.0),
    };
    let fft = |len: usize| len as f64 * (len as f64).log2() * transform;
    let [nx, ny] = counts.cells;
    // Three real transforms a row, of one and a half times its length on average; complex columns, real rows.
    let rows = counts.n_views as f64 * 4.5 * fft(counts.row_len);
    let image = nx as f64 * fft(ny) + counts.ny as f64 * fft(nx);
    counts.n_spread * spread + rows + image
}
