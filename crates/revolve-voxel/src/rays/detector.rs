//! Parallel rays on a detector.

use nalgebra::{Point3, Vector3};

use crate::error::{countable, finite, positive, within};
use crate::{Lines, RevolveError};

/// Twelve turns, as of long helical orbits, are 75.4 radians; most angles in degrees are larger.
const VIEW_ANGLES: [f64; 2] = [-76.0, 76.0];

/// A flat parallel-beam detector that rotates about the z axis of the lab.
///
/// At view angle theta (radians) bins run along (cos theta, sin theta, 0), rows along z, rays along
/// (-sin theta, cos theta, 0). The centre of bin k of n is at `(k - (n-1)/2) * pitch + offset`; rows follow the same rule.
/// Images are indexed `[row][bin]`, bin fastest. [`Body::project`](crate::Body::project) samples at the centres of bins, a
/// [`View`](crate::View) also gives means over bins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParallelDetector {
    n_bins: usize,
    n_rows: usize,
    pitch: [f64; 2],
    offset: [f64; 2],
}

impl ParallelDetector {
    /// A detector centred on the axis of rotation; `pitch` is [bin, row].
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a bin or a row; [`RevolveError::NotPositive`], [`RevolveError::NotFinite`],
    /// [`RevolveError::TooLarge`].
    pub fn new(n_bins: usize, n_rows: usize, pitch: [f64; 2]) -> Result<Self, RevolveError> {
        countable("rays of a view", &[n_bins, n_rows])?;
        positive("bin pitch", pitch[0])?;
        positive("row pitch", pitch[1])?;
        Ok(Self {
            n_bins,
            n_rows,
            pitch,
            offset: [0.0; 2],
        })
    }

    /// Returns the detector with its centre at `offset` = [along the bins, along z].
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn with_offset(mut self, offset: [f64; 2]) -> Result<Self, RevolveError> {
        finite("bin offset", offset[0])?;
        finite("row offset", offset[1])?;
        self.offset = offset;
        Ok(self)
    }

    /// Returns the pitch [bin, row].
    #[must_use]
    pub fn pitch(&self) -> [f64; 2] {
        self.pitch
    }

    /// Returns the offset of the centre, [along the bins, along z].
    #[must_use]
    pub fn offset(&self) -> [f64; 2] {
        self.offset
    }

    /// Returns the number of bins in a row.
    #[must_use]
    pub fn n_bins(&self) -> usize {
        self.n_bins
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Returns the rays of one view, through the centres of the bins; `theta` is in radians.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`]; [`RevolveError::OutOfRange`] beyond 76 radians (twelve turns), as most angles in degrees.
    pub fn rays(&self, theta: f64) -> Result<Lines, RevolveError> {
        let (sin, cos) = within("view angle (radians)", theta, VIEW_ANGLES)?.sin_cos();
        let bins = Vector3::new(cos, sin, 0.0);
        let at = |a: usize, n: usize| self.offset[a] - 0.5 * (n as f64 - 1.0) * self.pitch[a];
        Lines::parallel(
            [self.n_bins, self.n_rows],
            Point3::from(bins * at(0, self.n_bins) + Vector3::z() * at(1, self.n_rows)),
            bins * self.pitch[0],
            Vector3::z() * self.pitch[1],
            Vector3::new(-sin, cos, 0.0),
        )
    }
}
