//! Material coordinates of a point in a wall.
//!
//! A map of cells over the half-plane lists the lines near a point. Newton's method finds its line between two of them.

use std::ops::Range;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::voxels::coverage::check_range;
use crate::wall::cells::Cells;
use crate::wall::isoline::{ON_AXIS, cross, less, norm};
use crate::wall::root::rising_root;
use crate::{Pose, RevolveError, Shell, VoxelGrid};

impl Shell {
    /// Returns layer and s of a point (x, r); `None` outside the wall.
    ///
    /// The wall includes its surfaces, to 1e-12 of its size. Cost: several evaluations of both curves.
    #[must_use]
    pub fn locate(&self, p: [f64; 2]) -> Option<[f64; 2]> {
        let [first, last] = self.cells.at(p)?;
        let (lines, isolines) = (&self.lines, &self.isolines);
        let slack = ON_AXIS * isolines.size;
        let mut line = &lines[first];
        let mut before = line.before(p);
        // The end lines have no neighbour for points on them.
        if first == 0 && before < 0.0 && before >= -slack * norm(line.along) {
            before = 0.0;
        }
        for (k, next) in lines.iter().enumerate().take(last + 1).skip(first + 1) {
            let mut ahead = next.before(p);
            if k == lines.len() - 1 && ahead > 0.0 && ahead <= slack * norm(next.along) {
                ahead = 0.0;
            }
            if before >= 0.0 && ahead <= 0.0 {
                let rising = |s: f64| {
                    let (before, fall) = isolines.before(p, s);
                    (-before, fall)
                };
                let start = line.s + (next.s - line.s) * before / (before - ahead);
                // Where a wall has no thickness the root is indeterminate, but not for points on one of its lines.
                let s = match (before == 0.0, ahead == 0.0) {
                    (true, false) => line.s,
                    (false, true) => next.s,
                    _ => rising_root(rising, [line.s, next.s], start),
                };
                let isoline = isolines.at(s);
                let from = less(p, isoline.inner.position);
                let length = norm(isoline.line);
                let t = (from[0] * isoline.line[0] + from[1] * isoline.line[1]) / (length * length);
                let excess = slack / length;
                let off = cross(from, isoline.line).abs() / length;
                if t >= -excess && t <= 1.0 + excess && off <= slack {
                    return Some([isoline.share(t.clamp(0.0, 1.0)), s]);
                }
            }
            (line, before) = (next, ahead);
        }
        None
    }

    /// Evaluates a function at the centre of every voxel of some slices that lies in the wall in `pose`. Returns the index of the
    /// voxel among these slices (`[z][y][x]`), ascending, with the result for the centre in the body frame, the layer and s.
    ///
    /// Cost: proportional to the number of voxels in the cylinder around the wall. Rows are distributed over the threads of the
    /// current rayon pool; results are bitwise independent of their number.
    ///
    /// # Errors
    /// [`RevolveError::BadRange`] for slices outside the grid.
    pub fn map_voxels<T: Send>(
        &self,
        pose: &Pose,
        grid: &VoxelGrid,
        slices: Range<usize>,
        f: impl Fn(&Point3<f64>, [f64; 2]) -> T + Sync,
    ) -> Result<Vec<(usize, T)>, RevolveError> {
        check_range(grid, &slices)?;
        let [nx, ny, _] = grid.shape();
        let Cells { low, high, .. } = &self.cells;
        let reach = ([low[0], high[0]], high[1]);
        let (first, f) = (slices.start * ny, &f);
        Ok((first..slices.end * ny)
            .into_par_iter()
            .with_min_len(slices.len() * ny / 1024) // about a thousand jobs at most: after a stop each unwinds its thread
            .flat_map_iter(|row| {
                simd_set::unit(slices.len() * ny);
                let (y, z) = (row % ny, row / ny);
                within(grid, pose, reach, y, z).filter_map(move |x| {
                    let p = pose.to_body(&grid.centre(x, y, z));
                    // Not `hypot`: squares of voxel sizes neither underflow nor overflow.
                    let r = (p.y * p.y + p.z * p.z).sqrt();
                    let found = self.locate([p.x, r])?;
                    Some(((row - first) * nx + x, f(&p, found)))
                })
            })
            .collect())
    }
}

/// Returns the voxels of a row with centres that may lie in a cylinder about the axis of the body, given by its x and radius.
pub(crate) fn within(
    grid: &VoxelGrid,
    pose: &Pose,
    (x, radius): ([f64; 2], f64),
    iy: usize,
    iz: usize,
) -> Range<usize> {
    let nx = grid.shape()[0];
    let from = pose.to_body(&grid.centre(0, iy, iz));
    let step = pose.vector_to_body(&nalgebra::Vector3::x()) * grid.spacing()[0];
    let (mut low, mut high) = (0.0f64, nx as f64);
    if step.x != 0.0 {
        let ends = x.map(|x| (x - from.x) / step.x);
        low = low.max(ends[0].min(ends[1]));
        high = high.min(ends[0].max(ends[1]));
    } else if from.x < x[0] || from.x > x[1] {
        return 0..0;
    }
    let a = step.y * step.y + step.z * step.z;
    let b = from.y * step.y + from.z * step.z;
    let c = from.y * from.y + from.z * from.z - radius * radius;
    if a > 0.0 {
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return 0..0;
        }
        let root = discriminant.sqrt();
        low = low.max((-b - root) / a);
        high = high.min((-b + root) / a);
    } else if c > 0.0 {
        return 0..0;
    }
    // One more on either side, for rounding.
    let first = (low - 1.0).max(0.0) as usize;
    first..((high + 2.0).max(0.0) as usize).min(nx).max(first)
}
