//! Forward and adjoint runs over stacks of slices.
//!
//! Forward: views that march along the rows of the image process one band of rows at a time, in the layout of the kernels with slices
//! innermost; then those along columns process bands of columns. A ray sum is accumulated band by band, and one job writes each sample of a
//! result: results are bitwise independent of the number of threads and of the other slices of a stack.

use std::ops::Range;

use super::blocks::{Block, Group, Slices, groups};
use super::rays::{Rays, View, Window, in_turn};
use super::{Projector, Scratch, row_stride};
use crate::error::RadonError;
use crate::simd::prefetch;
use crate::stack::{Stack, aligned};
use crate::{Sample, StackOrder, parallel};

/// Steps of a band, whose part of a ray sum is accumulated in registers. This number affects rounding.
pub(super) const STEPS: usize = 32;
/// Side of the square tiles of pixels that fit in the second-level cache.
const TILE: usize = 32;
/// Views whose pairs are computed together, then used block by block.
const VIEWS: usize = 48;

/// Some rays of a view, and the positions of their sums, separately for each block.
struct Job<'a, T> {
    view: &'a View,
    bins: Range<usize>,
    sums: Vec<&'a mut [T]>,
}

impl Projector {
    /// Computes the projections of a stack.
    pub(super) fn run_forward<T: Sample>(
        &self,
        volume: &[T],
        n_slices: usize,
        order: StackOrder,
        projections: &mut [T],
        scratch: &mut Scratch<T>,
    ) -> Result<(), RadonError> {
        let (images, sinograms) = self.stacks(n_slices, order);
        images.check_length(volume.len())?;
        sinograms.check_length(projections.len())?;
        let slices = Slices::new(images.with_signal(volume, 0..n_slices)?);
        let mut rows = sinograms.rows_mut(projections);
        slices.clear_empty(&mut rows);

        let n_bins = self.geometry.n_bins();
        let order = self.views_by_axis();
        let views: Vec<&View> = order.iter().map(|&view| &self.views[view]).collect();
        let n_by_rows = views.iter().filter(|view| view.steps_are_rows()).count();
        let (in_blocks, alone) = match self.projects_alone::<T>() {
            true => slices.blocks_and_alone::<T>(self.instructions),
            false => (slices.active(), &[][..]),
        };
        let sinogram_len = self.geometry.sinogram_len();
        let groups = groups::<T>(in_blocks, self.instructions, sinogram_len, true);
        let n_pixels = self.grid.nx() + self.grid.ny();
        // Slices alone take about as long as a group.
        let before = usize::from(!alone.is_empty());
        let part = simd_set::part(0..before, groups.len() + before);
        for (_part, &slice) in simd_set::parts(alone.iter()) {
            self.project_alone(&images, volume, slice, &mut rows, &mut scratch.slice);
        }
        drop(part);
        let _part = simd_set::part(before..groups.len() + before, groups.len() + before);
        for (_part, group) in simd_set::parts(groups.into_iter()) {
            let view_len = n_bins * group.lanes;
            let rays = aligned(&mut scratch.rays, views.len() * view_len);
            parallel::chunks(rays, view_len, &|_, sums| sums.fill(T::ZERO));
            let (by_rows, by_columns) = rays.split_at_mut(n_by_rows * view_len);
            for (views, rays) in [
                (&views[..n_by_rows], by_rows),
                (&views[n_by_rows..], by_columns),
            ] {
                let Some(first) = views.first() else { continue };
                let (n_along, n_across, done) = match first.steps_are_rows() {
                    true => (self.grid.ny(), self.grid.nx(), 0),
                    false => (self.grid.nx(), self.grid.ny(), self.grid.ny()),
                };
                for start in (0..n_along).step_by(STEPS) {
                    let band = Window {
                        across: 0..n_across,
                        along: start..(start + STEPS).min(n_along),
                        strides: [1, row_stride(n_across)],
                        origin: 1,
                    };
                    let steps = done + band.along.start..done + band.along.end;
                    let _band = simd_set::part(steps, n_pixels);
                    let memory = &mut scratch.pixels;
                    let pixels = match first.steps_are_rows() {
                        true => self.pack_rows(&images, volume, &group, &band, memory),
                        false => self.pack_columns(&images, volume, &group, &band, memory),
                    };
                    self.add_band(views, &band, &group, &pixels, rays, &mut scratch.found);
                }
            }
            let rays = &*rays;
            let mut sums_of: Vec<&[T]> = vec![&[]; views.len()];
            for (&view, sums) in order.iter().zip(rays.chunks_exact(view_len)) {
                sums_of[view] = sums;
            }
            parallel::each(&mut rows, &|view, row| {
                for block in &group.blocks {
                    let sums = &sums_of[view][n_bins * block.before..][..n_bins * block.lanes];
                    let mut bins = block.pick(row, 0..n_bins);
                    T::separate(self.instructions, sums, block.lanes, &mut bins);
                }
            });
        }
        Ok(())
    }

