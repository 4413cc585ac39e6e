//! Points in a raster: origins or ends of rays.

use nalgebra::{Point3, Vector3};

use crate::error::finite;
use crate::{Pose, RevolveError};

/// Points in a raster: point (bin, row) is `first + bin * bin_step + row * row_step`. Steps may be zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointRaster {
    /// The first point.
    pub first: Point3<f64>,
    /// Step from a bin to the next.
    pub bin_step: Vector3<f64>,
    /// Step from a row to the next.
    pub row_step: Vector3<f64>,
}

impl From<Point3<f64>> for PointRaster {
    /// One point for all bins and rows.
    fn from(first: Point3<f64>) -> Self {
        Self {
            first,
            bin_step: Vector3::zeros(),
            row_step: Vector3::zeros(),
        }
    }
}

impl PointRaster {
    /// Returns a point.
    #[inline(always)]
    pub(crate) fn at(&self, bin: usize, row: usize) -> Point3<f64> {
        self.first + self.bin_step * bin as f64 + self.row_step * row as f64
    }

    /// Returns the raster in the frame of a body.
    pub(super) fn in_body(&self, pose: &Pose) -> Self {
        Self {
            first: pose.to_body(&self.first),
            bin_step: pose.vector_to_body(&self.bin_step),
            row_step: pose.vector_to_body(&self.row_step),
        }
    }

    /// Returns a bound on all coordinates of a raster of a size.
    pub(super) fn farthest(&self, [n_bins, n_rows]: [usize; 2]) -> Result<f64, RevolveError> {
        (0..3).try_fold(0.0, |most: f64, k| {
            let (bins, rows) = (self.bin_step[k].abs(), self.row_step[k].abs());
            let reach = self.first[k].abs() + bins * n_bins as f64 + rows * n_rows as f64;
            Ok(most.max(finite("place of the farthest ray", reach)?))
        })
    }
}
