//! Conversion between a volume `[layer][y][x]` and blocks of rows of the detector `[block][pixel]`.

use std::ops::Range;

use rayon::prelude::*;

use super::lanes::{LANES, Lanes};
use super::overlap::segment;
use crate::error::{RadonError, room};
use crate::{ImageGrid, Sample, SliceAxis};

/// Overlap of layers and rows of the frame; rows that coincide with layers have one each.
#[derive(Debug)]
pub(super) struct Axial<T> {
    nx: usize,
    /// Distance in a block between neighbours in y: an odd number, to avoid cache conflicts.
    stride: usize,
    /// Pixels of a block.
    pub(super) block_len: usize,
    /// Blocks of the frame that overlap any layer.
    pub(super) blocks: Range<usize>,
    /// Layers of each row of these blocks, with the fraction of the row that they fill.
    rows: Vec<Vec<(usize, T)>>,
    /// Rows of each layer.
    layers: Vec<Vec<(usize, T)>>,
}

impl<T: Sample> Axial<T> {
    /// Prepares a frame that has `margin` rows before the detector's, and `n_blocks` blocks.
    pub(super) fn new(
        grid: &ImageGrid,
        layers: &SliceAxis,
        rows: &SliceAxis,
        margin: usize,
        n_blocks: usize,
    ) -> Result<Self, RadonError> {
        let n_rows = n_blocks * LANES;
        let mut seen: Vec<Vec<(usize, T)>> = room("rows of the detector", n_rows, 1)?;
        seen.resize_with(n_rows, Vec::new);
        let first = rows.slice_centre(0) - rows.spacing() * (margin as f64 + 0.5);
        let place = |z: f64| ((z - first) / rows.spacing()).max(0.0).min(n_rows as f64);
        let half = 0.5 * layers.spacing();
        for layer in 0..layers.n_slices() {
            let z = layers.slice_centre(layer);
            for (row, part) in segment(place(z - half), place(z + half)) {
                seen[row as usize].push((layer, T::of(part)));
            }
        }
        let any = |block: &usize| seen[block * LANES..][..LANES].iter().any(|r| !r.is_empty());
        let start = (0..n_blocks).find(any).unwrap_or(0);
        let end = (start..n_blocks).rfind(any).map_or(start, |last| last + 1);
        let rows = seen[start * LANES..end * LANES].to_vec();
        let mut of_layers = vec![Vec::new(); layers.n_slices()];
        for (row, parts) in rows.iter().enumerate() {
            for &(layer, part) in parts {
                of_layers[layer].push((row, part));
            }
        }
        let stride = grid.nx() | 1;
        Ok(Self {
            nx: grid.nx(),
            stride,
            block_len: grid.ny() * stride,
            blocks: start..end,
            rows,
            layers: of_layers,
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
        let jobs = jobs.zip(self.rows.par_chunks(LANES));
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
        let jobs = volume.par_chunks_mut(n_pixels).zip(&self.layers);
        jobs.for_each(|(layer, parts)| {
            layer.fill(T::ZERO);
            for &(row, part) in parts {
                let block = &blocks[row / LANES * self.block_len..][..self.block_len];
                let pixels = block.chunks_exact(self.stride);
                for (to, pixels) in layer.chunks_exact_mut(self.nx).zip(pixels) {
                    for (x, pixel) in to.iter_mut().zip(pixels) {
                        *x += part * pixel.0[row % LANES];
                    }
                }
            }
        });
    }
}
