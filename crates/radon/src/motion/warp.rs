//! Warps of volumes: each voxel takes its value from another position of a reference volume.

use std::borrow::Cow;
use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::error::{RadonError, finite, length, positive, within};
use crate::{LinearOperator, Sample, parallel};

/// Largest number of voxels along a volume: positions of 24 bits resolve voxels up to it.
const MOST_ALONG: f64 = 1048576.0;
/// Positions are rounded to this fraction of a voxel, so that rounding creates no interpolation.
const PER_VOXEL: f64 = 1048576.0;
/// Largest excess of a sum of fractions over 1.
const ROUNDING: f64 = 1e-9;

/// A displacement of voxels during a fraction of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Displacements<'a> {
    /// Fraction of the time, from 0 to 1.
    pub fraction: f64,
    /// For some voxels, by index `(z ny + y) nx + x`: the displacement along x, y, z from the voxel's centre to the source of its value, a
    /// length in the unit of `spacing`. All other voxels are unchanged.
    pub by: &'a [(usize, [f32; 3])],
}

/// A motion as a linear map of volumes `[z][y][x]`, with its exact adjoint:
///
/// ```text
/// (W x)[v] = (1 - sum of w) x[v] + sum of w x(c_v + d)
/// ```
///
/// over the [motions](Displacements) with a displacement d of the voxel v, centred at c_v, and a fraction w of the time; x is interpolated trilinearly
/// between centres and is zero outside the volume. W pulls x back along the motion; for several motions it is their time average.
///
/// Displacements by whole voxels are exact. Otherwise, for a function with second derivatives, the error is at most an eighth of each times
/// the square of the voxel's side. Positions are rounded to 2^-20 of a voxel, or to 24 bits, weights to 24 bits.
///
/// The map is a sparse matrix: motions of a voxel that read the same sources share the weights. The adjoint has the same weights:
/// <W x, y> = <x, Wᵀ y> to rounding. Bitwise identical for any number of threads. Cost of either direction: a copy of the volume and one
/// multiply-add per source of each displaced voxel, 8 for one motion, about 20 for a voxel that crosses five others. Memory: about 10 bytes
/// per source. NaN and infinity are not rejected; they reach the voxels that depend on them.
///
/// ```
/// use radon::{Displacements, LinearOperator, RadonError, Warp};
/// // Three voxels of 2 cm in a row. The middle one is filled from half-way to the first, the last one for half of the time from the middle one.
/// let halfway = Displacements { fraction: 1.0, by: &[(1, [-1.0, 0.0, 0.0])] };
/// let at_times = Displacements { fraction: 0.5, by: &[(2, [-2.0, 0.0, 0.0])] };
/// let warp = Warp::new([3, 1, 1], [2.0; 3], &[halfway, at_times])?;
/// let mut moved = [0.0f64; 3];
/// warp.forward_into(&[1.0, 5.0, 7.0], &mut moved)?;
/// assert_eq!(moved, [1.0, 3.0, 6.0]);
/// let mut back = [0.0f64; 3];
/// warp.adjoint_into(&[1.0, 1.0, 1.0], &mut back)?;
/// assert_eq!(back, [1.5, 1.0, 0.5]);
/// # Ok::<(), RadonError>(())
/// ```
#[doc(alias("deformation field", "DVF"))]
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    shape: [usize; 3],
    n_displacements: usize,
    /// The displaced voxels of each slice.
    displaced: Vec<Vec<u32>>,
    /// The parts of the matrix, sorted by target.
    blocks: Vec<Block>,
    /// Their indices, sorted by source.
    by_source: Vec<usize>,
}

/// The weights of the voxels of one slice for those of another.
#[derive(Debug, Clone, PartialEq, Default)]
struct Block {
    /// The slice that receives values, and the one that they are from.
    target: usize,
    source: usize,
    /// Voxels of the target, and the ends of their sources.
    rows: Vec<(u32, u32)>,
    /// Voxels of the source, and their weights.
    sources: Vec<(u32, f32)>,
}

impl Block {
    /// Calls `each` with every voxel of the target and its sources.
    fn for_each(&self, mut each: impl FnMut(usize, &[(u32, f32)])) {
        let mut rest = &*self.sources;
        let mut start = 0;
        for &(voxel, end) in &self.rows {
            let (sources, others) = rest.split_at((end - start) as usize);
            (rest, start) = (others, end);
            each(voxel as usize, sources);
        }
    }
}

