//! Filtered back-projection: the plan and its runs.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{RadonError, length, product};
use crate::geometry::{ImageGrid, ParallelGeometry, StackOrder};
use crate::sample::Sample;
use crate::simd::InstructionSet;

mod backproject;
mod options;
mod rows;

use backproject::Steps;
pub use options::{EdgePolicy, FbpOptions, FbpReport, Interpolation, Skip};
use rows::RowFilter;

/// Filtered back-projection, planned once and run many times, by many threads (`&self`, `Send + Sync`).
///
/// ```text
/// q_v(s)  = sum_k  pitch * h(s - s_k) * p_v(s_k)              h: the windowed band-limited ramp
/// f(x, y) = sum_v  w_v * q_v(x cos theta_v + y sin theta_v)   w: quadrature weights of the views
/// ```
///
/// With projections in (value x length) the image is in (value), at its absolute scale: no factor is left to the caller. The
/// same bits come out for any number of threads, for a slice alone or among others, and with skipping on or off.
///
/// ```
/// use radon::{FbpOptions, FbpPlan, ImageGrid, ParallelGeometry};
/// let geometry = ParallelGeometry::uniform(90, std::f64::consts::PI, 64, 0.1)?;
/// let grid = ImageGrid::square(64, 0.1)?;
/// let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default())?;
/// // A disc of radius 2 and value 1 at the origin: every view holds its chords.
/// let view = (0..64).map(|k| 2.0 * (4.0 - geometry.bin_centre(k).powi(2)).max(0.0).sqrt() as f32);
/// let sinogram: Vec<f32> = view.cycle().take(90 * 64).collect();
/// let image = plan.reconstruct(&sinogram)?;
/// assert!((image[32 * 64 + 40] - 1.0).abs() < 0.01);
/// # Ok::<(), radon::RadonError>(())
/// ```
pub struct FbpPlan<T: Sample> {
    n_views: usize,
    n_bins: usize,
    filter: RowFilter<T>,
    /// Per view: quadrature weight over pitch.
    scales: Vec<T>,
    steps: Steps<T>,
    instructions: InstructionSet,
    options: FbpOptions,
}

impl<T: Sample> std::fmt::Debug for FbpPlan<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            n_views,
            n_bins,
            options,
            ..
        } = self;
        f.debug_struct("FbpPlan")
            .field("n_views", n_views)
            .field("n_bins", n_bins)
            .field("options", options)
            .finish_non_exhaustive()
    }
}

/// Work arrays of [`FbpPlan::reconstruct_stack_into`], made by [`FbpPlan::scratch`] and reusable by any plan of the same sample type.
#[derive(Debug, Default)]
pub struct FbpScratch<T> {
    filtered: Vec<T>,
}

