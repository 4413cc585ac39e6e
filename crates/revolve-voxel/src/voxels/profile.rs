//! Line profiles of a volume, and edge widths.

use nalgebra::Point3;

use crate::error::{at_least, finite, length, zeros};
use crate::{RevolveError, Sample, VoxelGrid};

/// Values at equally spaced points of a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    step: f64,
    values: Vec<f64>,
}

impl VoxelGrid {
    /// Samples a volume `[z][y][x]` at `n` equally spaced points from one position to another, both included: trilinear between
    /// voxel centres, 0 beyond the outermost centres.
    ///
    /// ```
    /// use revolve_voxel::{VoxelGrid, nalgebra::Point3};
    /// let grid = VoxelGrid::cube(8, 1.0)?;
    /// let x: Vec<f32> = (0..512).map(|k| grid.centre(k % 8, 0, 0).x as f32).collect();
    /// let line = grid.profile(&x, [Point3::new(-2.0, 0.3, 0.1), Point3::new(2.0, 0.7, 0.0)], 5)?;
    /// assert_eq!(line.values(), [-2.0, -1.0, 0.0, 1.0, 2.0]);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a volume of another size, [`RevolveError::TooFew`] for less than two points;
    /// [`RevolveError::NotFinite`] for a position, [`RevolveError::TooLarge`].
    pub fn profile<T: Sample>(
        &self,
        volume: &[T],
        [from, to]: [Point3<f64>; 2],
        n: usize,
    ) -> Result<Profile, RevolveError> {
        length("volume", self.len(), volume.len())?;
        at_least("points of a profile", n, 2)?;
        for v in from.iter().chain(to.iter()) {
            finite("end of a profile", *v)?;
        }
        let mut values = zeros("points of a profile", n)?;
        let along = |k: usize| from + (to - from) * (k as f64 / (n - 1) as f64);
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.interpolate(volume, &along(k));
        }
        Ok(Profile {
            step: (to - from).norm() / (n - 1) as f64,
            values,
        })
    }

    fn interpolate<T: Sample>(&self, volume: &[T], p: &Point3<f64>) -> f64 {
        let (shape, origin, spacing) = (self.shape(), self.origin(), self.spacing());
        let at: [f64; 3] = std::array::from_fn(|a| (p[a] - origin[a]) / spacing[a]);
        if (0..3).any(|a| !(at[a] >= 0.0 && at[a] <= (shape[a] - 1) as f64)) {
            return 0.0;
        }
        let low = at.map(|v| v as usize);
        let high: [usize; 3] = std::array::from_fn(|a| (low[a] + 1).min(shape[a] - 1));
        let between = |a: usize, [from, to]: [f64; 2]| from + (at[a] - low[a] as f64) * (to - from);
        let row = |y: usize, z: usize| {
            let row = &volume[(z * shape[1] + y) * shape[0]..][..shape[0]];
            between(0, [row[low[0]].to_f64(), row[high[0]].to_f64()])
        };
        let plane = |z: usize| between(1, [row(low[1], z), row(high[1], z)]);
        between(2, [plane(low[2]), plane(high[2])])
    }
}

impl Profile {
    /// Returns the values.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Subtracts `level`, the value around the edge.
    #[must_use]
    pub fn above(mut self, level: f64) -> Self {
        self.values.iter_mut().for_each(|value| *value -= level);
        self
    }

    /// Returns the distance from the last point with `high` of the largest value to the next point with `low` of it: the width of
    /// an edge that falls towards the end. Between two samples the profile is linear. `None` if it does not fall that far.
    ///
    /// ```
    /// use revolve_voxel::{VoxelGrid, nalgebra::Point3};
    /// let grid = VoxelGrid::cube(32, 0.5)?;
    /// // Falls from 1 at x = -2 to 0 at x = 2.
    /// let ramp: Vec<f64> = (0..32768)
    ///     .map(|k| ((2.0 - grid.centre(k % 32, 0, 0).x) / 4.0).clamp(0.0, 1.0))
    ///     .collect();
    /// let line = grid.profile(&ramp, [Point3::new(-6.0, 0.0, 0.0), Point3::new(6.0, 0.0, 0.0)], 241)?;
    /// assert!((line.edge_width(0.9, 0.1).unwrap() - 3.2).abs() < 1e-9);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    #[must_use]
    pub fn edge_width(&self, high: f64, low: f64) -> Option<f64> {
        let most = self.values.iter().copied().fold(0.0, f64::max);
        // Position at which the profile crosses a level between two points.
        let crossing = |k: usize, level: f64| {
            let (a, b) = (self.values[k], self.values[k + 1]);
            k as f64 + (a - level) / (a - b)
        };
        let falls = |k: usize, level: f64| self.values[k] >= level && self.values[k + 1] < level;
        let last = self.values.len() - 1;
        let start = (0..last).rev().find(|&k| falls(k, high * most))?;
        let end = (start..last).find(|&k| falls(k, low * most))?;
        Some(self.step * (crossing(end, low * most) - crossing(start, high * most)))
    }
}
