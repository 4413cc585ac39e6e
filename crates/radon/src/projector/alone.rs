//! Runs over one slice: the same sums as in a stack, with neighbouring bins or pixels side by side.

use std::sync::atomic::{AtomicBool, Ordering};

use super::rays::View;
use super::run::STEPS;
use super::{Projector, Scratch};
use crate::simd::{
    Bins, FixedPositions, Kernels, MARGIN, RUN, SortedBins, Strips, add_bins, add_sorted,
    add_strips, spread_strips,
};
use crate::stack::{Stack, aligned};
use crate::{Sample, parallel};

impl Projector {
    /// Whether single slices have a kernel: for `f32` and narrow strips, or two pixels per step unless bins are twice as wide as pixels.
    pub(super) fn projects_alone<T: Sample>(&self) -> bool {
        let n = self.geometry.n_bins().next_multiple_of(RUN);
        self.views.iter().all(|view| {
            let n_steps = match view.steps_are_rows() {
                true => self.grid.ny(),
                false => self.grid.nx(),
            };
            let [first, per_bin] = [view.offset(0), view.per_bin()];
            let fits = |ray| Bins::fit(&ray, first, per_bin, n, [n_steps, STEPS]);
            let is_alone =
                view.narrow_strip().is_some() || view.linear_ray::<f32>().is_some_and(fits);
            is_alone && size_of::<T>() == size_of::<f32>()
        })
    }

    /// Projects one slice that [`projects_alone`](Self::projects_alone): the same sums as in a block, side by side for many bins.
    pub(super) fn project_alone<T: Sample>(
        &self,
        images: &Stack,
        volume: &[T],
        slice: usize,
        rows: &mut [Vec<&mut [T]>],
        memory: &mut Vec<f32>,
    ) {
        let set = self.instructions;
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        let n_bins = self.geometry.n_bins();
        // Odd, to avoid cache conflicts between columns.
        let [x_stride, y_stride] = [nx, ny].map(|n| (n + MARGIN) | 1);
        let by_rows_len = Bins::image_len(ny, x_stride);
        let memory = aligned(memory, by_rows_len + Bins::image_len(nx, y_stride));
        memory.fill(0.0);
        let (by_rows, by_columns) = memory.split_at_mut(by_rows_len);
        for (y, row) in by_rows.chunks_exact_mut(x_stride).take(ny).enumerate() {
            let image = images.row(volume, y, slice);
            for (to, from) in row[MARGIN..].iter_mut().zip(image) {
                *to = from.f64() as f32;
            }
        }
        let by_rows = &*by_rows;
        let image = by_rows.chunks_exact(x_stride).take(ny);
        let image: Vec<&[f32]> = image.map(|row| &row[MARGIN..][..nx]).collect();
        f32::interleave(set, &image, y_stride, &mut by_columns[MARGIN..]);
        let by_columns = &*by_columns;

        let padded = n_bins.next_multiple_of(RUN);
        let new = || (vec![0.0; padded], FixedPositions::default());
        parallel::chunks_with(rows, 1, &new, &|(sums, fixed), view, row| {
            simd_set::unit(self.views.len());
            let view = &self.views[view];
            let (image, stride, n, n_steps) = match view.steps_are_rows() {
                true => (by_rows, x_stride, nx, ny),
                false => (by_columns, y_stride, ny, nx),
            };
            sums.fill(0.0);
            if let Some(strips) = strips(view, n, stride) {
                add_strips(set, &strips, &image[MARGIN / 2..], [n_steps, STEPS], sums);
            } else if let Some(ray) = view.linear_ray() {
                let bins = Bins {
                    image,
                    stride,
                    n,
                    first: view.offset(0),
                    ray,
                    per_bin: view.per_bin(),
                };
                add_bins(set, &bins, n_steps, STEPS, fixed, sums);
            }
            for (to, from) in row[0][slice].iter_mut().zip(&*sums) {
                *to = T::of(f64::from(*from));
            }
        });
    }

