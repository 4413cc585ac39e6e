//! Projectors with exact adjoints.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{RadonError, product};
use crate::simd::{InstructionSet, gather, scatter};
use crate::{ImageGrid, ParallelGeometry, Sample, StackOrder};

mod layout;
#[cfg(feature = "sprs")]
mod matrix;
mod operator;
mod rays;

use layout::{Stack, separate};
pub use operator::StackOperator;
use rays::{Owner, View, Window};

/// How a ray's length is divided among the pixels it meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kernel {
    /// Linear interpolation at each row (or column) that the ray crosses (Joseph 1982, doi:10.1109/TMI.1982.4307572).
    #[default]
    Joseph,
    /// The exact length of the ray within each pixel (Siddon 1985, doi:10.1118/1.595715).
    Siddon,
    /// The exact area of the bin's strip within each pixel, over the pitch: the mean of Siddon's lengths over the bin.
    Strip,
}

/// Side of the square tiles of pixels that stay in the cache; part of the definition of a ray sum's rounding.
const TILE: usize = 16;
/// Most memory for the interleaved copy of a block of images, when a block of 16 slices allows.
const BLOCK_BYTES: usize = 48 << 20;

/// The discrete Radon transform A of an image grid and its exact adjoint Aᵀ.
///
/// ```text
/// (A x)[view, bin] = sum over pixels of weight(view, bin, pixel) * x[pixel]        (value x length)
/// ```
///
/// The weights are lengths in the unit of the geometry, so that projections have their absolute scale. One traversal
/// makes the weights; forward gathers with them and adjoint scatters with the same numbers, so that <A x, y> = <x, Aᵀ y>
/// to rounding. The adjoint is not the back-projection of FBP: it has neither view weights nor the 1/pitch.
///
/// Any angles, offset, pitch, spacing, centre, odd or even sizes. The same bits come out for any number of threads and for
/// a slice alone or among others.
///
/// ```
/// use radon::{ImageGrid, Kernel, ParallelGeometry, Projector};
/// let geometry = ParallelGeometry::uniform(12, std::f64::consts::PI, 20, 0.5)?;
/// let projector = Projector::new(&geometry, &ImageGrid::new(16, 14, 0.5)?, Kernel::Joseph)?;
/// let x: Vec<f64> = (0..16 * 14).map(|i| f64::from(i % 7) - 3.0).collect();
/// let y: Vec<f64> = (0..12 * 20).map(|i| f64::from(i % 5) - 2.0).collect();
/// let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
/// let (ax, aty) = (projector.forward(&x)?, projector.adjoint(&y)?);
/// assert!((dot(&ax, &y) - dot(&x, &aty)).abs() < 1e-10);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Projector {
    geometry: ParallelGeometry,
    grid: ImageGrid,
    kernel: Kernel,
    instructions: InstructionSet,
    views: Vec<View>,
}

/// Work arrays of a [`Projector`], reusable by any projector of the same sample type; they grow to what a run needs.
#[derive(Debug, Default)]
pub struct ProjectorScratch<T> {
    pixels: Vec<T>,
    rays: Vec<T>,
}

/// What a run did and what it could leave out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProjectorReport {
    /// Slices that held signal.
    pub slices_projected: usize,
    /// Slices of zeros, whose result is zero without work.
    pub slices_skipped: usize,
}