impl Warp {
    /// Returns the map of volumes with these numbers of voxels along x, y, z and these sides.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for a volume outside 1 to 2^20 voxels long, or an index beyond its voxels; [`RadonError::TooLarge`] for
    /// 2^32 voxels or displacements; [`RadonError::NotPositive`] for a side, [`RadonError::NotFinite`] for a side or a displacement;
    /// [`RadonError::OutOfRange`] for a fraction, or the sum of the fractions of a voxel, above 1.
    pub fn new(
        shape: [usize; 3],
        spacing: [f64; 3],
        motions: &[Displacements<'_>],
    ) -> Result<Self, RadonError> {
        let [nx, ny, nz] = shape;
        for (n, side) in shape.into_iter().zip(spacing) {
            within("length of a volume to warp", n as f64, 1.0, MOST_ALONG)?;
            positive("side of a voxel", side)?;
        }
        let (slice, what) = (nx * ny, "volume to warp");
        let n_voxels = countable(what, slice, nz)?;
        let n_displacements = motions.iter().map(|motion| motion.by.len()).sum();
        // A displaced voxel has at most nine sources: eight neighbours, and itself.
        countable("weights of a warp", n_displacements, 9)?;
        let mut sorted = Vec::with_capacity(motions.len());
        for Displacements { fraction, by } in motions {
            within("fraction of a motion", *fraction, 0.0, 1.0)?;
            for (voxel, by) in *by {
                within("voxel to warp", *voxel as f64, 0.0, (n_voxels - 1) as f64)?;
                for along in by {
                    finite("displacement", f64::from(*along))?;
                }
            }
            let mut by = Cow::Borrowed(*by);
            if !by.is_sorted_by_key(|(voxel, _)| *voxel) {
                by.to_mut().sort_by_key(|(voxel, _)| *voxel);
            }
            sorted.push((*fraction, by));
        }
        let grid = Grid { shape, spacing };
        let slices = (0..nz).into_par_iter();
        let slices = slices.map_init(
            || vec![0.0; n_voxels],
            |sums, z| grid.rows(z, &sorted, sums),
        );
        let slices: Vec<_> = slices.collect::<Result<_, RadonError>>()?;
        let (displaced, blocks): (Vec<_>, Vec<_>) = slices.into_iter().unzip();
        let blocks: Vec<Block> = blocks.into_iter().flatten().collect();
        let mut by_source: Vec<usize> = (0..blocks.len()).collect();
        by_source.sort_by_key(|k| blocks[*k].source);
        Ok(Self {
            shape,
            n_displacements,
            displaced,
            blocks,
            by_source,
        })
    }

    /// Number of displacements.
    #[must_use]
    pub fn n_displacements(&self) -> usize {
        self.n_displacements
    }

    /// Number of voxels.
    pub(super) fn len(&self) -> usize {
        self.shape.iter().product()
    }

    fn slice_len(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Returns the parts with this target.
    fn to(&self, z: usize) -> impl Iterator<Item = &Block> {
        let start = self.blocks.partition_point(|block| block.target < z);
        self.blocks[start..]
            .iter()
            .take_while(move |block| block.target == z)
    }

    /// Returns the parts with this source.
    fn from(&self, z: usize) -> impl Iterator<Item = &Block> {
        let start = self
            .by_source
            .partition_point(|k| self.blocks[*k].source < z);
        let blocks = self.by_source[start..].iter().map(|k| &self.blocks[*k]);
        blocks.take_while(move |block| block.source == z)
    }
}

/// Returns `a * b` if it fits in 32 bits.
fn countable(what: &'static str, a: usize, b: usize) -> Result<usize, RadonError> {
    let all = a.checked_mul(b).filter(|n| *n <= u32::MAX as usize);
    all.ok_or(RadonError::TooLarge { what, a, b })
}

/// The voxels of a warp.
#[derive(Clone, Copy)]
struct Grid {
    shape: [usize; 3],
    spacing: [f64; 3],
}

/// Displacements sorted by voxel, with their fraction of the time.
type Sorted<'a> = (f64, Cow<'a, [(usize, [f32; 3])]>);

impl Grid {
    /// Computes the displaced voxels of a slice and the parts of the matrix with this target. `sums` is zero for all voxels, before and
    /// after.
    fn rows(
        self,
        z: usize,
        motions: &[Sorted<'_>],
        sums: &mut [f64],
    ) -> Result<(Vec<u32>, Vec<Block>), RadonError> {
        let [nx, ny, _] = self.shape;
        let (slice, start) = (nx * ny, z * nx * ny);
        let mut rest: Vec<_> = motions
            .iter()
            .map(|(fraction, by)| {
                let from = by.partition_point(|(voxel, _)| *voxel < start);
                (*fraction, &by[from..])
            })
            .collect();
        let (mut displaced, mut blocks) = (Vec::new(), BTreeMap::<usize, Block>::new());
        let mut sources = Vec::new();
        for voxel in start..start + slice {
            let mut stays = 1.0;
            sources.clear();
            for (fraction, rest) in &mut rest {
                while let Some((_, by)) = rest.first().filter(|(other, _)| *other == voxel) {
                    *rest = &rest[1..];
                    stays -= *fraction;
                    self.for_each_source(voxel, *by, |source, weight| {
                        sources.push(source);
                        sums[source] += *fraction * weight;
                    });
                }
            }
            if sources.is_empty() && stays == 1.0 {
                continue;
            }
            // The fractions may differ from 1 by rounding.
            let moves = 1.0 - stays;
            within("fractions of a voxel", moves, 0.0, 1.0 + ROUNDING)?;
            displaced.push((voxel - start) as u32);
            sources.push(voxel);
            sums[voxel] += stays;
            sources.sort_unstable();
            sources.dedup();
            for of_slice in sources.chunk_by(|a, b| a / slice == b / slice) {
                let source = of_slice[0] / slice;
                let block = blocks.entry(source).or_insert_with(|| Block {
                    target: z,
                    source,
                    ..Block::default()
                });
                for source in of_slice {
                    let weight = std::mem::take(&mut sums[*source]) as f32;
                    if weight != 0.0 {
                        block.sources.push(((source % slice) as u32, weight));
                    }
                }
                block
                    .rows
                    .push(((voxel - start) as u32, block.sources.len() as u32));
            }
        }
        Ok((displaced, blocks.into_values().collect()))
    }

    /// Calls `each` with the existing neighbours of the source of a voxel, and their weights.
    fn for_each_source(self, voxel: usize, by: [f32; 3], mut each: impl FnMut(usize, f64)) {
        let [nx, ny, _] = self.shape;
        let centre = [voxel % nx, voxel / nx % ny, voxel / (nx * ny)];
        let along = [0, 1, 2].map(|a| {
            let at = centre[a] as f64 + f64::from(by[a]) / self.spacing[a];
            // More than a voxel beyond the edge everything is zero.
            let at = (at * PER_VOXEL).round() / PER_VOXEL;
            let at = f64::from(at.clamp(-1.0, self.shape[a] as f64) as f32);
            let up = at - at.floor();
            [(at.floor(), 1.0 - up), (at.floor() + 1.0, up)].map(|(place, weight)| {
                let there = weight > 0.0 && place >= 0.0 && place < self.shape[a] as f64;
                there.then_some((place as usize, weight))
            })
        });
        let [x, y, z] = along.map(|pair| pair.into_iter().flatten());
        for (z, of_z) in z {
            for (y, of_y) in y.clone() {
                for (x, of_x) in x.clone() {
                    each((z * ny + y) * nx + x, of_z * of_y * of_x);
                }
            }
        }
    }
}

impl<T: Sample> LinearOperator<T> for Warp {
    fn image_len(&self) -> usize {
        self.len()
    }

