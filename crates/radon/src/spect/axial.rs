//! Conversion between a volume `[layer][y][x]` and blocks of rows of the detector `[block][pixel]`.

use super::blur::Rows;
use super::overlap::segment;
use crate::error::{RadonError, room};
use crate::simd::{Lanes, ROWS};
use crate::{ImageGrid, InstructionSet, Sample, SliceAxis, parallel};

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
        let mut of_layers: Vec<Vec<(usize, T)>> = room("layers", layers.n_slices(), 1)?;
        let last = of_rows.len() as f64;
        let place = |z: f64| (place(z) - first).clamp(0.0, last);
        for layer in 0..layers.n_slices() {
            let z = layers.slice_centre(layer);
            let mut rows = Vec::new();
            for (row, part) in segment(place(z - half), place(z + half)) {
                of_rows[row as usize].push((layer, T::of(part)));
                rows.push((row as usize, T::of(part)));
            }
            of_layers.push(rows);
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
    pub(super) fn read(&self, set: InstructionSet, volume: &[T], blocks: &mut [Lanes<T>]) {
        let (nx, n_pixels) = (self.nx, self.n_pixels());
        parallel::chunks(blocks, self.block_len, &|k, block| {
            let rows = &self.of_rows[k * ROWS..][..ROWS];
            let mut lines = vec![T::ZERO; ROWS * nx];
            for (iy, pixels) in block.chunks_exact_mut(self.stride).enumerate() {
                for (line, parts) in lines.chunks_exact_mut(nx).zip(rows) {
                    let from = |layer: usize| &volume[layer * n_pixels + iy * nx..][..nx];
                    add_parts(line, parts, from);
                }
                let lines: [&[T]; ROWS] = std::array::from_fn(|k| &lines[k * nx..][..nx]);
                T::interleave(set, &lines, ROWS, Lanes::flat_mut(pixels));
            }
        });
    }

    /// The adjoint of [`read`](Self::read); `rows` are a work array.
    pub(super) fn write(
        &self,
        set: InstructionSet,
        blocks: &[Lanes<T>],
        rows: &mut Vec<T>,
        volume: &mut [T],
    ) {
        let (nx, n_pixels) = (self.nx, self.n_pixels());
        rows.resize(self.of_rows.len() * n_pixels, T::ZERO);
        parallel::chunks(rows, ROWS * n_pixels, &|k, rows| {
            let block = &blocks[k * self.block_len..][..self.block_len];
            let mut rows: Vec<_> = rows.chunks_exact_mut(n_pixels).collect();
            for (iy, pixels) in block.chunks_exact(self.stride).enumerate() {
                let lines = rows.iter_mut().map(|row| &mut row[iy * nx..][..nx]);
                T::separate(
                    set,
                    Lanes::flat(pixels),
                    ROWS,
                    &mut lines.collect::<Vec<_>>(),
                );
            }
        });
        parallel::chunks(volume, n_pixels, &|k, layer| {
            let from = |row: usize| &rows[row * n_pixels..][..n_pixels];
            add_parts(layer, &self.of_layers[k], from);
        });
    }

    /// Pixels of a layer.
    fn n_pixels(&self) -> usize {
        self.block_len / self.stride * self.nx
    }
}

/// Computes a sum of parts of rows.
fn add_parts<'a, T: Sample>(sum: &mut [T], parts: &[(usize, T)], row: impl Fn(usize) -> &'a [T]) {
    sum.fill(T::ZERO);
    for &(k, part) in parts {
        for (sum, &x) in sum.iter_mut().zip(row(k)) {
            *sum += part * x;
        }
    }
}
