//! Conversion between a volume `[layer][y][x]` and blocks of rows of the detector `[block][pixel]`.

use rayon::prelude::*;

use super::blur::Rows;
use super::overlap::segment;
use crate::error::{RadonError, room};
use crate::simd::{Lanes, ROWS};
use crate::{ImageGrid, Sample, SliceAxis};

/// Parts of a row below this are rounding errors of coincident edges.
const LEAST: f64 = 1e-12;

/// Overlap of layers and rows; rows that coincide with layers have one each.
#[derive(Debug)]
pub(super) struct Axial<T> {
    nx: usize,
    /// Distance in a block between neighbours in y: an odd number, to avoid cache conflicts.
    stride: usize,
    /// Pixels of a block.
    pub(super) block_len: usize,
    /// Rows of all blocks: those that overlap a layer and are within the margin of the detector.
    pub(super) rows: Rows,
    /// Layers of each row, with the fraction of the row that they fill.
    of_rows: Vec<Vec<(usize, T)>>,
    /// Rows of each layer.
    of_layers: Vec<Vec<(usize, T)>>,
}

impl<T: Sample> Axial<T> {
    /// Prepares the rows of a detector with a `margin` on either side.
    pub(super) fn new(
        grid: &ImageGrid,
        layers: &SliceAxis,
        rows: &SliceAxis,
        margin: usize,
    ) -> Result<Self, RadonError> {
        let (half, n_rows) = (0.5 * layers.spacing(), rows.n_slices());
        let lowest = rows.slice_centre(0) - 0.5 * rows.spacing();
        let place = |z: f64| (z - lowest) / rows.spacing();
        let [before, behind] = [-(margin as f64), (n_rows + margin) as f64];
        let first = (place(layers.slice_centre(0) - half) + LEAST).floor();
        let first = first.clamp(before, behind);
        let end = (place(layers.slice_centre(layers.n_slices() - 1) + half) - LEAST).ceil();
        let n_blocks = ((end.min(behind) - first).max(0.0) as usize).div_ceil(ROWS);
        let mut of_rows: Vec<Vec<(usize, T)>> = room("rows of the detector", n_blocks, ROWS)?;
        of_rows.resize_with(n_blocks * ROWS, Vec::new);
        let mut of_layers = vec![Vec::new(); layers.n_slices()];
        let place = |z: f64| (place(z) - first).clamp(0.0, of_rows.len() as f64);
        let span = |z: f64| [place(z - half), place(z + half)];
        let spans: Vec<_> = (0..layers.n_slices())
            .map(|k| span(layers.slice_centre(k)))
            .collect();
        for (layer, [low, high]) in spans.into_iter().enumerate() {
            for (row, part) in segment(low, high) {
                of_rows[row as usize].push((layer, T::of(part)));
                of_layers[layer].push((row as usize, T::of(part)));
            }
        }
        let stride = grid.nx() | 1;
        Ok(Self {
            nx: grid.nx(),
            stride,
            block_len: grid.ny() * stride,
            rows: Rows {
                n_rows,
                first: -(first as isize),
                n_blocks,
            },
            of_rows,
            of_layers,
        })
    }

    /// Returns the position of a pixel in a block.
    pub(super) fn place(&self, ix: usize, iy: usize) -> usize {
        iy * self.stride + ix
    }

    /// Computes the blocks of a volume.
    pub(super) fn read(&self, volume: &[T], blocks: &mut [Lanes<T>]) {
        let n_pixels = self.block_len / self.stride * self.nx;
        let jobs = blocks.par_chunks_mut(self.block_len);
        let jobs = jobs.zip(self.of_rows.par_chunks(ROWS));
        jobs.for_each(|(block, rows)| {
            for (iy, pixels) in block.chunks_exact_mut(self.stride).enumerate() {
                pixels.fill(Lanes::default());
                for (lane, parts) in rows.iter().enumerate() {
                    for &(layer, part) in parts {
                        let from = &volume[layer * n_pixels + iy * self.nx..][..self.nx];
                        for (pixel, &x) in pixels.iter_mut().zip(from) {
                            pixel.0[lane] += part * x;
                        }
                    }
                }
            }
        });
    }

    /// The adjoint of [`read`](Self::read).
    pub(super) fn write(&self, blocks: &[Lanes<T>], volume: &mut [T]) {
        let n_pixels = self.block_len / self.stride * self.nx;
        let jobs = volume.par_chunks_mut(n_pixels).zip(&self.of_layers);
        jobs.for_each(|(layer, parts)| {
            layer.fill(T::ZERO);
            for &(row, part) in parts {
                let block = &blocks[row / ROWS * self.block_len..][..self.block_len];
                let pixels = block.chunks_exact(self.stride);
                for (to, pixels) in layer.chunks_exact_mut(self.nx).zip(pixels) {
                    for (x, pixel) in to.iter_mut().zip(pixels) {
                        *x += part * pixel.0[row % ROWS];
                    }
                }
            }
        });
    }
}