impl Projector {
    /// Plans the projection of images on `grid` to sinograms of `geometry`.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] when the pitch is not between 1e-9 and 1e9 pixels or a ray is 1e12 pixels away;
    /// [`RadonError::TooLarge`] for an image of 2³² pixels.
    pub fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        kernel: Kernel,
    ) -> Result<Self, RadonError> {
        let pixels = product("image", row_stride(grid), grid.ny())?;
        if u32::try_from(pixels).is_err() {
            let (a, b) = (grid.nx(), grid.ny());
            return Err(RadonError::TooLarge {
                name: "image",
                a,
                b,
            });
        }
        let views = geometry
            .angles()
            .iter()
            .map(|&theta| View::new(geometry, grid, kernel, theta))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            geometry: geometry.clone(),
            grid: *grid,
            kernel,
            instructions: InstructionSet::detect(),
            views,
        })
    }

    /// The acquisition.
    pub fn geometry(&self) -> &ParallelGeometry {
        &self.geometry
    }

    /// The image grid.
    pub fn grid(&self) -> &ImageGrid {
        &self.grid
    }

    /// The same projector with another instruction set than the widest that the machine has, to compare them.
    ///
    /// # Errors
    /// [`RadonError::InstructionSetMissing`].
    pub fn with_instructions(mut self, instructions: InstructionSet) -> Result<Self, RadonError> {
        if !instructions.is_available() {
            return Err(RadonError::InstructionSetMissing {
                given: instructions,
            });
        }
        self.instructions = instructions;
        Ok(self)
    }

    /// The kernel.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Empty work arrays.
    pub fn scratch<T: Sample>(&self) -> ProjectorScratch<T> {
        ProjectorScratch {
            pixels: Vec::new(),
            rays: Vec::new(),
        }
    }

    /// A x: the sinogram `[view][bin]` of the image `[y][x]`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn forward<T: Sample>(&self, image: &[T]) -> Result<Vec<T>, RadonError> {
        self.forward_stack(image, 1, StackOrder::SliceViewBin)
    }

    /// Aᵀ y: the image `[y][x]` of the sinogram `[view][bin]`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn adjoint<T: Sample>(&self, sinogram: &[T]) -> Result<Vec<T>, RadonError> {
        self.adjoint_stack(sinogram, 1, StackOrder::SliceViewBin)
    }

    /// The projections, in the given order, of the volume `[slice][y][x]`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite, projections beyond the address space.
    pub fn forward_stack<T: Sample>(
        &self,
        volume: &[T],
        n_slices: usize,
        order: StackOrder,
    ) -> Result<Vec<T>, RadonError> {
        let len = product("projections", n_slices, self.geometry.sinogram_len())?;
        let mut projections = vec![T::ZERO; len];
        let mut scratch = self.scratch();
        self.forward_stack_into(volume, n_slices, order, &mut projections, &mut scratch)?;
        Ok(projections)
    }

    /// The adjoint of [`forward_stack`](Self::forward_stack): the volume `[slice][y][x]` of projections in the given order.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite, a volume beyond the address space.
    pub fn adjoint_stack<T: Sample>(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
    ) -> Result<Vec<T>, RadonError> {
        let len = product("volume", n_slices, self.grid.image_len())?;
        let mut volume = vec![T::ZERO; len];
        let mut scratch = self.scratch();
        self.adjoint_stack_into(projections, n_slices, order, &mut volume, &mut scratch)?;
        Ok(volume)
    }

    /// As [`forward_stack`](Self::forward_stack), into projections of the caller's.
    ///
    /// Cost: two multiply-adds for each slice, view and pixel (Joseph, Siddon). Work arrays: copies of a
    /// block of slices and of its projections.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn forward_stack_into<T: Sample>(
        &self,
        volume: &[T],
        n_slices: usize,
        order: StackOrder,
        projections: &mut [T],
        scratch: &mut ProjectorScratch<T>,
    ) -> Result<ProjectorReport, RadonError> {
        let (images, sinograms) = self.stacks(n_slices, order);
        images.check_length(volume.len())?;
        sinograms.check_length(projections.len())?;
        let slices = Slices::new(images.slices_with_signal(volume)?);
        let mut rows = sinograms.rows_mut(projections);
        slices.clear_empty(&mut rows);

        let stride = row_stride(&self.grid);
        let (nx, ny, n_bins) = (self.grid.nx(), self.grid.ny(), self.geometry.n_bins());
        let ProjectorScratch { pixels, rays } = scratch;
        for block in slices.blocks::<T>(self) {
            let lanes = self.instructions.lanes_for::<T>(block.len());
            pixels.resize(ny * stride * lanes, T::ZERO);
            rays.resize(self.views.len() * n_bins * lanes, T::ZERO);
            pixels
                .par_chunks_exact_mut(stride * lanes)
                .enumerate()
                .for_each(|(iy, row)| {
                    images.interleave(volume, iy, block, lanes, &mut row[..nx * lanes]);
                });
            let pixels = &*pixels;
            let per_job = self.views.len().div_ceil(2 * rayon::current_num_threads());
            rays.par_chunks_mut(per_job * n_bins * lanes)
                .zip(self.views.par_chunks(per_job))
                .zip(rows.par_chunks_mut(per_job))
                .for_each(|((rays, views), rows)| {
                    rays.fill(T::ZERO);
                    let mut taps = Vec::new();
                    for window in self.tiles(0..ny, stride, Owner::FirstPixel) {
                        for (view, sums) in views.iter().zip(rays.chunks_exact_mut(n_bins * lanes))
                        {
                            view.traverse(&window, &mut taps, |bin, taps| {
                                gather(
                                    self.instructions,
                                    pixels,
                                    taps,
                                    &mut sums[bin * lanes..][..lanes],
                                );
                            });
                        }
                    }
                    for (row, sums) in rows.iter_mut().zip(rays.chunks_exact(n_bins * lanes)) {
                        separate(sums, lanes, block, 0, row);
                    }
                });
        }
        Ok(slices.report())
    }

    /// As [`adjoint_stack`](Self::adjoint_stack), into a volume of the caller's.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn adjoint_stack_into<T: Sample>(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
        volume: &mut [T],
        scratch: &mut ProjectorScratch<T>,
    ) -> Result<ProjectorReport, RadonError> {
        let (images, sinograms) = self.stacks(n_slices, order);
        sinograms.check_length(projections.len())?;
        images.check_length(volume.len())?;
        let slices = Slices::new(sinograms.slices_with_signal(projections)?);
        let mut rows = images.rows_mut(volume);
        slices.clear_empty(&mut rows);

        let n_bins = self.geometry.n_bins();
        let ProjectorScratch { rays, .. } = scratch;
        for block in slices.blocks::<T>(self) {
            let lanes = self.instructions.lanes_for::<T>(block.len());
            rays.resize(self.views.len() * n_bins * lanes, T::ZERO);
            rays.par_chunks_exact_mut(n_bins * lanes)
                .enumerate()
                .for_each(|(view_idx, row)| {
                    sinograms.interleave(projections, view_idx, block, lanes, row);
                });
            let rays = &*rays;
            // A band of tiles a job: each pixel is summed by one job, in the order of views and bins.
            rows.par_chunks_mut(TILE)
                .enumerate()
                .for_each(|(band, rows)| {
                    let mut taps = Vec::new();
                    let mut tile = vec![T::ZERO; TILE * TILE * lanes];
                    let y = band * TILE..band * TILE + rows.len();
                    for mut window in self.tiles(y, TILE, Owner::EachPixel) {
                        window.origin = 0;
                        tile.fill(T::ZERO);
                        for (view, rays) in self.views.iter().zip(rays.chunks_exact(n_bins * lanes))
                        {
                            view.traverse(&window, &mut taps, |bin, taps| {
                                scatter(
                                    self.instructions,
                                    &mut tile,
                                    taps,
                                    &rays[bin * lanes..][..lanes],
                                );
                            });
                        }
                        for (row, sums) in rows.iter_mut().zip(tile.chunks_exact(TILE * lanes)) {
                            let sums = &sums[..window.x.len() * lanes];
                            separate(sums, lanes, block, window.x.start, row);
                        }
                    }
                });
        }
        Ok(slices.report())
    }

    fn stacks(&self, n_slices: usize, order: StackOrder) -> (Stack, Stack) {
        let images = Stack {
            name: "volume",
            n_slices,
            n_rows: self.grid.ny(),
            row_len: self.grid.nx(),
            order: StackOrder::SliceViewBin,
        };
        let sinograms = Stack {
            name: "projections",
            n_slices,
            n_rows: self.geometry.n_views(),
            row_len: self.geometry.n_bins(),
            order,
        };
        (images, sinograms)
    }

    /// The tiles of the given rows, in memory of the given row stride.
    fn tiles(
        &self,
        y: Range<usize>,
        row_stride: usize,
        owns: Owner,
    ) -> impl Iterator<Item = Window> {
        let nx = self.grid.nx();
        let corners = y
            .clone()
            .step_by(TILE)
            .flat_map(move |y0| (0..nx).step_by(TILE).map(move |x0| (x0, y0)));
        corners.map(move |(x0, y0)| Window {
            x: x0..(x0 + TILE).min(nx),
            y: y0..(y0 + TILE).min(y.end),
            row_stride,
            origin: y0 * row_stride + x0,
            owns,
        })
    }
}