    /// Adds the contributions of a band to the sums of the rays of views of one axis, `[view][block][bin][lane]`.
    fn add_band<T: Sample>(
        &self,
        views: &[&View],
        band: &Window,
        group: &Group<'_>,
        pixels: &[&[T]],
        rays: &mut [T],
        found: &mut Vec<Vec<Rays<T>>>,
    ) {
        // A job contains the rays that cross the middle of the band between the same pixels, which stay in its cache.
        let middle = band.along.start + band.along.len() / 2;
        let n_tiles = band.across.end.div_ceil(TILE);
        // Enough jobs per thread, so that those at the ends, which include rays beside the image, do not delay the others.
        const JOBS: usize = 12;
        let n_parts = (JOBS * rayon::current_num_threads()).div_ceil(n_tiles);
        let per_job = views.len().div_ceil(n_parts).min(VIEWS);
        let n_bins = self.geometry.n_bins();
        let view_len = n_bins * group.lanes;
        let mut jobs = Vec::new();
        let rays = rays.chunks_mut(per_job * view_len);
        for (views, rays) in views.chunks(per_job).zip(rays) {
            let mut tiles: Vec<Vec<Job<'_, T>>> = Vec::new();
            tiles.resize_with(n_tiles, Vec::new);
            for (view, row) in views.iter().zip(rays.chunks_exact_mut(view_len)) {
                let mut parts = group.parts(row);
                let mut of_view: Vec<(usize, Range<usize>)> = (0..n_tiles)
                    .map(|tile| {
                        (
                            tile,
                            view.bins_between(tile * TILE..(tile + 1) * TILE, middle),
                        )
                    })
                    .collect();
                of_view.sort_by_key(|(_, bins)| bins.start);
                for (tile, bins) in of_view {
                    let sums = parts
                        .iter_mut()
                        .map(|(block, rest)| {
                            let (sums, others) =
                                std::mem::take(rest).split_at_mut(bins.len() * block.lanes);
                            *rest = others;
                            sums
                        })
                        .collect();
                    tiles[tile].push(Job { view, bins, sums });
                }
            }
            jobs.extend(tiles);
        }
        // Memory for pairs is kept for each job: no allocation while threads run.
        found.resize_with(found.len().max(jobs.len()), Vec::new);
        let mut jobs: Vec<_> = jobs.into_iter().zip(found).collect();
        parallel::each(&mut jobs, &|_, (jobs, found)| {
            found.resize_with(found.len().max(jobs.len()), Rays::default);
            let found = &mut found[..jobs.len()];
            for (job, found) in jobs.iter().zip(&mut *found) {
                job.view
                    .traverse(self.instructions, band, job.bins.clone(), found);
            }
            for (i, (block, pixels)) in group.blocks.iter().zip(pixels).enumerate() {
                simd_set::checkpoint();
                for (view, bin, pairs, range) in in_turn(found) {
                    let job = &mut jobs[view];
                    let at = (bin - job.bins.start) * block.lanes;
                    let (sums, next) = job.sums[i][at..].split_at_mut(block.lanes);
                    // Sums are far apart in memory: prefetch those of the next bin but one.
                    prefetch(next.get(block.lanes..2 * block.lanes).unwrap_or(&[]));
                    T::gather(self.instructions, pixels, pairs, range, 1, sums);
                }
            }
        });
    }

