//! Sets of voxels: intersection, union, erosion, and what lies far from a set.

use crate::Sample;
use crate::error::{Error, countable, length};
use rayon::prelude::*;
use std::ops::Range;

/// A set of voxels of a grid, in index order `[z][y][x]` (x fastest).
///
/// Masks state *where* a measure is taken: "voxels that lie in the wall at every phase, two voxels
/// away from its edge" is an intersection and an erosion; "background more than three voxels from
/// the body" is [`Mask::farther_than`]. All operations are exact and independent of the number of
/// threads.
///
/// ```
/// use revolve_voxel::Mask;
/// let mut mask = Mask::new([5, 5, 5], vec![true; 125])?;
/// mask.erode(2); // the border of the grid counts as outside
/// assert_eq!(mask.count(), 1);
/// assert_eq!(mask.farther_than(1.0).count(), 125 - 7);
/// # Ok::<(), revolve_voxel::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    shape: [usize; 3],
    set: Vec<bool>,
}

impl Mask {
    /// A mask of `shape = [nz, ny, nx]` from its voxels in index order `[z][y][x]`.
    ///
    /// # Errors
    /// [`Error::Length`] if their number is not `nz ny nx`; [`Error::TooLarge`] for sides whose product, one of zero
    /// counted as one, is beyond any memory.
    pub fn new(shape: [usize; 3], set: Vec<bool>) -> Result<Self, Error> {
        countable("voxels of a mask", &shape.map(|n| n.max(1)))?;
        length("mask", shape.iter().product(), set.len())?;
        Ok(Self { shape, set })
    }

    /// The voxels whose value satisfies `predicate`; values in index order `[z][y][x]`.
    ///
    /// # Errors
    /// [`Error::Length`] if their number is not `nz ny nx`.
    pub fn of_values<T: Sample>(
        shape: [usize; 3],
        values: &[T],
        predicate: impl Fn(f64) -> bool + Sync,
    ) -> Result<Self, Error> {
        let set = values
            .par_iter()
            .with_min_len(1 << 14)
            .map(|value| predicate(value.to_f64()))
            .collect();
        Self::new(shape, set)
    }

    /// Numbers of voxels `[nz, ny, nx]`.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// The voxels, `[z][y][x]`.
    pub fn as_slice(&self) -> &[bool] {
        &self.set
    }

    /// How many voxels are in the set.
    pub fn count(&self) -> usize {
        self.set.iter().filter(|&&set| set).count()
    }

    /// Keeps the voxels that are in `other` too.
    ///
    /// # Errors
    /// [`Error::Length`] for a side of another length.
    pub fn intersect(&mut self, other: &Mask) -> Result<(), Error> {
        self.combine(other, |a, b| a & b)
    }

    /// Adds the voxels of `other`.
    ///
    /// # Errors
    /// [`Error::Length`] for a side of another length.
    pub fn unite(&mut self, other: &Mask) -> Result<(), Error> {
        self.combine(other, |a, b| a | b)
    }