/// Rows of an interleaved image start an odd number of pixels apart, lest all rows of a tile fall on the same cache lines.
fn row_stride(grid: &ImageGrid) -> usize {
    grid.nx() | 1
}

/// The slices of a run that hold signal.
struct Slices {
    active: Vec<usize>,
    n_slices: usize,
}

impl Slices {
    fn new(with_signal: Vec<bool>) -> Self {
        Self {
            active: (0..with_signal.len())
                .filter(|&slice| with_signal[slice])
                .collect(),
            n_slices: with_signal.len(),
        }
    }

    /// Zeros for the slices without signal.
    fn clear_empty<T: Sample>(&self, rows: &mut [Vec<&mut [T]>]) {
        for row in rows {
            for (slice, samples) in row.iter_mut().enumerate() {
                if self.active.binary_search(&slice).is_err() {
                    samples.fill(T::ZERO);
                }
            }
        }
    }

    /// Blocks of as many slices as the kernels take at once, fewer when the copy of a block would pass [`BLOCK_BYTES`].
    fn blocks<T>(&self, projector: &Projector) -> std::slice::Chunks<'_, usize> {
        let most = BLOCK_BYTES / (projector.grid.image_len() * size_of::<T>());
        // `lanes_for` knows 1, 2, 4 and 8 registers.
        let mut lanes = projector.instructions.lanes_for::<T>(self.active.len());
        let register = projector.instructions.lanes_for::<T>(2);
        while lanes > register && lanes > most {
            lanes /= 2;
        }
        self.active.chunks(lanes)
    }

    fn report(&self) -> ProjectorReport {
        ProjectorReport {
            slices_projected: self.active.len(),
            slices_skipped: self.n_slices - self.active.len(),
        }
    }
}
