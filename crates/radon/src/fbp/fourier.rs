//! Runs by the Fourier method.

use super::options::FbpMethod;
use super::{FbpPlan, FbpScratch};
use crate::Sample;
use crate::error::RadonError;
use crate::fourier::Gridding;
use crate::pool::Pool;
use crate::stack::Stack;

impl<T: Sample> FbpPlan<T> {
    /// Returns the method of the plan: the requested one, or the choice of [`FbpMethod::Auto`].
    #[must_use]
    pub fn method(&self) -> FbpMethod {
        match (&self.gridding, self.options.method) {
            (None, _) => FbpMethod::Direct,
            (Some(_), FbpMethod::Fourier { tolerance }) => FbpMethod::Fourier { tolerance },
            (Some(_), _) => FbpMethod::Fourier {
                tolerance: FbpMethod::AUTO_TOLERANCE,
            },
        }
    }

    /// Returns the bytes of the work arrays.
    ///
    /// # Errors
    /// [`RadonError::BudgetTooSmall`] if they do not fit in [`FbpOptions::memory`](crate::FbpOptions::memory).
    pub(super) fn check_budget(&self, gridding: &Gridding<T>) -> Result<usize, RadonError> {
        let n_threads = rayon::current_num_threads();
        let least = gridding.work_bytes(n_threads) + n_threads * self.filter.scratch_bytes();
        let given = self.options.memory;
        if least > given {
            return Err(RadonError::BudgetTooSmall { least, given });
        }
        Ok(least)
    }

    /// Reconstructs slices one by one.
    pub(super) fn run_gridded(
        &self,
        gridding: &Gridding<T>,
        stack: &Stack,
        projections: &[T],
        images: &mut [(usize, &mut [T])],
        scratch: &mut FbpScratch<T>,
    ) {
        let pool = Pool::default();
        let (x, y) = self.steps.region();
        for (_part, (slice, image)) in simd_set::parts(images.iter_mut()) {
            let fill = |view: usize, out: &mut [T]| {
                let row = stack.row(projections, view, *slice);
                if row.iter().all(|&p| p == T::ZERO) {
                    return false;
                }
                pool.with(
                    || self.filter.scratch(),
                    |scratch| {
                        let rows = std::iter::once(row);
                        for filtered in self.filter.filter(rows, self.scales[view], scratch) {
                            out.copy_from_slice(filtered);
                        }
                    },
                );
                true
            };
            gridding.back_project(&fill, &[x.clone(), y.clone()], image, &mut scratch.gridding);
        }
    }
}