    fn combine(&mut self, other: &Mask, with: impl Fn(bool, bool) -> bool) -> Result<(), Error> {
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
    /// [`Error::Length`] if it does not hold `ny nx` pixels.
    pub fn intersect_slices(&mut self, slice: &[bool]) -> Result<(), Error> {
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

    /// Takes away, `steps` times, each voxel that has one of its six neighbours outside the set.
    /// Beyond the border of the grid is outside. Cost: `O(steps * voxels)`, and no more than half of the grid's shortest side
    /// of steps, since nothing is left then.
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

    /// The voxels whose centre is more than `distance` voxels (Euclidean, between centres) from
    /// the centre of every voxel of this set; all voxels if the set is empty.
    ///
    /// Cost: runs of voxels of the set times `distance^2`; rows without one cost nothing.
    pub fn farther_than(&self, distance: f64) -> Mask {
        let [nz, ny, nx] = self.shape;
        let mut far = vec![true; self.set.len()];
        let rows: Vec<Vec<Range<usize>>> = self.set.par_chunks(nx.max(1)).map(runs).collect();
        // A negative or NaN distance excludes nothing; the grid bounds the reach of a huge one.
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

/// The rows `(dz, dy)` of a ball of radius `reach`, each with its half width in voxels; none longer than the grid.
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

/// Where a row's voxels are set, in runs.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn masks() -> impl Strategy<Value = Mask> {
        (1usize..7, 1usize..7, 1usize..9).prop_flat_map(|(nz, ny, nx)| {
            proptest::collection::vec(proptest::bool::weighted(0.2), nz * ny * nx)
                .prop_map(move |set| Mask::new([nz, ny, nx], set).unwrap())
        })
    }

    fn coordinates(shape: [usize; 3], index: usize) -> [f64; 3] {
        let [_, ny, nx] = shape;
        [index / (ny * nx), index / nx % ny, index % nx].map(|i| i as f64)
    }

    proptest! {
        /// Against the definition: all pairs of voxels.
        #[test]
        fn farther_than_is_its_definition(mask in masks(), distance in 0.0..4.0f64) {
            let far = mask.farther_than(distance);
            for (i, &is_far) in far.as_slice().iter().enumerate() {
                let p = coordinates(mask.shape(), i);
                let near = mask.as_slice().iter().enumerate().any(|(j, &set)| {
                    let q = coordinates(mask.shape(), j);
                    let squared: f64 = p.iter().zip(&q).map(|(a, b)| (a - b) * (a - b)).sum();
                    set && squared <= distance * distance
                });
                prop_assert_eq!(is_far, !near);
            }
        }

        /// A voxel survives `k` erosions if all voxels within city-block distance `k` are in the
        /// set (and in the grid).
        #[test]
        fn erosion_is_a_city_block_ball(mask in masks(), steps in 0usize..3) {
            let mut eroded = mask.clone();
            eroded.erode(steps);
            let [nz, ny, nx] = mask.shape();
            for (i, &kept) in eroded.as_slice().iter().enumerate() {
                let [z, y, x] = coordinates(mask.shape(), i).map(|c| c as isize);
                let k = steps as isize;
                let mut expected = true;
                for dz in -k..=k { for dy in -k..=k { for dx in -k..=k {
                    if dz.abs() + dy.abs() + dx.abs() <= k {
                        let (z, y, x) = (z + dz, y + dy, x + dx);
                        let inside = (0..nz as isize).contains(&z) && (0..ny as isize).contains(&y) && (0..nx as isize).contains(&x);
                        expected &= inside && mask.as_slice()[((z as usize) * ny + y as usize) * nx + x as usize];
                    }
                }}}
                prop_assert_eq!(kept, expected);
            }
        }
    }

    #[test]
    fn erosion_ends_when_nothing_is_left() {
        // One more step than leaves a voxel, and as many as can be asked for.
        let full = Mask::new([5, 7, 6], vec![true; 210]).unwrap();
        for (steps, left) in [(2, 3 * 2), (3, 0), (usize::MAX, 0)] {
            let mut mask = full.clone();
            mask.erode(steps);
            assert_eq!(mask.count(), left, "{steps}");
        }
    }

    #[test]
    fn values_and_slices() {
        let values = [0.0f64, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let mut mask = Mask::of_values([2, 2, 2], &values, |v| v > 2.5).unwrap();
        assert_eq!(mask.count(), 5);
        mask.intersect_slices(&[true, false, false, true]).unwrap();
        let kept: Vec<usize> = (0..8).filter(|&i| mask.as_slice()[i]).collect();
        assert_eq!(kept, [3, 4, 7]);
        assert!(mask.intersect_slices(&[true]).is_err());
    }

    #[test]
    fn sets_are_united_and_intersected() {
        let mask = |bits: [u8; 4]| Mask::new([1, 2, 2], bits.map(|b| b == 1).to_vec()).unwrap();
        let mut set = mask([1, 1, 0, 0]);
        set.unite(&mask([1, 0, 1, 0])).unwrap();
        assert_eq!(set, mask([1, 1, 1, 0]));
        set.intersect(&mask([0, 1, 1, 1])).unwrap();
        assert_eq!(set, mask([0, 1, 1, 0]));
        // As many voxels, but in another shape: refused, and nothing is changed.
        let other = Mask::new([2, 2, 1], vec![true; 4]).unwrap();
        assert!(matches!(
            set.unite(&other),
            Err(Error::Length {
                expected: 1,
                given: 2,
                ..
            })
        ));
        assert!(set.intersect(&other).is_err());
        assert_eq!(set, mask([0, 1, 1, 0]));
    }

    #[test]
    fn wrong_length_is_no_mask() {
        assert!(matches!(
            Mask::new([2, 2, 2], vec![true; 7]),
            Err(Error::Length {
                expected: 8,
                given: 7,
                ..
            })
        ));
        assert!(Mask::new([usize::MAX, 2, 2], vec![]).is_err());
        assert!(Mask::of_values([1, 1, 3], &[0.0f32, 1.0], |v| v > 0.5).is_err());
        assert_eq!(
            Mask::new([0, 3, 0], vec![])
                .unwrap()
                .farther_than(2.0)
                .count(),
            0
        );
        assert_eq!(
            Mask::new([1, 1, 2], vec![true, false])
                .unwrap()
                .farther_than(-1.0)
                .count(),
            2
        );
    }
}
