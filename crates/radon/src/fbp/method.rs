//! Whether a plan uses the Fourier method: a model of what either costs.

use super::options::{FbpOptions, Interpolation, Method};
use crate::error::RadonError;
use crate::fourier::{Counts, Gridding, Response, check_tolerance};
use crate::simd::InstructionSet;
use crate::{ImageGrid, ParallelGeometry, Sample};

/// The Fourier method, if a plan of these options and of so many pixels uses it.
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
    let new = |tolerance| T::gridding(geometry, grid, tolerance, instructions, response);
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
            let updates = n_pixels * geometry.n_views();
            if fourier_seconds::<T>(&counts, instructions)
                > direct_seconds::<T>(updates, instructions)
            {
                return Ok(None);
            }
            // Whatever the number of threads, whose part the other half of the budget is for.
            let data = (geometry.sinogram_len() + grid.image_len()) * size_of::<T>();
            let fits = |plan: &Gridding<T>| plan.work_bytes(0) + data <= options.memory / 2;
            Ok(new(Method::AUTO_TOLERANCE).ok().filter(fits))
        }
    }
}

/// Seconds of one thread for a slice of a stack by the sum over views, about. A slice alone takes twice as long, or more: where the two
/// methods are close, stacks have the better one.
fn direct_seconds<T>(updates: usize, set: InstructionSet) -> f64 {
    // Of one update; these and those below as the bench `slices` has them on an Intel Xeon of 2023.
    let each = match (set, size_of::<T>()) {
        (InstructionSet::Avx512, 4) => 0.13e-9,
        (InstructionSet::Avx2, 4) => 0.2e-9,
        (InstructionSet::Avx512 | InstructionSet::Avx2, _) => 0.3e-9,
        (_, 4) => 0.5e-9,
        _ => 1e-9,
    };
    updates as f64 * each
}

/// Seconds of one thread for a slice by Fourier transforms, about.
fn fourier_seconds<T>(counts: &Counts, set: InstructionSet) -> f64 {
    // Of one sample that is spread, and of a number in a transform for each doubling of its length.
    let (spread, transform) = match (set, size_of::<T>()) {
        (InstructionSet::Avx512, 4) => (20e-9, 0.3e-9),
        (InstructionSet::Avx2, 4) => (25e-9, 0.3e-9),
        (_, 4) => (50e-9, 0.6e-9),
        _ => (50e-9, 0.6e-9),
    };
    let fft = |len: usize| len as f64 * (len as f64).log2() * transform;
    let [nx, ny] = counts.cells;
    // Three real transforms a row, of one and a half times its length on average; complex columns, real rows.
    let rows = counts.n_views as f64 * 4.5 * fft(counts.row_len);
    let image = nx as f64 * fft(ny) + counts.ny as f64 * fft(nx);
    counts.n_spread * spread + rows + image
}
