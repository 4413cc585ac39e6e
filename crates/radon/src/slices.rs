//! Heights of the slices of a stack.

use crate::error::{RadonError, at_least, finite, positive};

/// Heights of a stack of slices or detector rows: the centre of slice `k` of `n` is at `(k - (n-1)/2) * spacing + centre`.
///
/// ```
/// # use radon::SliceAxis;
/// let slices = SliceAxis::new(4, 0.5)?;
/// assert_eq!(slices.slice_centre(0), -0.75);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceAxis {
    n_slices: usize,
    spacing: f64,
    centre: f64,
}

impl SliceAxis {
    /// `n_slices` slices, `spacing` apart, centred on z = 0.
    ///
    /// # Errors
    /// No slice; a `spacing` that is not finite and greater than zero.
    pub fn new(n_slices: usize, spacing: f64) -> Result<Self, RadonError> {
        at_least("n_slices", n_slices, 1)?;
        positive("slice spacing", spacing)?;
        finite("slice extent", n_slices as f64 * spacing)?;
        Ok(Self {
            n_slices,
            spacing,
            centre: 0.0,
        })
    }

    /// The same slices with their middle at height `centre`.
    ///
    /// # Errors
    /// A `centre` that is NaN or infinite.
    pub fn with_centre(mut self, centre: f64) -> Result<Self, RadonError> {
        self.centre = finite("slice centre", centre)?;
        Ok(self)
    }

    /// Number of slices.
    #[must_use]
    pub fn n_slices(&self) -> usize {
        self.n_slices
    }

    /// Distance between neighbouring slice centres.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Height of the middle of the stack.
    #[must_use]
    pub fn centre(&self) -> f64 {
        self.centre
    }

    /// Height of the centre of slice `slice_idx`.
    #[must_use]
    pub fn slice_centre(&self, slice_idx: usize) -> f64 {
        (slice_idx as f64 - (self.n_slices - 1) as f64 / 2.0) * self.spacing + self.centre
    }
}
