//! Between stacks of slices as callers hold them and blocks with the slices innermost, as the kernels want them.

use rayon::prelude::*;

use crate::error::{RadonError, length, product};
use crate::{Sample, StackOrder};

/// A stack of slices, each of `n_rows` rows (image rows or views) of `row_len` samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stack {
    pub(super) name: &'static str,
    pub(super) n_slices: usize,
    pub(super) n_rows: usize,
    pub(super) row_len: usize,
    pub(super) order: StackOrder,
}

/// Samples that are copied between rows and lanes at a time: a cache line of `f32`.
const SQUARE: usize = 16;

impl Stack {
    pub(super) fn check_length(&self, given: usize) -> Result<(), RadonError> {
        let slice_len = self.n_rows * self.row_len;
        length(
            self.name,
            given,
            product(self.name, slice_len, self.n_slices)?,
        )
    }

    fn row_start(&self, row: usize, slice: usize) -> usize {
        self.order
            .row_start(row, slice, self.n_rows, self.n_slices, self.row_len)
    }

    /// Which slices hold anything but zeros; refuses NaN and infinity.
    pub(super) fn slices_with_signal<T: Sample>(
        &self,
        data: &[T],
    ) -> Result<Vec<bool>, RadonError> {
        let scan = |slice: usize| {
            let mut signal = false;
            let mut bad = None;
            for row in 0..self.n_rows {
                let start = self.row_start(row, slice);
                let samples = &data[start..][..self.row_len];
                // Without a way out early these are plain vector loops.
                let all_finite = samples.iter().fold(true, |all, x| all & x.finite());
                if !all_finite && bad.is_none() {
                    bad = samples
                        .iter()
                        .position(|x| !x.finite())
                        .map(|at| start + at);
                }
                signal |= samples.iter().any(|&x| x != T::ZERO);
            }
            (signal, bad)
        };
        let slices: Vec<_> = (0..self.n_slices).into_par_iter().map(scan).collect();
        match slices.iter().filter_map(|&(_, bad)| bad).min() {
            Some(index) => Err(RadonError::BadSample {
                name: self.name,
                index,
                given: data[index].f64(),
            }),
            None => Ok(slices.into_iter().map(|(signal, _)| signal).collect()),
        }
    }

    /// Row `row` of the given slices, slices innermost: `out[sample * lanes + lane]`. Lanes beyond the slices get zero.
    pub(super) fn interleave<T: Sample>(
        &self,
        data: &[T],
        row: usize,
        slices: &[usize],
        lanes: usize,
        out: &mut [T],
    ) {
        if slices.len() < lanes {
            out.fill(T::ZERO);
        }
        for (group, slices) in slices.chunks(SQUARE).enumerate() {
            // Rows beyond the slices repeat the first and are not copied out.
            let mut from = [&data[self.row_start(row, slices[0])..][..self.row_len]; SQUARE];
            for (from, &slice) in from.iter_mut().zip(slices) {
                *from = &data[self.row_start(row, slice)..][..self.row_len];
            }
            for (square, out) in out.chunks_mut(SQUARE * lanes).enumerate() {
                let start = square * SQUARE;
                let n = out.len() / lanes;
                let mut samples = [[T::ZERO; SQUARE]; SQUARE];
                for (to, from) in samples.iter_mut().zip(from) {
                    match from[start..].first_chunk() {
                        Some(whole) => *to = *whole,
                        None => to[..n].copy_from_slice(&from[start..]),
                    }
                }
                for (i, out) in out.chunks_exact_mut(lanes).enumerate() {
                    let out = &mut out[group * SQUARE..];
                    match out.first_chunk_mut::<SQUARE>() {
                        Some(out) if slices.len() == SQUARE => {
                            *out = std::array::from_fn(|lane| samples[lane][i]);
                        }
                        _ => {
                            for (lane, x) in out.iter_mut().take(slices.len()).enumerate() {
                                *x = samples[lane][i];
                            }
                        }
                    }
                }
            }
        }
    }

    /// All rows, to be written apart from each other: `[row][slice]`.
    pub(super) fn rows_mut<'a, T>(&self, data: &'a mut [T]) -> Vec<Vec<&'a mut [T]>> {
        let mut rows: Vec<Vec<&mut [T]>> = Vec::new();
        rows.resize_with(self.n_rows, || Vec::with_capacity(self.n_slices));
        for (i, samples) in data.chunks_exact_mut(self.row_len).enumerate() {
            let row = match self.order {
                StackOrder::ViewSliceBin => i / self.n_slices,
                StackOrder::SliceViewBin => i % self.n_rows,
            };
            rows[row].push(samples);
        }
        rows
    }
}

/// The other way: samples `first..` of the rows of the given slices from `block[sample * lanes + lane]`.
pub(super) fn separate<T: Sample>(
    block: &[T],
    lanes: usize,
    slices: &[usize],
    first: usize,
    rows: &mut [&mut [T]],
) {
    for (group, slices) in slices.chunks(SQUARE).enumerate() {
        for (start, block) in (first..).step_by(SQUARE).zip(block.chunks(SQUARE * lanes)) {
            let n = block.len() / lanes;
            let mut samples = [[T::ZERO; SQUARE]; SQUARE];
            for (i, from) in block.chunks_exact(lanes).enumerate() {
                let from = &from[group * SQUARE..];
                for (to, &x) in samples.iter_mut().zip(from) {
                    to[i] = x;
                }
            }
            for (samples, &slice) in samples.iter().zip(slices) {
                let row = &mut rows[slice][start..start + n];
                match row.first_chunk_mut() {
                    Some(whole) => *whole = *samples,
                    None => row.copy_from_slice(&samples[..n]),
                }
            }
        }
    }
}

/// A part of `memory`, of `len` samples, that starts on a cache line, as vectors of slices should; `memory` grows if need be.
pub(super) fn aligned<T: Sample>(memory: &mut Vec<T>, len: usize) -> &mut [T] {
    const LINE: usize = 64;
    if memory.len() < len + LINE / size_of::<T>() {
        memory.resize(len + LINE / size_of::<T>(), T::ZERO);
    }
    let start = memory
        .as_ptr()
        .align_offset(LINE)
        .min(LINE / size_of::<T>());
    &mut memory[start..start + len]
}