    /// Computes the adjoint of [`run_forward`](Self::run_forward).
    pub(super) fn run_adjoint<T: Sample>(
        &self,
        projections: &[T],
        n_slices: usize,
        order: StackOrder,
        volume: &mut [T],
        scratch: &mut Scratch<T>,
    ) -> Result<(), RadonError> {
        let (images, sinograms) = self.stacks(n_slices, order);
        sinograms.check_length(projections.len())?;
        images.check_length(volume.len())?;
        let slices = Slices::new(sinograms.with_signal(projections, 0..n_slices)?);
        let mut rows = images.rows_mut(volume);
        slices.clear_empty(&mut rows);

        let n_active = slices.active().len();
        let mut alone = |(k, &slice): (usize, &usize)| {
            let _slice = simd_set::part(k..k + 1, n_active);
            self.adjoint_alone(&sinograms, projections, slice, &mut rows, scratch)
        };
        let in_blocks = match slices.few_for_adjoint::<T>(self.instructions) {
            Some(few) if few.iter().enumerate().all(&mut alone) => &[][..],
            _ => slices.active(),
        };
        let n_bins = self.geometry.n_bins();
        let order = self.views_by_axis();
        let sinogram_len = self.geometry.sinogram_len();
        let groups = groups::<T>(in_blocks, self.instructions, sinogram_len, false);
        let n_tiles = self.grid.nx().div_ceil(TILE) * self.grid.ny().div_ceil(TILE);
        for (_part, group) in simd_set::parts(groups.into_iter()) {
            let view_len = n_bins * group.lanes;
            let rays = aligned(&mut scratch.rays, self.views.len() * view_len);
            parallel::chunks(rays, view_len, &|k, rays| {
                for block in &group.blocks {
                    let rays = &mut rays[n_bins * block.before..][..n_bins * block.lanes];
                    block.clear_unused(rays);
                    let rows = sinograms.rows(projections, order[k], block.slices);
                    T::interleave(self.instructions, &rows, block.lanes, rays);
                }
            });
            let rays: Vec<(&View, &[T])> = order
                .iter()
                .map(|&view| &self.views[view])
                .zip(rays.chunks_exact(view_len))
                .collect();
            let new = || (Vec::new(), Vec::new());
            parallel::chunks_with(&mut rows, TILE, &new, &|(found, memory), band, rows| {
                for x0 in (0..self.grid.nx()).step_by(TILE) {
                    simd_set::unit(n_tiles);
                    let x = x0..(x0 + TILE).min(self.grid.nx());
                    let y = band * TILE..band * TILE + rows.len();
                    self.fill_tile(&group, &rays, [x, y], found, memory, rows);
                }
            });
        }
        Ok(())
    }

    /// Computes a tile of the adjoint from the rays of a group's views, `[block][bin][lane]` each, and writes it to the rows of the tile. A
    /// pixel's sum follows the order of the views, and of the bins of each.
    fn fill_tile<T: Sample>(
        &self,
        group: &Group<'_>,
        rays: &[(&View, &[T])],
        [x, y]: [Range<usize>; 2],
        found: &mut Vec<Rays<T>>,
        memory: &mut Vec<T>,
        rows: &mut [Vec<&mut [T]>],
    ) {
        // A margin of one pixel receives the contributions to neighbouring tiles and is ignored.
        let stride = row_stride(TILE);
        let origin = stride + 1;
        let tile_len = stride * (TILE + 2);
        let n_bins = self.geometry.n_bins();
        let sums = aligned(memory, tile_len * group.lanes);
        sums.fill(T::ZERO);
        let windows = [true, false].map(|steps_are_rows| {
            let (across, along, strides) = match steps_are_rows {
                true => (x.clone(), y.clone(), [1, stride]),
                false => (y.clone(), x.clone(), [stride, 1]),
            };
            Window {
                across,
                along,
                strides,
                origin,
            }
        });
        let window = |view: &View| &windows[usize::from(!view.steps_are_rows())];
        for rays in rays.chunks(VIEWS) {
            simd_set::checkpoint();
            found.resize_with(found.len().max(rays.len()), Rays::default);
            for ((view, _), found) in rays.iter().zip(&mut *found) {
                let bins = view.bins_meeting(window(view));
                view.traverse(self.instructions, window(view), bins, found);
            }
            for block in &group.blocks {
                let sums = &mut sums[tile_len * block.before..][..tile_len * block.lanes];
                for ((view, rays), found) in rays.iter().zip(&*found) {
                    let across = window(view).strides[0];
                    let rays = &rays[n_bins * block.before..][..n_bins * block.lanes];
                    for (bin, range) in found.iter() {
                        let ray = &rays[bin * block.lanes..][..block.lanes];
                        T::scatter(self.instructions, sums, &found.pairs, range, across, ray);
                    }
                }
            }
        }
        for block in &group.blocks {
            let sums = &sums[(tile_len * block.before)..][..tile_len * block.lanes];
            for (row, sums) in rows
                .iter_mut()
                .zip(sums.chunks_exact(stride * block.lanes).skip(1))
            {
                let mut pixels = block.pick(row, x.clone());
                T::separate(
                    self.instructions,
                    &sums[block.lanes..],
                    block.lanes,
                    &mut pixels,
                );
            }
        }
    }

