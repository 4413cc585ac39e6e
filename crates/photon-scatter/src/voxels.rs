//! Ready sources and media: a point, and grids of voxels.

use crate::error::{ScatterError, within};
use crate::medium::DENSEST;
use crate::{Emission, Medium, Piece, Random, Source};

/// A point of activity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSource {
    /// Position in cm.
    pub position: [f64; 3],
    /// Total activity.
    pub activity: f64,
}

impl Source for PointSource {
    fn emit(&self, _: &mut Random) -> Emission {
        Emission {
            position: self.position,
            weight: self.activity,
        }
    }

    fn is_empty(&self) -> bool {
        self.activity == 0.0
    }
}

/// Activity per cm^3 in voxels, constant in each. Without activity it has no scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct VoxelSource {
    grid: Voxels,
    /// Activity of each voxel and all voxels before it.
    cumulative: Vec<f64>,
}

impl VoxelSource {
    /// A grid of `[nx, ny, nz]` voxels with a spacing in cm: centre k of n at `(k - (n - 1) / 2) spacing`, relative to the origin or to
    /// [`with_centre`](Self::with_centre). `activity` per cm^3 is `[z][y][x]`, x fastest.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for no voxel, another number of values, a spacing outside 1e-4 to 1e3 cm, and values that are negative or
    /// not finite.
    pub fn new(
        size: [usize; 3],
        spacing: [f64; 3],
        activity: &[f32],
    ) -> Result<Self, ScatterError> {
        let grid = Voxels::new(size, spacing, activity, ("activity of a voxel", f64::MAX))?;
        let (mut sum, volume) = (0.0, spacing.iter().product::<f64>());
        let mut cumulative = Vec::with_capacity(activity.len());
        for value in activity {
            sum += volume * f64::from(*value);
            cumulative.push(sum);
        }
        Ok(Self { grid, cumulative })
    }

    /// Moves the centre of the grid, in cm.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for a coordinate that is not finite or beyond 1e5 cm.
    pub fn with_centre(mut self, centre: [f64; 3]) -> Result<Self, ScatterError> {
        self.grid.centre = checked(centre)?;
        Ok(self)
    }
}

impl Source for VoxelSource {
    fn emit(&self, random: &mut Random) -> Emission {
        let (sums, last) = (&self.cumulative, self.cumulative.len() - 1);
        let (weight, place) = (sums[last], sums[last] * random.uniform());
        let voxel = sums.partition_point(|sum| *sum <= place).min(last);
        let [nx, ny, _] = self.grid.size;
        let index = [voxel % nx, voxel / nx % ny, voxel / (nx * ny)];
        let position = [0, 1, 2].map(|k| self.grid.plane(k, index[k] as f64 + random.uniform()));
        Emission { position, weight }
    }

    fn is_empty(&self) -> bool {
        self.cumulative.last() == Some(&0.0)
    }
}

/// Density in voxels, constant in each; nothing outside the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct VoxelMedium {
    grid: Voxels,
    density: Vec<f32>,
}

impl VoxelMedium {
    /// A grid as that of [`VoxelSource::new`], with densities in g/cm^3 as those of [`Piece::density`], 1 for water. Attenuation coefficients
    /// in 1/cm are not densities: divide them by [`water_attenuation`](crate::water_attenuation) at their energy, 0.152 at 140.5 keV.
    ///
    /// # Errors
    /// As [`VoxelSource::new`]; densities above 30 g/cm^3.
    pub fn new(size: [usize; 3], spacing: [f64; 3], density: &[f32]) -> Result<Self, ScatterError> {
        let limit = ("density of a voxel in g/cm^3", DENSEST);
        let grid = Voxels::new(size, spacing, density, limit)?;
        let density = density.to_vec();
        Ok(Self { grid, density })
    }

    /// Moves the centre of the grid, in cm.
    ///
    /// # Errors
    /// As [`VoxelSource::with_centre`].
    pub fn with_centre(mut self, centre: [f64; 3]) -> Result<Self, ScatterError> {
        self.grid.centre = checked(centre)?;
        Ok(self)
    }
}

impl Medium for VoxelMedium {
    fn is_empty(&self) -> bool {
        self.density.iter().all(|density| *density == 0.0)
    }

    /// Stretches between the planes of the voxels; equal neighbours are one.
    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>) {
        let Voxels { size, spacing, .. } = self.grid;
        // Components along the axes from the position to a plane.
        let plane = |k: usize, n: usize| self.grid.plane(k, n as f64) - position[k];
        let (mut enter, mut end) = (0.0_f64, f64::MAX);
        for k in 0..3 {
            // A ray in a face of the grid, 0 / 0, is outside.
            let [a, b] = [0, size[k]].map(|n| plane(k, n) / direction[k]);
            (enter, end) = (enter.max(a.min(b)), end.min(a.max(b)));
        }
        // The voxel at the start, and for each axis the distance of the plane that the ray crosses next.
        let mut index = [0, 1, 2].map(|k| {
            let place = (enter * direction[k] - plane(k, 0)) / spacing[k];
            (place as usize).min(size[k] - 1)
        });
        let next = |k: usize, index: usize| match direction[k] == 0.0 {
            true => f64::INFINITY,
            false => plane(k, index + usize::from(direction[k] > 0.0)) / direction[k],
        };
        let mut planes = [0, 1, 2].map(|k| next(k, index[k]));
        while enter < end {
            let k = (1..3).fold(0, |k, l| if planes[l] < planes[k] { l } else { k });
            let exit = planes[k].min(end).max(enter);
            let voxel = (index[2] * size[1] + index[1]) * size[0] + index[0];
            let density = f64::from(self.density[voxel]);
            let last = pieces.last_mut();
            match last.filter(|last| last.density == density && last.exit == enter) {
                Some(last) => last.exit = exit,
                None => pieces.push(Piece {
                    enter,
                    exit,
                    density,
                }),
            }
            enter = exit;
            index[k] = index[k].wrapping_add_signed(direction[k].signum() as isize);
            if index[k] >= size[k] {
                return;
            }
            planes[k] = next(k, index[k]);
        }
    }
}

/// A grid about its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Voxels {
    size: [usize; 3],
    spacing: [f64; 3],
    centre: [f64; 3],
}

impl Voxels {
    fn new(
        size: [usize; 3],
        spacing: [f64; 3],
        values: &[f32],
        (what, most): (&'static str, f64),
    ) -> Result<Self, ScatterError> {
        for k in 0..3 {
            within("number of voxels along an axis", size[k] as f64, [1.0, 1e5])?;
            within("spacing of the voxels in cm", spacing[k], [1e-4, 1e3])?;
        }
        let (given, expected) = (values.len() as f64, size.map(|n| n as f64));
        let range = [expected.iter().product(); 2];
        within("number of values of the voxels", given, range)?;
        for value in values {
            within(what, f64::from(*value), [0.0, most])?;
        }
        let centre = [0.0; 3];
        Ok(Self {
            size,
            spacing,
            centre,
        })
    }

    /// Position at a number of voxels from the first face of the grid.
    fn plane(&self, axis: usize, voxels: f64) -> f64 {
        self.centre[axis] + (voxels - 0.5 * self.size[axis] as f64) * self.spacing[axis]
    }
}

fn checked(centre: [f64; 3]) -> Result<[f64; 3], ScatterError> {
    for x in centre {
        within("centre of the voxels in cm", x, [-1e5, 1e5])?;
    }
    Ok(centre)
}
