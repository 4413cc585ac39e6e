//! Which method a plan uses: a model of the cost of either.

use super::options::{FbpOptions, Interpolation, Method};
use crate::error::RadonError;
use crate::fourier::{Counts, Gridding, Response, check_tolerance};
use crate::simd::InstructionSet;
use crate::{ImageGrid, ParallelGeometry, Sample};

/// Bytes of work arrays and of one slice of data up to which [`Method::Auto`] uses the Fourier method: half of the default of
/// [`FbpOptions::memory`]; the other half is left for the work arrays of each thread.
const MOST_AUTO_BYTES: usize = 256 << 20;

/// The plan of the Fourier method, if a plan of these options and of `n_pixels` pixels uses it.
pub(super) fn plan<T: Sample>(
    geometry: &ParallelGeometry,
    grid: &ImageGrid,
    options: &FbpOptions,
    instructions: InstructionSet,
    n_pixels: usize,
) -> Result<Option<Gridding<T>>, RadonError> {
    let response = match options.interpolation {
        Interpolation::Linear => Response::Lines,
        fine @ Interpolation::BandLimited => Response::FineLines(fine.upsampling() as f64),
    };
    let new = |tolerance| Gridding::new(geometry, grid, tolerance, instructions, response);
    match options.method {
        Method::Direct => Ok(None),
        Method::Fourier { tolerance } => {
            check_tolerance(tolerance)?;
            new(tolerance).map(Some)
        }
        Method::Auto => {
            let Ok(counts) = Counts::new(geometry, grid, response) else {
                return Ok(None);
            };
            let updates = n_pixels as f64 * geometry.n_views() as f64;
            if fourier_cost::<T>(&counts) > updates {
                return Ok(None);
            }
            let data = (geometry.sinogram_len() + grid.image_len()) * size_of::<T>();
            let fits = |plan: &Gridding<T>| plan.work_bytes(0) + data <= MOST_AUTO_BYTES;
            Ok(new(Method::AUTO_TOLERANCE).ok().filter(fits))
        }
    }
}

/// Cost of a slice by Fourier transforms, in updates of the direct sum.
///
/// The unit costs are ratios of times that the bench `slices` measured on one processor with AVX2. They depend on the sample type alone,
/// so that every machine chooses alike; with AVX-512 or the baseline the crossover lies at somewhat larger or smaller images.
fn fourier_cost<T>(counts: &Counts) -> f64 {
    // Of one sample that is spread, and of a number in a transform for each doubling of its length.
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