    /// Returns the views that march along the image's rows, then those along its columns.
    pub(super) fn views_by_axis(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.views.len()).collect();
        order.sort_by_key(|&view| !self.views[view].steps_are_rows());
        order
    }

    pub(super) fn stacks(&self, n_slices: usize, order: StackOrder) -> (Stack, Stack) {
        let images = Stack {
            what: "volume",
            n_slices,
            n_rows: self.grid.ny(),
            row_len: self.grid.nx(),
            order: StackOrder::SliceViewBin,
        };
        let sinograms = Stack {
            what: "projections",
            n_slices,
            n_rows: self.geometry.n_views(),
            row_len: self.geometry.n_bins(),
            order,
        };
        (images, sinograms)
    }

    /// A band of image rows of a group in the layout `[block][row][pixel][lane]`; returns the part of each block.
    fn pack_rows<'a, T: Sample>(
        &self,
        images: &Stack,
        volume: &[T],
        group: &Group<'_>,
        band: &Window,
        memory: &'a mut Vec<T>,
    ) -> Vec<&'a [T]> {
        let stride = row_stride(band.across.end);
        let mut parts = group.parts(aligned(memory, band.along.len() * stride * group.lanes));
        let mut jobs: Vec<(&Block<'_>, usize, &mut [T])> = parts
            .iter_mut()
            .flat_map(|(block, part)| {
                let rows = part.chunks_exact_mut(stride * block.lanes);
                let rows = rows.zip(band.along.clone());
                rows.map(|(row, y)| (*block, y, row))
            })
            .collect();
        parallel::each(&mut jobs, &|_, (block, y, row)| {
            let (pixels, right) = row[block.lanes..].split_at_mut(band.across.end * block.lanes);
            right.fill(T::ZERO);
            block.clear_unused(pixels);
            let rows = images.rows(volume, *y, block.slices);
            T::interleave(self.instructions, &rows, block.lanes, pixels);
            row[..block.lanes].fill(T::ZERO);
        });
        parts.into_iter().map(|(_, part)| &*part).collect()
    }

    /// A band of image columns of a group in the layout `[block][column][pixel][lane]`; returns the part of each block.
    fn pack_columns<'a, T: Sample>(
        &self,
        images: &Stack,
        volume: &[T],
        group: &Group<'_>,
        band: &Window,
        memory: &'a mut Vec<T>,
    ) -> Vec<&'a [T]> {
        // All columns read every cache line once; half of them at a time if there would be too few jobs.
        let n_columns = match group.blocks.len() >= rayon::current_num_threads() {
            true => STEPS,
            false => STEPS / 2,
        };
        /// Slices that are read at the same time.
        const TOGETHER: usize = 16;
        let stride = row_stride(band.across.end);
        let mut parts = group.parts(aligned(memory, band.along.len() * stride * group.lanes));
        let mut jobs: Vec<(&Block<'_>, Range<usize>, &mut [T])> = parts
            .iter_mut()
            .flat_map(|(block, part)| {
                let columns = part.chunks_mut(n_columns * stride * block.lanes);
                let starts = band.along.clone().step_by(n_columns);
                columns.zip(starts).map(|(columns, start)| {
                    let end = (start + n_columns).min(band.along.end);
                    (*block, start..end, columns)
                })
            })
            .collect();
        parallel::each(&mut jobs, &|_, (block, x, columns)| {
            let lanes = block.lanes;
            block.clear_unused(columns);
            for column in columns.chunks_exact_mut(stride * lanes) {
                column[..lanes].fill(T::ZERO);
                column[(1 + band.across.end) * lanes..].fill(T::ZERO);
            }
            // Few slices at a time, along their rows: as many streams as the hardware prefetches.
            for (i, slices) in block.slices.chunks(TOGETHER).enumerate() {
                for y in band.across.clone() {
                    let mut rows = images.rows(volume, y, slices);
                    for row in &mut rows {
                        *row = &row[x.clone()];
                    }
                    let pixels = &mut columns[(1 + y) * lanes + i * TOGETHER..];
                    T::interleave(self.instructions, &rows, stride * lanes, pixels);
                }
            }
        });
        parts.into_iter().map(|(_, part)| &*part).collect()
    }
}
