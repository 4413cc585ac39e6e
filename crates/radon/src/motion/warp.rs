//! Warps of volumes: each voxel takes its value from another position of a reference volume.

use rayon::prelude::*;

use crate::error::{RadonError, finite, length, positive, room, within};
use crate::{LinearOperator, Sample};

/// Largest number of voxels along a volume: positions of 24 bits resolve voxels up to it.
const MOST_ALONG: f64 = 1048576.0;
/// Positions are rounded to this fraction of a voxel, so that rounding creates no interpolation.
const PER_VOXEL: f64 = 1048576.0;

/// A displacement of voxels during a fraction of the time.
#[derive(Debug, Clone, PartialEq)]
pub struct Displacements {
    /// Fraction of the time.
    pub fraction: f64,
    /// For some voxels, by index `(z ny + y) nx + x`: the displacement along x, y, z from the voxel's centre to the source of its value, in
    /// the unit of the voxel's sides. All other voxels are unchanged.
    pub by: Vec<(usize, [f32; 3])>,
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
/// the square of the voxel's side. Positions are rounded to 2^-20 of a voxel, or to 24 bits.
///
/// The adjoint distributes the value of a voxel to its eight sources with the same weights: <W x, y> = <x, Wᵀ y> to rounding. Bitwise
/// identical for any number of threads. Cost of either direction: a copy of the volume and eight multiply-adds per displacement. Memory: 28
/// bytes per displacement.
///
/// ```
/// use radon::{Displacements, LinearOperator, RadonError, Warp};
/// // Three voxels of 2 cm in a row. The middle one is filled from half-way to the first, the last one for half of the time from the middle one.
/// let halfway = Displacements { fraction: 1.0, by: vec![(1, [-1.0, 0.0, 0.0])] };
/// let at_times = Displacements { fraction: 0.5, by: vec![(2, [-2.0, 0.0, 0.0])] };
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
    /// Sorted by voxel.
    samples: Vec<Row>,
    /// First sample of each slice, and the end.
    of_slice: Vec<usize>,
    /// Indices of samples by the lower of the two slices that they read, from the one before the first.
    by_read: Vec<u32>,
    /// First sample of each of these slices, and the end.
    reads: Vec<usize>,
}

/// A displacement: the source of a voxel's value, in voxels from the centre of the first voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    voxel: u32,
    at: [f32; 3],
    share: f64,
}

impl Warp {
    /// Returns the map of volumes with these numbers of voxels along x, y, z and these sides.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for a volume outside 1 to 2^20 voxels long, or an index beyond its voxels; [`RadonError::TooLarge`] for
    /// 2^32 voxels or displacements; [`RadonError::NotPositive`] for a side, [`RadonError::NotFinite`] for a side, a displacement or a
    /// fraction.
    pub fn new(
        shape: [usize; 3],
        spacing: [f64; 3],
        motions: &[Displacements],
    ) -> Result<Self, RadonError> {
        let [nx, ny, nz] = shape;
        for (n, side) in shape.into_iter().zip(spacing) {
            within("length of a volume to warp", n as f64, 1.0, MOST_ALONG)?;
            positive("side of a voxel", side)?;
        }
        let (slice, what) = (nx * ny, "volume to warp");
        let n_voxels = countable(what, slice, nz)?;
        let n_samples = motions.iter().map(|motion| motion.by.len()).sum();
        countable("displacements of a warp", n_samples, 1)?;
        let mut samples = room("displacements of a warp", n_samples, 1)?;
        for Displacements {
            fraction: share,
            by,
        } in motions
        {
            finite("fraction of a motion", *share)?;
            for (voxel, by) in by {
                within("voxel to warp", *voxel as f64, 0.0, (n_voxels - 1) as f64)?;
                for along in by {
                    finite("displacement", f64::from(*along))?;
                }
                let centre = [voxel % nx, voxel / nx % ny, voxel / slice];
                // More than a voxel beyond the edge everything is zero.
                let at = [0, 1, 2].map(|a| {
                    let at = centre[a] as f64 + f64::from(by[a]) / spacing[a];
                    let at = (at * PER_VOXEL).round() / PER_VOXEL;
                    at.clamp(-1.0, shape[a] as f64) as f32
                });
                samples.push(Row {
                    voxel: *voxel as u32,
                    at,
                    share: *share,
                });
            }
        }
        // Stable: keeps the order of the motions in sums.
        samples.par_sort_by_key(|row: &Row| row.voxel);
        let of_slice = (0..=nz)
            .map(|z| samples.partition_point(|row| (row.voxel as usize) < z * slice))
            .collect();
        let (by_read, reads) = by_lower_slice(&samples, nz);
        Ok(Self {
            shape,
            samples,
            of_slice,
            by_read,
            reads,
        })
    }

    /// Voxels along x, y and z.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Number of displacements.
    pub fn n_displacements(&self) -> usize {
        self.samples.len()
    }