    /// Computes the adjoint of one `f32` slice into its rows of the volume, if possible: not for a kernel of more than two pixels per step,
    /// nor if bins are so fine that a run of pixels intersects too many.
    pub(super) fn adjoint_alone<T: Sample>(
        &self,
        sinograms: &Stack,
        projections: &[T],
        slice: usize,
        rows: &mut [Vec<&mut [T]>],
        scratch: &mut Scratch<T>,
    ) -> bool {
        let order = self.views_by_axis();
        if self.views.iter().all(|view| view.narrow_strip().is_some()) {
            self.spread_alone(
                &order,
                sinograms,
                projections,
                slice,
                rows,
                &mut scratch.slice,
            );
            return true;
        }
        let sorted = &mut scratch.sorted;
        sorted.resize_with(sorted.len().max(order.len()), SortedBins::default);
        let sorted = &mut sorted[..order.len()];
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        let all_fit = AtomicBool::new(true);
        parallel::each(sorted, &|k, sorted| {
            if !all_fit.load(Ordering::Relaxed) {
                return;
            }
            let view = order[k];
            let values = sinograms.row(projections, view, slice).iter();
            let values = values.map(|x| x.f64() as f32);
            let view = &self.views[view];
            let n_steps = if view.steps_are_rows() { ny } else { nx };
            let fits = view.linear_ray().is_some_and(|ray| {
                sorted.fill(ray, view.offset(0), view.per_bin(), n_steps, values)
            });
            all_fit.fetch_and(fits, Ordering::Relaxed);
        });
        if !all_fit.into_inner() {
            return false;
        }
        let steps_are_rows = |&&view: &&usize| self.views[view].steps_are_rows();
        let n_by_rows = order.iter().take_while(steps_are_rows).count();
        let (by_rows, by_columns) = sorted.split_at(n_by_rows);
        let (set, n_runs) = (self.instructions, nx.div_ceil(RUN) + ny.div_ceil(RUN));

        // `[run][step][lane]` of runs of pixels across the steps.
        let [by_rows_len, by_columns_len] =
            [(nx, ny), (ny, nx)].map(|(n, n_steps)| n.next_multiple_of(RUN) * n_steps);
        let memory = aligned(&mut scratch.slice, by_rows_len + by_columns_len);
        memory.fill(0.0);
        let (sums, turned) = memory.split_at_mut(by_rows_len);
        let (sums, turned) = (sums.as_chunks_mut().0, turned.as_chunks_mut::<RUN>().0);
        parallel::chunks(sums, ny, &|run, sums| {
            simd_set::unit(n_runs);
            add_sorted(set, by_rows, run * RUN, sums);
        });
        let sums = &*sums;
        parallel::chunks(turned, nx, &|run, turned| {
            simd_set::unit(n_runs);
            for (x, turned) in turned.iter_mut().enumerate() {
                let ys = run * RUN..ny.min((run + 1) * RUN);
                for (turned, y) in turned.iter_mut().zip(ys) {
                    *turned = sums[x / RUN * ny + y][x % RUN];
                }
            }
            add_sorted(set, by_columns, run * RUN, turned);
        });
        parallel::each(rows, &|y, row| {
            for (x, pixel) in row[slice].iter_mut().enumerate() {
                *pixel = T::of(f64::from(turned[y / RUN * nx + x][y % RUN]));
            }
        });
        true
    }

    /// As [`adjoint_alone`](Self::adjoint_alone), for narrow strips: bands of steps of all views.
    fn spread_alone<T: Sample>(
        &self,
        order: &[usize],
        sinograms: &Stack,
        projections: &[T],
        slice: usize,
        rows: &mut [Vec<&mut [T]>],
        memory: &mut Vec<f32>,
    ) {
        const BAND: usize = 16;
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        let [x_stride, y_stride] = [nx, ny].map(|n| (n + MARGIN) | 1);
        let memory = aligned(memory, ny * x_stride + nx * y_stride);
        memory.fill(0.0);
        let (by_rows, by_columns) = memory.split_at_mut(ny * x_stride);
        let spread = |views: &[usize], n: usize, stride: usize, pixels: &mut [f32]| {
            let n_bands = (pixels.len() / stride).div_ceil(BAND);
            parallel::chunks_with(pixels, BAND * stride, &Vec::new, &|values, band, pixels| {
                simd_set::unit(n_bands);
                let steps = band * BAND..band * BAND + pixels.len() / stride;
                for &view in views {
                    simd_set::checkpoint();
                    let Some(strips) = strips(&self.views[view], n, stride) else {
                        return;
                    };
                    let row = sinograms.row(projections, view, slice).iter();
                    values.clear();
                    values.extend(row.map(|x| x.f64() as f32));
                    values.resize(values.len().next_multiple_of(RUN), 0.0);
                    spread_strips(self.instructions, &strips, values, steps.clone(), pixels);
                }
            });
        };
        let by_axis = order.partition_point(|&view| self.views[view].steps_are_rows());
        let part = simd_set::part(0..by_axis, order.len());
        spread(&order[..by_axis], nx, x_stride, by_rows);
        drop(part);
        let left = MARGIN / 2;
        for (x, column) in by_columns.chunks_exact_mut(y_stride).enumerate() {
            for (y, pixel) in column[left..][..ny].iter_mut().enumerate() {
                *pixel = by_rows[y * x_stride + left + x];
            }
        }
        let _part = simd_set::part(by_axis..order.len(), order.len());
        spread(&order[by_axis..], ny, y_stride, by_columns);
        parallel::each(rows, &|y, row| {
            for (x, pixel) in row[slice].iter_mut().enumerate() {
                *pixel = T::of(f64::from(by_columns[x * y_stride + left + y]));
            }
        });
    }
}

/// Returns the strips of a view through an image with rows of `n` pixels, if they are narrow.
fn strips(view: &View, n: usize, stride: usize) -> Option<Strips> {
    let per_bin = view.per_bin();
    view.narrow_strip().map(|ray| Strips {
        ray,
        per_bin,
        n,
        stride,
    })
}
