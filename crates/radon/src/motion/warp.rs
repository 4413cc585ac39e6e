//! A volume moved: what each of its voxels holds comes from elsewhere in a volume that is still.

use rayon::prelude::*;

use crate::error::{RadonError, finite, length, positive, room, within};
use crate::{LinearOperator, Sample};

/// Voxels along a volume: beyond that a place of 24 binary digits tells no voxel from the next.
const MOST_ALONG: f64 = 1048576.0;
/// Places are rounded to one over this of a voxel, so that rounding makes no part of one.
const PER_VOXEL: f64 = 1048576.0;

/// A motion that volumes are moved by for a share of the time.
#[derive(Debug, Clone, PartialEq)]
pub struct Displaced {
    /// Its share.
    pub share: f64,
    /// Of some voxels, by number `(z ny + y) nx + x`, how far from their centres along x, y and z what they hold then comes from, in the unit
    /// of their sides. All others stay.
    pub by: Vec<(usize, [f32; 3])>,
}

/// A motion as a linear map of volumes `[z][y][x]`, with its exact adjoint:
///
/// ```text
/// (W x)[v] = (1 - sum of w) x[v] + sum of w x(c_v + d)
/// ```
///
/// over the [motions](Displaced) with a displacement d of the voxel v, centred at c_v, for a share w of the time; x between centres by
/// trilinear interpolation, and nothing outside the volume. So W pulls x back along the motion, and of several motions it is the mean over time.
///
/// Whole voxels are moved exactly. Between them a function with second derivatives is off by at most an eighth of each times the square of
/// the voxel's side. Places are rounded to 2^-20 of a voxel, or
/// 24 binary digits.
///
/// The adjoint gives what a voxel holds to the eight that it came from, by the same weights: <W x, y> = <x, Wᵀ y> to rounding. Same
/// bits for any number of threads. Cost, either way: a copy of the volume and eight multiply-adds a displacement. Memory: 28 bytes a
/// displacement.
///
/// ```
/// use radon::{Displaced, LinearOperator, RadonError, Warp};
/// // Three voxels of 2 cm in a row. The middle one is filled from half-way to the first, the last one for half of the time from the middle one.
/// let halfway = Displaced { share: 1.0, by: vec![(1, [-1.0, 0.0, 0.0])] };
/// let at_times = Displaced { share: 0.5, by: vec![(2, [-2.0, 0.0, 0.0])] };
/// let warp = Warp::new([3, 1, 1], [2.0; 3], &[halfway, at_times])?;
/// let mut moved = [0.0f64; 3];
/// warp.forward_into(&[1.0, 5.0, 7.0], &mut moved)?;
/// assert_eq!(moved, [1.0, 3.0, 6.0]);
/// let mut back = [0.0f64; 3];
/// warp.adjoint_into(&[1.0, 1.0, 1.0], &mut back)?;
/// assert_eq!(back, [1.5, 1.0, 0.5]);
/// # Ok::<(), RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    shape: [usize; 3],
    /// By voxel.
    samples: Vec<Row>,
    /// Where those of each slice begin, and the end.
    of_slice: Vec<usize>,
    /// Numbers of samples by the lower of the two slices that they read, from the one before the first.
    by_read: Vec<u32>,
    /// Where those of each such slice begin, and the end.
    reads: Vec<usize>,
}

/// A displacement: from where a voxel takes what it holds, in voxels from the centre of the first one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    voxel: u32,
    at: [f32; 3],
    share: f64,
}

impl Warp {
    /// The map of volumes of so many voxels along x, y and z, of these sides.
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for a volume that is not from 1 to 2^20 voxels long, or a voxel that there is not;
    /// [`RadonError::TooLarge`] for 2^32 voxels or displacements; [`RadonError::NotPositive`] for a side, [`RadonError::NotFinite`] for a
    /// side, a displacement or a share.
    pub fn new(
        shape: [usize; 3],
        spacing: [f64; 3],
        motions: &[Displaced],
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
        for Displaced { share, by } in motions {
            finite("share of a motion", *share)?;
            for (voxel, by) in by {
                within("voxel to warp", *voxel as f64, 0.0, (n_voxels - 1) as f64)?;
                for along in by {
                    finite("displacement", f64::from(*along))?;
                }
                let centre = [voxel % nx, voxel / nx % ny, voxel / slice];
                // Beyond a voxel from the edge there is nothing, however far.
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
        // Stable: sums are in the order of the motions.
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

    /// The samples whose lower slice is z - 1, which reads it with the second weight, or z.
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

/// `a * b` if 32 bits count them.
fn countable(what: &'static str, a: usize, b: usize) -> Result<usize, RadonError> {
    let all = a.checked_mul(b).filter(|n| *n <= u32::MAX as usize);
    all.ok_or(RadonError::TooLarge { what, a, b })
}

/// Numbers of the samples by the lower of the slices that they read, from the one before the first on, and where those of each begin.
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

/// What stays of a voxel with these samples.
fn stays<T: Sample>(samples: &[Row]) -> T {
    T::of(1.0 - samples.iter().map(|row| row.share).sum::<f64>())
}

fn by_voxel(samples: &[Row]) -> impl Iterator<Item = &[Row]> {
    samples.chunk_by(|a, b| a.voxel == b.voxel)
}

impl Row {
    /// The two neighbours along an axis, those that there are, with their weights.
    fn along<T: Sample>(&self, axis: usize, n: usize) -> [Option<(usize, T)>; 2] {
        let low = self.at[axis].floor();
        let up = f64::from(self.at[axis]) - f64::from(low);
        [(low, 1.0 - up), (low + 1.0, up)].map(|(place, weight)| {
            let there = weight > 0.0 && place >= 0.0 && place < n as f32;
            there.then(|| (place as usize, T::of(weight)))
        })
    }

    /// The neighbours within a slice: their numbers in it, and their weights.
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