    fn len(&self) -> usize {
        self.shape.iter().product()
    }

    fn slice_len(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    fn samples_of(&self, z: usize) -> &[Row] {
        &self.samples[self.of_slice[z]..self.of_slice[z + 1]]
    }

    /// Returns the samples whose lower slice is z - 1, which read z with the second weight, or z.
    fn reads_of(&self, z: usize) -> impl Iterator<Item = (&Row, usize)> {
        let of = move |upper: usize| {
            let from = z + 1 - upper;
            let numbers = &self.by_read[self.reads[from]..self.reads[from + 1]];
            numbers
                .iter()
                .map(move |k| (&self.samples[*k as usize], upper))
        };
        of(1).chain(of(0))
    }
}

/// Returns `a * b` if it fits in 32 bits.
fn countable(what: &'static str, a: usize, b: usize) -> Result<usize, RadonError> {
    let all = a.checked_mul(b).filter(|n| *n <= u32::MAX as usize);
    all.ok_or(RadonError::TooLarge { what, a, b })
}

/// Sorts the indices of samples by the lower slice that they read, from the one before the first; returns the start of each slice, too.
fn by_lower_slice(samples: &[Row], n_slices: usize) -> (Vec<u32>, Vec<usize>) {
    let lower = |row: &Row| (row.at[2].floor() + 1.0) as usize;
    let mut starts = vec![0; n_slices + 3];
    for row in samples {
        starts[lower(row) + 1] += 1;
    }
    for z in 1..starts.len() {
        starts[z] += starts[z - 1];
    }
    let (mut next, mut numbers) = (starts.clone(), vec![0; samples.len()]);
    for (k, row) in samples.iter().enumerate() {
        let place = &mut next[lower(row)];
        numbers[*place] = k as u32;
        *place += 1;
    }
    (numbers, starts)
}

/// Returns the weight of a voxel's own value, given its samples.
fn stays<T: Sample>(samples: &[Row]) -> T {
    T::of(1.0 - samples.iter().map(|row| row.share).sum::<f64>())
}

fn by_voxel(samples: &[Row]) -> impl Iterator<Item = &[Row]> {
    samples.chunk_by(|a, b| a.voxel == b.voxel)
}

impl Row {
    /// Returns the existing neighbours along an axis, with their weights.
    fn along<T: Sample>(&self, axis: usize, n: usize) -> [Option<(usize, T)>; 2] {
        let low = self.at[axis].floor();
        let up = f64::from(self.at[axis]) - f64::from(low);
        [(low, 1.0 - up), (low + 1.0, up)].map(|(place, weight)| {
            let there = weight > 0.0 && place >= 0.0 && place < n as f32;
            there.then(|| (place as usize, T::of(weight)))
        })
    }

    /// Returns the neighbours within a slice: indices and weights.
    fn in_slice<T: Sample>(&self, [nx, ny, _]: [usize; 3]) -> impl Iterator<Item = (usize, T)> {
        let x = self.along::<T>(0, nx);
        let rows = self.along::<T>(1, ny).into_iter().flatten();
        rows.flat_map(move |(y, of_y)| {
            let columns = x.into_iter().flatten();
            columns.map(move |(x, of_x)| (y * nx + x, of_y * of_x))
        })
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
        let slices = data.par_chunks_mut(slice).zip(image.par_chunks(slice));
        slices.enumerate().for_each(|(z, (moved, still))| {
            moved.copy_from_slice(still);
            for samples in by_voxel(self.samples_of(z)) {
                let value = &mut moved[samples[0].voxel as usize - z * slice];
                *value *= stays::<T>(samples);
                for row in samples {
                    let mut sum = T::ZERO;
                    for (z, of_z) in row.along::<T>(2, self.shape[2]).into_iter().flatten() {
                        for (k, weight) in row.in_slice::<T>(self.shape) {
                            sum += of_z * weight * image[z * slice + k];
                        }
                    }
                    *value += T::of(row.share) * sum;
                }
            }
        });
        Ok(())
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        length("moved volume", data.len(), self.len())?;
        length("volume", image.len(), self.len())?;
        let slice = self.slice_len();
        let slices = image.par_chunks_mut(slice).zip(data.par_chunks(slice));
        slices.enumerate().for_each(|(z, (still, moved))| {
            still.copy_from_slice(moved);
            for samples in by_voxel(self.samples_of(z)) {
                let value = &mut still[samples[0].voxel as usize - z * slice];
                *value *= stays::<T>(samples);
            }
            for (row, upper) in self.reads_of(z) {
                let Some((_, of_z)) = row.along::<T>(2, self.shape[2])[upper] else {
                    continue;
                };
                let value = T::of(row.share) * data[row.voxel as usize];
                for (k, weight) in row.in_slice::<T>(self.shape) {
                    still[k] += of_z * weight * value;
                }
            }
        });
        Ok(())
    }
}
