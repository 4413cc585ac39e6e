//! Filtered back-projection: the plan and its runs.

use std::ops::Range;
use std::sync::Arc;

use crate::error::{RadonError, available, finite, length, product, within, zeros};
use crate::fourier::{Gridding, GriddingScratch};
use crate::geometry::{ImageGrid, ParallelGeometry};
use crate::parallel;
use crate::sample::Sample;
use crate::simd::{InstructionSet, first_block, lanes_for};
use crate::stack::{Stack, StackOrder, aligned};

mod adjoint;
mod backproject;
mod fourier;
mod method;
pub(crate) mod options;
mod rows;

use backproject::Steps;
use options::{FbpOptions, FbpReport, Interpolation};
use rows::RowFilter;

/// Filtered back-projection, planned once and run many times, by many threads (`&self`, `Send + Sync`).
///
/// ```text
/// q_v(s)  = sum_k  pitch * h(s - s_k) * p_v(s_k)              h: the windowed band-limited ramp
/// f(x, y) = sum_v  w_v * q_v(x cos theta_v + y sin theta_v)   w: quadrature weights of the views
/// ```
///
/// With projections in (value x length) the image is in (value), without further factors. Results are bitwise identical for any number of
/// threads, and for a slice alone or among others.
///
/// The data limit the accuracy of the mean of an image: chords through the bin centres of a disc with a radius of R bins miss its area by up
/// to 0.374 R^(-3/2) of it (square-root singularities). In a centred disc these errors are the same in all views, and the mean of the image within
/// R - 5 bins was up to 0.65 R^(-3/2) off. Bin averages, which detectors measure, preserve the area: for centred discs with R from 9 to 98, the
/// mean within R - 2 bins was within 5e-4.
///
/// ```
/// use radon::{FbpOptions, FbpPlan, ImageGrid, ParallelGeometry};
/// let geometry = ParallelGeometry::half_turn(90, 64, 0.1)?;
/// let grid = ImageGrid::square(64, 0.1)?;
/// let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default())?;
/// // A disc of radius 2 and value 1 at the origin: every view holds its chords.
/// let view = (0..64).map(|k| 2.0 * (4.0 - geometry.bin_centre(k).powi(2)).max(0.0).sqrt() as f32);
/// let sinogram: Vec<f32> = view.cycle().take(90 * 64).collect();
/// let image = plan.reconstruct(&sinogram)?;
/// assert!((image[32 * 64 + 40] - 1.0).abs() < 0.01);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[doc(alias("iradon", "backprojection"))]
#[derive(Clone)]
pub struct FbpPlan<T: Sample> {
    geometry: ParallelGeometry,
    grid: ImageGrid,
    filter: RowFilter<T>,
    /// Per view: quadrature weight divided by pitch, which the filter omits; without a filter the weight.
    scales: Vec<T>,
    steps: Steps<T>,
    /// The Fourier method, if used.
    gridding: Option<Arc<Gridding<T>>>,
    instructions: InstructionSet,
    options: FbpOptions,
}

impl<T: Sample> std::fmt::Debug for FbpPlan<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FbpPlan")
            .field("geometry", &self.geometry)
            .field("grid", &self.grid)
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

/// Work arrays of [`FbpPlan::reconstruct_slab_into`]: empty by default, they grow as needed; reusable by any plan of the same sample type.
#[derive(Debug, Default)]
pub struct FbpScratch<T> {
    filtered: Vec<T>,
    gridding: GriddingScratch<T>,
}

