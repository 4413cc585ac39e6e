//! Runs over one slice: the same sums as in a stack, with neighbouring bins or pixels side by side.

use rayon::prelude::*;

use super::run::STEPS;
use super::{Projector, ProjectorScratch};
use crate::Sample;
use crate::simd::{Bins, FixedPositions, Kernels, MARGIN, RUN, SortedBins, add_bins, add_sorted};
use crate::stack::{Stack, aligned};

impl Projector {
    /// Whether single slices have a kernel: for `f32` and kernels of two pixels per step, unless bins are twice as wide as pixels.
    pub(super) fn projects_alone<T: Sample>(&self) -> bool {
        let n = self.geometry.n_bins().next_multiple_of(RUN);
        self.views.iter().all(|view| {
            let n_steps = match view.steps_are_rows() {
                true => self.grid.ny(),
                false => self.grid.nx(),
            };
            let [first, per_bin] = [view.offset(0), view.per_bin()];
            let fits = |ray| Bins::fit(&ray, first, per_bin, n, [n_steps, STEPS]);
            size_of::<T>() == size_of::<f32>() && view.box_ray::<f32>().is_some_and(fits)
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
        rows.par_iter_mut().zip(&self.views).for_each_init(
            || (vec![0.0; padded], FixedPositions::default()),
            |(sums, fixed), (row, view)| {
                simd_set::checkpoint();
                let Some(ray) = view.box_ray() else { return };
                let (image, stride, n, n_steps) = match view.steps_are_rows() {
                    true => (by_rows, x_stride, nx, ny),
                    false => (by_columns, y_stride, ny, nx),
                };
                let bins = Bins {
                    image,
                    stride,
                    n,
                    first: view.offset(0),
                    ray,
                    per_bin: view.per_bin(),
                };
                sums.fill(0.0);
                add_bins(set, &bins, n_steps, STEPS, fixed, sums);
                for (to, from) in row[slice].iter_mut().zip(&*sums) {
                    *to = T::of(f64::from(*from));
                }
            },
        );
    }

    /// Computes the adjoint of one `f32` slice into its rows of the volume, if possible: not for a kernel of more than two pixels per step,
    /// nor if bins are so fine that a run of pixels intersects too many.
    pub(super) fn adjoint_alone<T: Sample>(
        &self,
        sinograms: &Stack,
        projections: &[T],
        slice: usize,
        rows: &mut [Vec<&mut [T]>],
        scratch: &mut ProjectorScratch<T>,
    ) -> bool {
        let order = self.views_by_axis();
        let sorted = &mut scratch.sorted;
        sorted.resize_with(sorted.len().max(order.len()), SortedBins::default);
        let sorted = &mut sorted[..order.len()];
        let (nx, ny) = (self.grid.nx(), self.grid.ny());
        let fill = |(sorted, &view): (&mut SortedBins, &usize)| {
            let values = sinograms.row(projections, view, slice).iter();
            let values = values.map(|x| x.f64() as f32);
            let view = &self.views[view];
            let n_steps = if view.steps_are_rows() { ny } else { nx };
            view.box_ray().is_some_and(|ray| {
                sorted.fill(ray, view.offset(0), view.per_bin(), n_steps, values)
            })
        };
        if !sorted.par_iter_mut().zip(&order).all(fill) {
            return false;
        }
        let steps_are_rows = |&&view: &&usize| self.views[view].steps_are_rows();
        let n_by_rows = order.iter().take_while(steps_are_rows).count();
        let (by_rows, by_columns) = sorted.split_at(n_by_rows);
        let set = self.instructions;

        // `[run][step][lane]` of runs of pixels across the steps.
        let [by_rows_len, by_columns_len] =
            [(nx, ny), (ny, nx)].map(|(n, n_steps)| n.next_multiple_of(RUN) * n_steps);
        let memory = aligned(&mut scratch.slice, by_rows_len + by_columns_len);
        memory.fill(0.0);
        let (sums, turned) = memory.split_at_mut(by_rows_len);
        let (sums, turned) = (sums.as_chunks_mut().0, turned.as_chunks_mut::<RUN>().0);
        let runs = sums.par_chunks_mut(ny).enumerate();
        runs.for_each(|(run, sums)| {
            simd_set::checkpoint();
            add_sorted(set, by_rows, run * RUN, sums);
        });
        let sums = &*sums;
        let runs = turned.par_chunks_mut(nx).enumerate();
        runs.for_each(|(run, turned)| {
            simd_set::checkpoint();
            for (x, turned) in turned.iter_mut().enumerate() {
                let ys = run * RUN..ny.min((run + 1) * RUN);
                for (turned, y) in turned.iter_mut().zip(ys) {
                    *turned = sums[x / RUN * ny + y][x % RUN];
                }
            }
            add_sorted(set, by_columns, run * RUN, turned);
        });
        rows.par_iter_mut().enumerate().for_each(|(y, row)| {
            for (x, pixel) in row[slice].iter_mut().enumerate() {
                *pixel = T::of(f64::from(turned[y / RUN * nx + x][y % RUN]));
            }
        });
        true
    }
}