    fn data_len(&self) -> usize {
        self.len()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        length("volume", image.len(), self.len())?;
        length("moved volume", data.len(), self.len())?;
        let slice = self.slice_len();
        parallel::chunks(data, slice, &|z, moved| {
            moved.copy_from_slice(&image[z * slice..][..slice]);
            for voxel in &self.displaced[z] {
                moved[*voxel as usize] = T::ZERO;
            }
            for block in self.to(z) {
                let from = &image[block.source * slice..][..slice];
                block.for_each(|voxel, sources| {
                    let mut sum = T::ZERO;
                    for &(source, weight) in sources {
                        sum += T::of(weight.into()) * from[source as usize];
                    }
                    moved[voxel] += sum;
                });
            }
        });
        Ok(())
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        length("moved volume", data.len(), self.len())?;
        length("volume", image.len(), self.len())?;
        let slice = self.slice_len();
        parallel::chunks(image, slice, &|z, still| {
            still.copy_from_slice(&data[z * slice..][..slice]);
            for voxel in &self.displaced[z] {
                still[*voxel as usize] = T::ZERO;
            }
            for block in self.from(z) {
                let to = &data[block.target * slice..][..slice];
                block.for_each(|voxel, sources| {
                    for &(source, weight) in sources {
                        still[source as usize] += T::of(weight.into()) * to[voxel];
                    }
                });
            }
        });
        Ok(())
    }
}
