//! Sets of voxels: intersection, union, erosion, and distance to a set.

use crate::error::{RevolveError, countable, length};
use rayon::prelude::*;
use std::ops::Range;

/// A set of voxels of a grid, in index order `[z][y][x]` (x fastest).
///
/// Masks define the region of a measurement. Voxels in the wall at every phase, two voxels away from its edge: an intersection and
/// an erosion. Background more than three voxels from the body: [`Mask::farther_than`]. All operations are exact and independent of
/// the number of threads.
///
/// ```
/// use revolve_voxel::Mask;
/// let mut mask = Mask::new([5, 5, 5], vec![true; 125])?;
/// mask.erode(2); // the border of the grid counts as outside
/// assert_eq!(mask.count(), 1);
/// assert_eq!(mask.farther_than(1.0).count(), 125 - 7);
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    shape: [usize; 3],
    set: Vec<bool>,
}

impl Mask {
    /// Creates a mask of `shape = [nz, ny, nx]` from its voxels in index order `[z][y][x]`.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] if their number is not `nz ny nx`; [`RevolveError::TooLarge`] if the product of the sides
    /// (zeros counted as one) exceeds the address space.
    pub fn new(shape: [usize; 3], set: Vec<bool>) -> Result<Self, RevolveError> {
        countable("voxels of a mask", &shape.map(|n| n.max(1)))?;
        length("mask", shape.iter().product(), set.len())?;
        Ok(Self { shape, set })
    }

    /// Returns the numbers of voxels `[nz, ny, nx]`.
    #[must_use]
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Returns the voxels, `[z][y][x]`.
    #[must_use]
    pub fn as_slice(&self) -> &[bool] {
        &self.set
    }

    /// Returns the number of voxels in the set.
    #[must_use]
    pub fn count(&self) -> usize {
        self.set.iter().filter(|&&set| set).count()
    }

    /// Intersects the set with `other`.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a side of another length.
    pub fn intersect(&mut self, other: &Mask) -> Result<(), RevolveError> {
        self.combine(other, |a, b| a & b)
    }

    /// Unites the set with `other`.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a side of another length.
    pub fn unite(&mut self, other: &Mask) -> Result<(), RevolveError> {
        self.combine(other, |a, b| a | b)
    }

    fn combine(
        &mut self,
        other: &Mask,
        with: impl Fn(bool, bool) -> bool,
    ) -> Result<(), RevolveError> {
        for (own, given) in self.shape.into_iter().zip(other.shape) {
            length("side of a mask", own, given)?;
        }
        for (a, &b) in self.set.iter_mut().zip(&other.set) {
            *a = with(*a, b);
        }
        Ok(())
    }

    /// Keeps, in every slice, the pixels that are in `slice` (index order `[y][x]`).
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] if it does not have `ny nx` pixels.
    pub fn intersect_slices(&mut self, slice: &[bool]) -> Result<(), RevolveError> {
        length(
            "slice of a mask",
            self.shape[1] * self.shape[2],
            slice.len(),
        )?;
        if !slice.is_empty() {
            for voxels in self.set.chunks_mut(slice.len()) {
                for (voxel, &keep) in voxels.iter_mut().zip(slice) {
                    *voxel &= keep;
                }
            }
        }
        Ok(())
    }

    /// Erodes the set `steps` times: removes each voxel with one of its six neighbours outside the set. The border of the grid is
    /// outside. Cost: `O(steps * voxels)`, with at most half of the shortest side of the grid as steps.
    pub fn erode(&mut self, steps: usize) {
        let [nz, ny, nx] = self.shape;
        let slice = ny * nx;
        if slice == 0 {
            return;
        }
        let mut old = Vec::new();
        for _ in 0..steps.min(nz.min(ny).min(nx).div_ceil(2)) {
            old.clone_from(&self.set);
            let at = |index: usize, step: isize| {
                old.get(index.wrapping_add_signed(step))
                    .copied()
                    .unwrap_or(false)
            };
            self.set
                .par_chunks_mut(slice)
                .enumerate()
                .for_each(|(z, out)| {
                    for (i, voxel) in out.iter_mut().enumerate().filter(|(_, voxel)| **voxel) {
                        let (y, x) = (i / nx, i % nx);
                        let index = z * slice + i;
                        *voxel = x > 0
                            && x + 1 < nx
                            && y > 0
                            && y + 1 < ny
                            && at(index, -1)
                            && at(index, 1)
                            && at(index, -(nx as isize))
                            && at(index, nx as isize)
                            && at(index, -(slice as isize))
                            && at(index, slice as isize);
                    }
                });
        }
    }

    /// Returns the voxels with centres more than `distance` voxels (Euclidean) from the centre of every voxel of this set; all
    /// voxels if the set is empty.
    ///
    /// Cost: number of runs of voxels in the set times `distance^2`.
    #[must_use]
    pub fn farther_than(&self, distance: f64) -> Mask {
        let [nz, ny, nx] = self.shape;
        let mut far = vec![true; self.set.len()];
        let rows: Vec<Vec<Range<usize>>> = self.set.par_chunks(nx.max(1)).map(runs).collect();
        // A negative or NaN distance excludes nothing; the grid bounds a large one.
        let reach = distance.min(nz as f64 + ny as f64 + nx as f64);
        if reach >= 0.0 && !rows.is_empty() {
            let offsets = disc_rows(reach, [nz, ny]);
            far.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
                let (z, y) = ((row / ny) as isize, (row % ny) as isize);
                for &(dz, dy, half) in &offsets {
                    let (sz, sy) = (z + dz, y + dy);
                    if (0..nz as isize).contains(&sz) && (0..ny as isize).contains(&sy) {
                        for run in &rows[sz as usize * ny + sy as usize] {
                            let end = out.len().min(run.end + half);
                            out[run.start.saturating_sub(half)..end].fill(false);
                        }
                    }
                }
            });
        }
        Mask {
            shape: self.shape,
            set: far,
        }
    }
}

/// Returns the rows `(dz, dy)` of a ball of radius `reach`, each with its half width in voxels, bounded by the grid.
fn disc_rows(reach: f64, sides: [usize; 2]) -> Vec<(isize, isize, usize)> {
    let [z, y] = sides.map(|n| (reach.floor() as isize).min(n as isize - 1));
    let mut rows = Vec::new();
    for dz in -z..=z {
        for dy in -y..=y {
            let rest = reach * reach - (dz * dz + dy * dy) as f64;
            if rest >= 0.0 {
                rows.push((dz, dy, rest.sqrt().floor() as usize));
            }
        }
    }
    rows
}

/// Returns the runs of set voxels in a row.
fn runs(row: &[bool]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut at = 0;
    while let Some(start) = row[at..].iter().position(|&set| set).map(|k| at + k) {
        at = row[start..]
            .iter()
            .position(|&set| !set)
            .map_or(row.len(), |k| start + k);
        runs.push(start..at);
    }
    runs
}
