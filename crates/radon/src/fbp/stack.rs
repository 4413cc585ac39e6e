//! A stack of sinograms as a caller holds it.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::RadonError;
use crate::geometry::StackOrder;
use crate::sample::{Sample, finite_and_signal};

/// The caller's projections and their shape.
#[derive(Debug)]
pub struct Stack<'a, T> {
    pub(super) projections: &'a [T],
    pub(super) n_slices: usize,
    pub(super) order: StackOrder,
    pub(super) n_views: usize,
    pub(super) n_bins: usize,
}

impl<'a, T: Sample> Stack<'a, T> {
    pub(super) fn row(&self, view: usize, slice: usize) -> &'a [T] {
        let start = self
            .order
            .start_of(view, slice, self.n_views, self.n_slices, self.n_bins);
        &self.projections[start..start + self.n_bins]
    }

    /// Whether each slice holds a sample other than zero.
    pub(super) fn signal(&self, slices: Range<usize>) -> Result<Vec<bool>, RadonError> {
        slices
            .into_par_iter()
            .map(|slice| {
                let mut signal = false;
                for view in 0..self.n_views {
                    let row = self.row(view, slice);
                    let (all_finite, any_signal) = finite_and_signal(row);
                    if !all_finite {
                        let at = row.iter().position(|p| !p.finite()).unwrap_or(0);
                        let index = self.order.start_of(
                            view,
                            slice,
                            self.n_views,
                            self.n_slices,
                            self.n_bins,
                        ) + at;
                        return Err(RadonError::BadSample {
                            name: "projections",
                            index,
                            given: row[at].f64(),
                        });
                    }
                    signal |= any_signal;
                }
                Ok(signal)
            })
            .collect()
    }
}
