//! Forward and adjoint runs over stacks of slices.
//!
//! A band of image rows is brought into the kernels' layout, slices innermost, and stays in the cache while all views read
//! (or write) its tiles. A ray sum is taken tile by tile in the same order however the work is divided, and each sample of a
//! result is written by one job: the bits do not depend on the number of threads.

use std::ops::Range;

use rayon::prelude::*;

use super::blocks::{Group, Slices};
use super::layout::{Stack, aligned};
use super::rays::{Owner, SeveralTaps, TOGETHER, Window};
use super::{Projector, ProjectorReport, ProjectorScratch, row_stride};
use crate::error::RadonError;
use crate::simd::{gather, scatter, separate};
use crate::{Sample, StackOrder};

/// Side of the square tiles of pixels that stay in the cache, and rows of a band of the forward projector; part of the definition of a ray sum's rounding.
const TILE: usize = 32;

impl Projector {
    /// As [`forward_stack`](Self::forward_stack), into projections of the caller's.
    ///
    /// Cost: two multiply-adds for each slice, view and pixel (Joseph, Siddon). Work arrays: a copy of the projections of at
    /// most 256 slices and of a band of their images.
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

        let ny = self.grid.ny();
        let n_bins = self.geometry.n_bins();
        // Rays of views along x reach into the next band.
        let spill = self.views.iter().map(|view| view.spill()).max();
        for group in slices.groups::<T>(self.instructions, self.geometry.sinogram_len()) {
            let view_len = n_bins * group.lanes;
            let rays = aligned(&mut scratch.rays, self.views.len() * view_len);
            rays.par_chunks_mut(view_len)
                .for_each(|sums| sums.fill(T::ZERO));
            let per_job = self.views.len().div_ceil(4 * rayon::current_num_threads());
            for y in (0..ny).step_by(TILE) {
                let y = y..(y + TILE).min(ny);
                let readable = y.start..y.end.saturating_add(spill.unwrap_or(0)).min(ny);
                let pixels = self.pack_band(&images, volume, &group, readable, &mut scratch.pixels);
                let tiles: Vec<Window> = self
                    .tiles(
                        y.clone(),
                        y.start,
                        row_stride(&self.grid),
                        Owner::FirstPixel,
                    )
                    .collect();
                rays.par_chunks_mut(per_job * view_len)
                    .zip(self.views.par_chunks(per_job))
                    .for_each_init(
                        || SeveralTaps::new(self.instructions),
                        |taps, (rays, views)| {
                            for tile in &tiles {
                                let rays = rays.chunks_mut(TOGETHER * view_len);
                                for (views, rays) in views.chunks(TOGETHER).zip(rays) {
                                    taps.traverse(views, tile);
                                    for (block, pixels) in group.blocks.iter().zip(&pixels) {
                                        for (view, bin, taps) in taps.iter() {
                                            let sums = view * view_len
                                                + n_bins * block.before
                                                + bin * block.lanes;
                                            let sums = &mut rays[sums..][..block.lanes];
                                            gather(self.instructions, pixels, taps, sums);
                                        }
                                    }
                                }
                            }
                        },
                    );
            }
            rows.par_iter_mut()
                .zip(rays.par_chunks_exact(view_len))
                .for_each(|(row, sums)| {
                    for block in &group.blocks {
                        let sums = &sums[n_bins * block.before..][..n_bins * block.lanes];
                        let mut bins = pick(row, block.slices, 0..n_bins);
                        separate(self.instructions, sums, block.lanes, &mut bins);
                    }
                });
        }
        Ok(slices.report())
    }

    /// As [`adjoint_stack`](Self::adjoint_stack), into a volume of the caller's.
    ///
    /// Cost: as forward, with a store for each multiply-add.
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
        for group in slices.groups::<T>(self.instructions, self.geometry.sinogram_len()) {
            let view_len = n_bins * group.lanes;
            let rays = aligned(&mut scratch.rays, self.views.len() * view_len);
            rays.par_chunks_exact_mut(view_len)
                .enumerate()
                .for_each(|(view_idx, rays)| {
                    for block in &group.blocks {
                        let rays = &mut rays[n_bins * block.before..][..n_bins * block.lanes];
                        sinograms.interleave(
                            self.instructions,
                            projections,
                            view_idx,
                            block.slices,
                            block.lanes,
                            rays,
                        );
                    }
                });
            let rays = &*rays;
            rows.par_chunks_mut(TILE).enumerate().for_each_init(
                || (SeveralTaps::new(self.instructions), Vec::new()),
                |(taps, memory), (band, rows)| {
                    let sums = aligned(memory, TILE * TILE * group.lanes);
                    let y = band * TILE..band * TILE + rows.len();
                    for mut tile in self.tiles(y.clone(), y.start, TILE, Owner::EachPixel) {
                        tile.origin = 0;
                        sums.fill(T::ZERO);
                        let rays = rays.chunks(TOGETHER * view_len);
                        for (views, rays) in self.views.chunks(TOGETHER).zip(rays) {
                            taps.traverse(views, &tile);
                            for block in &group.blocks {
                                let sums = &mut sums[TILE * TILE * block.before..]
                                    [..TILE * TILE * block.lanes];
                                for (view, bin, taps) in taps.iter() {
                                    let ray =
                                        view * view_len + n_bins * block.before + bin * block.lanes;
                                    let ray = &rays[ray..][..block.lanes];
                                    scatter(self.instructions, sums, taps, ray);
                                }
                            }
                        }
                        for block in &group.blocks {
                            let sums = &sums[TILE * TILE * block.before..];
                            for (row, sums) in
                                rows.iter_mut().zip(sums.chunks_exact(TILE * block.lanes))
                            {
                                let mut pixels = pick(row, block.slices, tile.x.clone());
                                separate(self.instructions, sums, block.lanes, &mut pixels);
                            }
                        }
                    }
                },
            );
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

    /// The image rows `y` of a group in the layout `[block][row][pixel][lane]`; returns the part of each block.
    fn pack_band<'a, T: Sample>(
        &self,
        images: &Stack,
        volume: &[T],
        group: &Group<'_>,
        y: Range<usize>,
        memory: &'a mut Vec<T>,
    ) -> Vec<&'a [T]> {
        let (nx, stride) = (self.grid.nx(), row_stride(&self.grid));
        let mut rest = aligned(memory, y.len() * stride * group.lanes);
        let mut jobs = Vec::new();
        let mut parts = Vec::new();
        for block in &group.blocks {
            let (part, others) = rest.split_at_mut(y.len() * stride * block.lanes);
            rest = others;
            parts.push((block, part));
        }
        for (block, part) in &mut parts {
            let rows = part.chunks_exact_mut(stride * block.lanes);
            jobs.extend(rows.zip(y.clone()).map(|(row, iy)| (&**block, iy, row)));
        }
        jobs.into_par_iter().for_each(|(block, iy, row)| {
            let row = &mut row[..nx * block.lanes];
            images.interleave(
                self.instructions,
                volume,
                iy,
                block.slices,
                block.lanes,
                row,
            );
        });
        parts.into_iter().map(|(_, part)| &*part).collect()
    }

    /// The tiles of the rows `y`, in memory that starts at row `first_row` and has the given row stride.
    fn tiles(
        &self,
        y: Range<usize>,
        first_row: usize,
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
            origin: (y0 - first_row) * row_stride + x0,
            owns,
        })
    }
}

/// The given samples of the rows of some slices, which are in ascending order.
fn pick<'a, T>(
    row: &'a mut [&mut [T]],
    slices: &[usize],
    samples: Range<usize>,
) -> Vec<&'a mut [T]> {
    let first = slices.first().copied().unwrap_or(0);
    let mut wanted = slices.iter().map(|slice| slice - first).peekable();
    let rows = row[first..].iter_mut().enumerate();
    rows.filter(|&(slice, _)| wanted.next_if_eq(&slice).is_some())
        .map(|(_, samples_of_slice)| &mut samples_of_slice[samples.clone()])
        .take(slices.len())
        .collect()
}