impl<T: Sample> FbpPlan<T> {
    /// Plans the reconstruction of `grid` from sinograms of `geometry`.
    ///
    /// # Errors
    /// An option out of its range, a region that leaves the grid, [`RadonError::ShortArc`].
    pub fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        options: &FbpOptions,
    ) -> Result<Self, RadonError> {
        let filter = RowFilter::new(geometry.n_bins(), options)?;
        let weights = geometry.view_weights(options.arc)?;
        let instructions = options.instructions.unwrap_or_else(InstructionSet::detect);
        if !instructions.is_available() {
            return Err(RadonError::InstructionSetMissing {
                given: instructions,
            });
        }
        let (x, y) = options
            .region
            .clone()
            .unwrap_or((0..grid.nx(), 0..grid.ny()));
        for (name, range, len) in [("region x", &x, grid.nx()), ("region y", &y, grid.ny())] {
            if range.start >= range.end || range.end > len {
                return Err(RadonError::BadRange {
                    name,
                    start: range.start,
                    end: range.end,
                    len,
                });
            }
        }
        Ok(Self {
            n_views: geometry.n_views(),
            n_bins: geometry.n_bins(),
            scales: weights
                .iter()
                .map(|w| T::of(w / geometry.pitch()))
                .collect(),
            steps: Steps::new(
                geometry,
                grid,
                (x, y),
                filter.out_len(),
                options.interpolation.upsampling(),
            ),
            filter,
            instructions,
            options: options.clone(),
        })
    }

    /// Pixels of one reconstructed image: of the grid, or of the region if there is one.
    pub fn image_len(&self) -> usize {
        self.steps.image_len()
    }

    /// Samples of one sinogram.
    pub fn sinogram_len(&self) -> usize {
        self.n_views * self.n_bins
    }

    /// The options the plan was made with.
    pub fn options(&self) -> &FbpOptions {
        &self.options
    }

    /// Empty work arrays; they grow to what a run needs and can be used again.
    pub fn scratch(&self) -> FbpScratch<T> {
        FbpScratch {
            filtered: Vec::new(),
        }
    }

    /// Reconstructs one slice from its sinogram `[view][bin]`; the image is `[y][x]`.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn reconstruct(&self, sinogram: &[T]) -> Result<Vec<T>, RadonError> {
        self.reconstruct_stack(sinogram, 1, StackOrder::SliceViewBin)
    }

    /// As [`reconstruct`](Self::reconstruct), into an image of the caller's.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn reconstruct_into(
        &self,
        sinogram: &[T],
        image: &mut [T],
        scratch: &mut FbpScratch<T>,
    ) -> Result<FbpReport, RadonError> {
        self.reconstruct_stack_into(sinogram, 1, StackOrder::SliceViewBin, image, scratch)
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
        let mut volume = vec![T::ZERO; product("volume", n_slices, self.image_len())?];
        self.reconstruct_stack_into(
            projections,
            n_slices,
            order,
            &mut volume,
            &mut self.scratch(),
        )?;
        Ok(volume)
    }

    /// As [`reconstruct_stack`](Self::reconstruct_stack), into a volume of the caller's.
    ///
    /// # Errors
    /// A wrong length, a sample that is NaN or infinite.
    pub fn reconstruct_stack_into(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
        volume: &mut [T],
        scratch: &mut FbpScratch<T>,
    ) -> Result<FbpReport, RadonError> {
        self.reconstruct_slab_into(projections, n_slices, order, 0..n_slices, volume, scratch)
    }

    /// Reconstructs only `slices` of the `n_slices` that the projections hold; `slab` is `[slice - slices.start][y][x]`.
    ///
    /// # Errors
    /// A wrong length, a range that leaves the stack, a sample of these slices that is NaN or infinite.
    pub fn reconstruct_slab_into(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
        slices: Range<usize>,
        slab: &mut [T],
        scratch: &mut FbpScratch<T>,
    ) -> Result<FbpReport, RadonError> {
        length(
            "projections",
            projections.len(),
            product("projections", self.sinogram_len(), n_slices)?,
        )?;
        if slices.start > slices.end || slices.end > n_slices {
            return Err(RadonError::BadRange {
                name: "slices",
                start: slices.start,
                end: slices.end,
                len: n_slices,
            });
        }
        length(
            "volume",
            slab.len(),
            product("volume", slices.len(), self.image_len())?,
        )?;
        let stack = Stack {
            projections,
            n_slices,
            order,
            n_views: self.n_views,
            n_bins: self.n_bins,
        };
        let holds_signal = stack.signal(slices.clone())?;

        let mut report = FbpReport::default();
        let mut images: Vec<(usize, &mut [T])> = Vec::new();
        for ((slice, image), &signal) in slices
            .zip(slab.chunks_exact_mut(self.image_len()))
            .zip(&holds_signal)
        {
            if signal || self.options.skip == Skip::Nothing {
                images.push((slice, image));
            } else {
                image.fill(T::ZERO);
                report.slices_skipped += 1;
                report.rows_skipped += self.n_views;
            }
        }
        report.slices_reconstructed = images.len();
        for block in images.chunks_mut(self.instructions.lanes_for::<T>(usize::MAX)) {
            let lanes = self.instructions.lanes_for::<T>(block.len());
            let row_len = self.steps.row_len() * lanes;
            let filtered = aligned(&mut scratch.filtered, self.n_views * row_len);
            let slices: Vec<usize> = block.iter().map(|(slice, _)| *slice).collect();
            let filtered_rows: usize = filtered
                .par_chunks_exact_mut(row_len)
                .enumerate()
                .map_init(
                    || self.filter.scratch(),
                    |rows, (view, out)| self.filter_view(&stack, view, &slices, lanes, out, rows),
                )
                .sum();
            report.rows_filtered += filtered_rows;
            report.rows_skipped += block.len() * self.n_views - filtered_rows;
            let mut images: Vec<&mut [T]> =
                block.iter_mut().map(|(_, image)| &mut **image).collect();
            backproject::run(&self.steps, self.instructions, filtered, lanes, &mut images);
        }
        Ok(report)
    }

    /// Filters the rows of one view into `out`, `[sample][lane]` with the margins that back-projection needs; returns how many
    /// rows held signal.
    fn filter_view(
        &self,
        stack: &Stack<'_, T>,
        view: usize,
        slices: &[usize],
        lanes: usize,
        out: &mut [T],
        scratch: &mut rows::RowScratch<T>,
    ) -> usize {
        out.fill(T::ZERO);
        let mut filtered = 0;
        for (lane, &slice) in slices.iter().enumerate() {
            let row = stack.row(view, slice);
            if self.options.skip == Skip::Empty && row.iter().all(|&p| p == T::ZERO) {
                continue;
            }
            filtered += 1;
            let scale = self.scales[view];
            for (sample, &q) in out[backproject::MARGIN * lanes..]
                .chunks_exact_mut(lanes)
                .zip(self.filter.filter(row, scratch))
            {
                sample[lane] = q * scale;
            }
        }
        filtered
    }
}

