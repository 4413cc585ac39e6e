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
                // x * 0 is NaN for NaN and infinity alone; the sum stays a plain loop.
                let poison: T = samples.iter().map(|&x| x * T::ZERO).sum();
                if poison != T::ZERO && bad.is_none() {
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
        let from: Vec<&[T]> = slices
            .iter()
            .map(|&slice| &data[self.row_start(row, slice)..][..self.row_len])
            .collect();
        for (start, out) in (0..).step_by(SQUARE).zip(out.chunks_mut(SQUARE * lanes)) {
            if slices.len() < lanes {
                out.fill(T::ZERO);
            }
            for (group, from) in from.chunks(SQUARE).enumerate() {
                for (sample, out) in out.chunks_exact_mut(lanes).enumerate() {
                    let out = &mut out[group * SQUARE..][..from.len()];
                    for (x, row) in out.iter_mut().zip(from) {
                        *x = row[start + sample];
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
    for (start, block) in (first..).step_by(SQUARE).zip(block.chunks(SQUARE * lanes)) {
        for (lane, &slice) in slices.iter().enumerate() {
            let to = &mut rows[slice][start..];
            for (x, samples) in to.iter_mut().zip(block.chunks_exact(lanes)) {
                *x = samples[lane];
            }
        }
    }
}