impl<T: Sample> FbpPlan<T> {
    /// Plans the reconstruction of `grid` from sinograms of `geometry`.
    ///
    /// # Errors
    /// An option out of its range, a region that leaves the grid, [`RadonError::ShortArc`], [`RadonError::InstructionSetMissing`],
    /// filtered rows of more than 2^20 samples, gains of a window, or a pitch whose reciprocal times the weight of a view, that overflow in `T`,
    /// views that exceed the memory.
    pub fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        options: &FbpOptions,
    ) -> Result<Self, RadonError> {
        // Positions in a row are 32-bit numbers; the filter's plan needs a thousand bytes per sample.
        const LONGEST: f64 = (1 << 20) as f64;
        let length = geometry.n_bins() as f64 * options.interpolation.upsampling() as f64;
        within("samples of a filtered row", length, 1.0, LONGEST)?;
        let weights = geometry.view_weights(options.arc)?;
        let instructions = options.instructions.unwrap_or_else(InstructionSet::detect);
        available(instructions)?;
        let (x, y) = options
            .region
            .clone()
            .unwrap_or((0..grid.nx(), 0..grid.ny()));
        for (what, range, len) in [("region x", &x, grid.nx()), ("region y", &y, grid.ny())] {
            if range.start >= range.end || range.end > len {
                return Err(RadonError::BadRange {
                    what,
                    start: range.start,
                    end: range.end,
                    len,
                });
            }
        }
        let pitch = if options.ramp { geometry.pitch() } else { 1.0 };
        let gridding = method::plan(geometry, grid, options, instructions, x.len() * y.len())?;
        // Rows of the Fourier method need no upsampling.
        let interpolation = match gridding {
            Some(_) => Interpolation::Linear,
            None => options.interpolation,
        };
        let filter_options = options.clone().with_interpolation(interpolation);
        let filter = RowFilter::new(geometry.n_bins(), &filter_options)?;
        let mut scales = Vec::with_capacity(weights.len());
        for weight in weights {
            let scale = T::of(weight / pitch);
            finite("weight of a view over the pitch", scale.f64())?;
            scales.push(scale);
        }
        Ok(Self {
            geometry: geometry.clone(),
            grid: *grid,
            scales,
            steps: Steps::new(
                geometry,
                grid,
                (x, y),
                filter.out_len(),
                interpolation.upsampling(),
            )?,
            gridding: gridding.map(Arc::new),
            filter,
            instructions,
            options: options.clone(),
        })
    }

    /// Returns the number of pixels of a reconstructed image: of the grid, or of the region if there is one.
    #[must_use]
    pub fn image_len(&self) -> usize {
        self.steps.image_len()
    }

    /// Samples of one sinogram.
    #[must_use]
    pub fn sinogram_len(&self) -> usize {
        self.geometry.sinogram_len()
    }

    /// Reconstructs one slice from its sinogram `[view][bin]`; the image is `[y][x]`.
    ///
    /// Rows that do not contain the whole object (truncation) raise the image, by default by 8 % to 129 % in the table of
    /// [`EdgePolicy`](crate::EdgePolicy). Pixels outside the circle that the rows inscribe are not seen from all angles: a sum over a square image
    /// includes their artefacts, a few per cent ([`disc_mask`](crate::disc_mask)). A transposed sinogram, or a geometry with exchanged numbers of
    /// views and bins, has the same length and is not detected. The image may contain infinity or NaN without an error where samples, or samples
    /// divided by the pitch, are within a factor of 100 of the largest number of `T`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite, [`RadonError::BudgetTooSmall`].
    pub fn reconstruct(&self, sinogram: &[T]) -> Result<Vec<T>, RadonError> {
        self.reconstruct_stack(sinogram, 1, StackOrder::SliceViewBin)
    }

    /// Reconstructs `n_slices` slices from their sinograms in the given order; the volume is `[slice][y][x]`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite, a volume beyond the address space.
    pub fn reconstruct_stack(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
    ) -> Result<Vec<T>, RadonError> {
        // Checked first: it bounds the number of slices.
        let expected = product("projections", self.sinogram_len(), n_slices)?;
        length("projections", projections.len(), expected)?;
        let mut volume = zeros("volume", n_slices, self.image_len())?;
        let (slices, scratch) = (0..n_slices, &mut FbpScratch::default());
        self.reconstruct_slab_into(projections, n_slices, order, slices, &mut volume, scratch)?;
        Ok(volume)
    }

    /// As [`reconstruct_stack`](Self::reconstruct_stack), of `slices` of the `n_slices` in the projections into an array of the caller,
    /// `[slice - slices.start][y][x]`.
    ///
    /// # Errors
    /// A wrong length, a range that leaves the stack, a sample of these slices that is NaN or infinite, [`RadonError::BudgetTooSmall`].
    pub fn reconstruct_slab_into(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
        slices: Range<usize>,
        slab: &mut [T],
        scratch: &mut FbpScratch<T>,
    ) -> Result<FbpReport, RadonError> {
        let stack = Stack {
            what: "projections",
            n_slices,
            n_rows: self.geometry.n_views(),
            row_len: self.geometry.n_bins(),
            order,
        };
        stack.check_length(projections.len())?;
        stack.check_slices(&slices)?;
        let expected = product("volume", slices.len(), self.image_len())?;
        length("volume", slab.len(), expected)?;
        let holds_signal = stack.with_signal(projections, slices.clone())?;

        let mut images: Vec<(usize, &mut [T])> = Vec::new();
        for ((slice, image), &signal) in slices
            .zip(slab.chunks_exact_mut(self.image_len()))
            .zip(&holds_signal)
        {
            if signal {
                images.push((slice, image));
            } else {
                image.fill(T::ZERO);
            }
        }
        match &self.gridding {
            Some(gridding) => {
                self.check_budget(gridding)?;
                self.run_gridded(gridding, &stack, projections, &mut images, scratch)
            }
            None => self.run_direct(&stack, projections, &mut images, scratch)?,
        }
        Ok(FbpReport {
            slices_reconstructed: images.len(),
            slices_skipped: holds_signal.len() - images.len(),
        })
    }

    /// Reconstructs blocks of slices.
    fn run_direct(
        &self,
        stack: &Stack,
        projections: &[T],
        images: &mut [(usize, &mut [T])],
        scratch: &mut FbpScratch<T>,
    ) -> Result<(), RadonError> {
        let (most_lanes, views_at_once) = self.block(images.len())?;
        let (n_images, n_views) = (images.len(), self.geometry.n_views());
        let mut rest = images;
        while !rest.is_empty() {
            let lanes = first_block::<T>(self.instructions, rest.len()).min(most_lanes);
            let (block, others) = rest.split_at_mut(lanes.min(rest.len()));
            rest = others;
            let row_len = self.steps.row_len() * lanes;
            let slices: Vec<usize> = block.iter().map(|(slice, _)| *slice).collect();
            let mut images: Vec<&mut [T]> =
                block.iter_mut().map(|(_, image)| &mut **image).collect();
            let done = (n_images - rest.len() - images.len()) * n_views;
            for start in (0..n_views).step_by(views_at_once) {
                let views = start..(start + views_at_once).min(n_views);
                let [from, to] = [views.start, views.end].map(|view| done + view * images.len());
                let _part = simd_set::part(from..to, n_images * n_views);
                let filtered = aligned(&mut scratch.filtered, views.len() * row_len);
                let new = || self.filter.scratch();
                parallel::chunks_with(filtered, row_len, &new, &|rows, k, out| {
                    simd_set::checkpoint();
                    let view = start + k;
                    let of_view = |&slice: &usize| stack.row(projections, view, slice);
                    let from: Vec<&[T]> = slices.iter().map(of_view).collect();
                    self.filter_view(&from, self.scales[view], lanes, out, rows);
                });
                backproject::run(
                    &self.steps,
                    self.instructions,
                    views,
                    filtered,
                    lanes,
                    &mut images,
                );
            }
        }
        Ok(())
    }

    /// Returns the bytes of work arrays of a run of `n_slices` slices, at most [`FbpOptions::memory`], with the number of threads of the current
    /// pool. The caller's arrays are not included, nor are lists of slices and tasks, less than 16 kB for 80 slices.
    ///
    /// # Errors
    /// [`RadonError::BudgetTooSmall`].
    pub fn work_bytes(&self, n_slices: usize) -> Result<usize, RadonError> {
        if let Some(gridding) = &self.gridding {
            return self.check_budget(gridding);
        }
        let (lanes, views) = self.block(n_slices)?;
        Ok(self.block_bytes(lanes, views))
    }

    /// Returns the bytes of the work arrays of a block: filtered rows, and sums and row buffers of each thread.
    fn block_bytes(&self, lanes: usize, views: usize) -> usize {
        let per_thread = self.filter.scratch_bytes() + backproject::tile_bytes::<T>(lanes);
        (views * self.steps.row_len() * lanes + 64) * size_of::<T>()
            + rayon::current_num_threads() * per_thread
    }

    /// Returns the lanes of the blocks of `n_slices` slices, and the number of views that are filtered at once.
    fn block(&self, n_slices: usize) -> Result<(usize, usize), RadonError> {
        let memory = self.options.memory;
        // Fewer views at once need more sweeps over the images; below this number, narrower blocks cost less.
        let enough = self.geometry.n_views().min(32);
        let mut n = n_slices;
        loop {
            let lanes = first_block::<T>(self.instructions, n);
            let fixed = self.block_bytes(lanes, 0);
            let views =
                memory.saturating_sub(fixed) / (self.steps.row_len() * lanes * size_of::<T>());
            if views >= enough || (lanes == 1 && views > 0) {
                return Ok((lanes, views.min(self.geometry.n_views())));
            }
            if lanes == 1 {
                return Err(RadonError::BudgetTooSmall {
                    least: self.block_bytes(1, 1),
                    given: memory,
                });
            }
            n = if lanes_for::<T>(self.instructions, lanes / 2) < lanes {
                lanes / 2
            } else {
                1
            };
        }
    }

    /// Filters the rows of one view into `out`, `[sample][lane]` with margins for back-projection.
    fn filter_view(
        &self,
        rows: &[&[T]],
        scale: T,
        lanes: usize,
        out: &mut [T],
        scratch: &mut rows::RowScratch<T>,
    ) {
        let (front, behind) = (
            backproject::MARGIN * lanes,
            (backproject::MARGIN + self.filter.out_len()) * lanes,
        );
        if rows.len() < lanes {
            out.fill(T::ZERO);
        } else {
            out[..front].fill(T::ZERO);
            out[behind..].fill(T::ZERO);
        }
        for (group, rows) in rows.chunks(rows::TOGETHER).enumerate() {
            let rows = rows.iter().copied();
            let rows: Vec<&[T]> = self.filter.filter(rows, scale, scratch).collect();
            let out = &mut out[front + group * rows::TOGETHER..behind];
            T::interleave(self.instructions, &rows, lanes, out);
        }
    }
}
