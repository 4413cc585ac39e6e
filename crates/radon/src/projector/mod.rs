//! Projectors with exact adjoints.

use crate::error::{RadonError, available, product, room, within};
use crate::simd::{InstructionSet, SortedBins};
use crate::{ImageGrid, ParallelGeometry};

mod alone;
mod blocks;
pub(crate) mod kernel;
#[cfg(feature = "sprs")]
mod matrix;
pub(crate) mod operator;
mod rays;
mod run;

use kernel::Kernel;
use rays::{Rays, View};

/// The discrete Radon transform A of an image grid and its exact adjoint Aᵀ.
///
/// ```text
/// (A x)[view, bin] = sum over pixels of weight(view, bin, pixel) * x[pixel]        (value x length)
/// ```
///
/// The weights are lengths in the unit of the geometry, so that projections have their absolute scale. One traversal
/// computes the weights; forward gathers with them and adjoint scatters with the same numbers, so that <A x, y> = <x, Aᵀ y>
/// to rounding. The adjoint is not the back-projection of FBP: it has neither view weights nor the factor 1/pitch.
/// For `f32` samples, the positions at which rays of Joseph cross a row of pixels are rounded to 2^-27 of a pixel.
///
/// Angles, offset, pitch, spacing, centre and sizes are arbitrary; pixels need not be square. Results are bitwise identical for any number of
/// threads and for a slice alone or among others. A slice of `f32` alone costs little more than its part of a stack unless bins are wider than
/// 1.9 pixels (forward) or finer than 0.7 pixels (adjoint), for strips wider than 5; a slice of `f64` alone costs as much as several in a stack.
///
/// ```
/// use radon::{ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector, adjoint_mismatch};
/// let geometry = ParallelGeometry::half_turn(12, 20, 0.5)?;
/// let projector = Projector::new(&geometry, &ImageGrid::new(16, 14, 0.5)?, Kernel::Joseph)?;
/// let projections = projector.forward(&[1.0; 16 * 14])?;
/// assert_eq!(projections.len(), 12 * 20);
/// assert!(adjoint_mismatch::<f64, _>(&projector, 1)? < 1e-14);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone)]
#[doc(alias("radon transform", "forward projection"))]
pub struct Projector {
    geometry: ParallelGeometry,
    grid: ImageGrid,
    kernel: Kernel,
    instructions: InstructionSet,
    views: Vec<View>,
}

/// Work arrays of a run, reusable by any projector of the same sample type. They grow as needed.
#[derive(Debug, Default)]
struct Scratch<T> {
    pixels: Vec<T>,
    rays: Vec<T>,
    found: Vec<Vec<Rays<T>>>,
    /// Buffer of a slice that is projected alone.
    slice: Vec<f32>,
    sorted: Vec<SortedBins>,
}

impl Projector {
    /// Plans the projection of images on `grid` to sinograms of `geometry`.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] when the pitch is not between 1e-9 and 1e9 pixels along x and y, a ray is 1e12 pixels away, or the image has
    /// 2³¹ pixels; [`RadonError::TooLarge`] if the views exceed the memory.
    pub fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        kernel: Kernel,
    ) -> Result<Self, RadonError> {
        let pixels = product("image", row_stride(grid.nx()), row_stride(grid.ny()))?;
        let most = f64::from(i32::MAX);
        within(
            "pixels of an image and its margin",
            pixels as f64,
            1.0,
            most,
        )?;
        for spacing in grid.spacing() {
            within("pitch in pixels", geometry.pitch() / spacing, 1e-9, 1e9)?;
        }
        let mut views = room("views of a projector", geometry.n_views(), 1)?;
        for &theta in geometry.angles() {
            views.push(View::new(geometry, grid, kernel, theta)?);
        }
        Ok(Self {
            geometry: geometry.clone(),
            grid: *grid,
            kernel,
            instructions: InstructionSet::detect(),
            views,
        })
    }

    /// The acquisition.
    #[must_use]
    pub fn geometry(&self) -> &ParallelGeometry {
        &self.geometry
    }

    /// The image grid.
    #[must_use]
    pub fn grid(&self) -> &ImageGrid {
        &self.grid
    }

    /// The same projector with another instruction set than the widest that the machine has, to compare them.
    ///
    /// # Errors
    /// [`RadonError::InstructionSetMissing`].
    pub fn with_instructions(mut self, instructions: InstructionSet) -> Result<Self, RadonError> {
        available(instructions)?;
        self.instructions = instructions;
        Ok(self)
    }

    /// The kernel.
    #[must_use]
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }
}

/// Returns the distance between rows of `n` pixels with a margin of one on either side: an odd number, to avoid cache conflicts between the
/// rows of a tile.
fn row_stride(n: usize) -> usize {
    (n + 2) | 1
}