/// The first `len` samples from the first cache line on: a register then never reads two lines.
pub(crate) fn aligned<T: Sample>(samples: &mut Vec<T>, len: usize) -> &mut [T] {
    const LINE: usize = 64;
    let spare = LINE / size_of::<T>();
    if samples.len() < len + spare {
        samples.resize(len + spare, T::ZERO);
    }
    let start = samples.as_ptr().align_offset(LINE).min(spare);
    &mut samples[start..start + len]
}

/// The caller's projections and their shape.
struct Stack<'a, T> {
    projections: &'a [T],
    n_slices: usize,
    order: StackOrder,
    n_views: usize,
    n_bins: usize,
}

impl<'a, T: Sample> Stack<'a, T> {
    fn row(&self, view: usize, slice: usize) -> &'a [T] {
        let start = self
            .order
            .row_start(view, slice, self.n_views, self.n_slices, self.n_bins);
        &self.projections[start..start + self.n_bins]
    }

    /// Whether each slice holds a sample other than zero.
    fn signal(&self, slices: Range<usize>) -> Result<Vec<bool>, RadonError> {
        slices
            .into_par_iter()
            .map(|slice| {
                let mut signal = false;
                for view in 0..self.n_views {
                    let row = self.row(view, slice);
                    // x * 0 is 0 for finite x and NaN otherwise.
                    let bad = row.iter().fold(T::ZERO, |sum, &p| sum + p * T::ZERO);
                    if bad != T::ZERO {
                        let at = row.iter().position(|p| !p.finite()).unwrap_or(0);
                        let index = self.order.row_start(
                            view,
                            slice,
                            self.n_views,
                            self.n_slices,
                            self.n_bins,
                        ) + at;
                        return Err(RadonError::BadSample {
                            name: "projections",
                            index,
                            given: row[at].f64(),
                        });
                    }
                    signal |= row.iter().any(|&p| p != T::ZERO);
                }
                Ok(signal)
            })
            .collect()
    }
}
