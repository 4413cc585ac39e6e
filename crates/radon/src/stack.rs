//! Stacks of slices in the layout of callers, and memory for blocks in the layout of the kernels, with slices innermost.

use std::ops::Range;

use crate::error::{RadonError, length, product};
use crate::sample::finite_and_signal;
use crate::{Sample, parallel};

/// Index order of the sinograms of many slices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum StackOrder {
    /// `[view][slice][bin]`, bin fastest: one detector image per view, as acquired by a camera.
    #[default]
    ViewSliceBin,
    /// `[slice][view][bin]`, bin fastest: one sinogram per slice.
    SliceViewBin,
}

/// A stack of slices, each of `n_rows` rows (image rows or views) of `row_len` samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stack {
    pub(crate) what: &'static str,
    pub(crate) n_slices: usize,
    pub(crate) n_rows: usize,
    pub(crate) row_len: usize,
    pub(crate) order: StackOrder,
}

impl Stack {
    pub(crate) fn check_length(&self, given: usize) -> Result<(), RadonError> {
        let slice_len = self.n_rows * self.row_len;
        length(
            self.what,
            given,
            product(self.what, slice_len, self.n_slices)?,
        )
    }

    pub(crate) fn check_slices(&self, slices: &Range<usize>) -> Result<(), RadonError> {
        if slices.start > slices.end || slices.end > self.n_slices {
            return Err(RadonError::BadRange {
                what: "slices",
                start: slices.start,
                end: slices.end,
                len: self.n_slices,
            });
        }
        Ok(())
    }

    /// Samples of one row.
    pub(crate) fn row<'a, T>(&self, data: &'a [T], row: usize, slice: usize) -> &'a [T] {
        &data[self.row_start(row, slice)..][..self.row_len]
    }

    /// Index of the first sample of a row.
    pub(crate) fn row_start(&self, row: usize, slice: usize) -> usize {
        let row = match self.order {
            StackOrder::ViewSliceBin => row * self.n_slices + slice,
            StackOrder::SliceViewBin => slice * self.n_rows + row,
        };
        row * self.row_len
    }

    /// Returns the slices that contain signal; rejects NaN and infinity in them.
    pub(crate) fn with_signal<T: Sample>(
        &self,
        data: &[T],
        slices: Range<usize>,
    ) -> Result<Vec<bool>, RadonError> {
        let slices = parallel::collect(slices.len(), &|k| {
            let slice = slices.start + k;
            let mut signal = false;
            let mut bad = None;
            for row in 0..self.n_rows {
                let start = self.row_start(row, slice);
                let samples = &data[start..][..self.row_len];
                let (all_finite, any_signal) = finite_and_signal(samples);
                if !all_finite && bad.is_none() {
                    let at = samples.iter().position(|x| !x.finite());
                    bad = at.map(|at| start + at);
                }
                signal |= any_signal;
            }
            (signal, bad)
        });
        match slices.iter().filter_map(|&(_, bad)| bad).min() {
            Some(index) => Err(RadonError::BadSample {
                what: self.what,
                index,
                given: data[index].f64(),
            }),
            None => Ok(slices.into_iter().map(|(signal, _)| signal).collect()),
        }
    }

    /// Returns row `row` of each of the given slices.
    pub(crate) fn rows<'a, T>(&self, data: &'a [T], row: usize, slices: &[usize]) -> Vec<&'a [T]> {
        let of = |&slice: &usize| self.row(data, row, slice);
        slices.iter().map(of).collect()
    }

    /// Returns all rows for separate writing: `[row][slice]`.
    pub(crate) fn rows_mut<'a, T>(&self, data: &'a mut [T]) -> Vec<Vec<&'a mut [T]>> {
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

/// Returns a part of `memory` with `len` samples that starts on a cache line; `memory` grows if needed.
pub(crate) fn aligned<T: Sample>(memory: &mut Vec<T>, len: usize) -> &mut [T] {
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
