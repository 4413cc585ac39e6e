//! Sums of bodies on a grid, such as a moving body at several times. Each block of voxels is visited once for all bodies, and mirror images are copied.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{length, zeros};
use crate::voxels::block::{BLOCK, Block};
use crate::voxels::coverage::{Painter, check};
use crate::voxels::field::Field;
use crate::voxels::mirror::Mirror;
use crate::{Body, RevolveError, Sample, VoxelCounters, VoxelGrid};

impl Body {
    /// Returns the activity of every voxel, `[z][y][x]`, x fastest: the average over the voxel, with the covered fraction of each layer to
    /// within `tolerance`, above 0 and at most 1. Parts of the body outside the grid are omitted without an error:
    /// [`bounding_box`](Self::bounding_box) has the extent of a layer.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`], [`RevolveError::NotFinite`] for the activities, [`RevolveError::NotPositive`]
    /// or [`RevolveError::OutOfRange`] for the tolerance, [`RevolveError::TooLarge`].
    pub fn voxelize<T: Sample>(
        &self,
        grid: &VoxelGrid,
        tolerance: f64,
        activity: &[f64],
    ) -> Result<(Vec<T>, VoxelCounters), RevolveError> {
        let mut out = zeros("voxels", grid.len())?;
        let (body, slices) = ((self, activity), 0..grid.shape()[2]);
        let counters = Self::voxelize_add(&[body], grid, slices, tolerance, &mut out)?;
        Ok((out, counters))
    }

    /// Adds the activities of bodies, one for each region, to the voxels of some slices of a grid (`out`: `[z][y][x]`, those slices only). In an
    /// average over time the activities are those of the body times the fraction of the time.
    ///
    /// Slabs of a volume are bitwise identical to those of the whole. Cost: that of every surface, with one pass over the volume.
    /// If a plane that exchanges two axes of the grid contains the axes of all bodies, coverage is computed on one side and copied
    /// to the other.
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, Pose, VoxelGrid};
    /// let ball = |r: f64| -> Result<Body, revolve_voxel::RevolveError> {
    ///     let cones = Meridian::new(&[[-r, 0.0], [0.0, r], [r, 0.0]])?;
    ///     Body::new(vec![cones], Pose::axis_along_z(0.0)?)
    /// };
    /// let (small, large) = (ball(1.0)?, ball(2.0)?);
    /// let grid = VoxelGrid::cube(32, 0.15)?;
    /// let mut mean = vec![0.0f64; grid.len()];
    /// let bodies = [(&small, &[0.25][..]), (&large, &[0.75])];
    /// let counters = Body::voxelize_add(&bodies, &grid, 0..32, 1e-3, &mut mean)?;
    /// let volume = |body: &Body| body.layers()[0].mass_properties().volume;
    /// let exact = 0.25 * volume(&small) + 0.75 * volume(&large);
    /// assert!((mean.iter().sum::<f64>() * grid.voxel_volume() / exact - 1.0).abs() < 1e-3);
    /// assert!(counters.mirrored > 0);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] for a wrong buffer or number of activities; [`RevolveError::BadRange`] for slices outside the
    /// grid; [`RevolveError::NotFinite`];
    /// [`RevolveError::NotPositive`], [`RevolveError::OutOfRange`].
    pub fn voxelize_add<T: Sample>(
        bodies: &[(&Body, &[f64])],
        grid: &VoxelGrid,
        slices: Range<usize>,
        tolerance: f64,
        out: &mut [T],
    ) -> Result<VoxelCounters, RevolveError> {
        let mut layers = Vec::new();
        for &(body, activity) in bodies {
            let weights = body.weights(activity)?.into_iter().enumerate();
            let used = weights.filter(|(_, weight)| *weight != 0.0);
            layers.extend(used.map(|(k, weight)| (body, k, weight)));
        }
        check(grid, &slices, tolerance)?;
        length("volume", grid.slice_len() * slices.len(), out.len())?;
        let surfaces: Vec<_> = (layers.iter())
            .map(|&(body, layer, _)| body.simplified_for(layer, grid, tolerance))
            .collect();
        let fields: Vec<_> = (layers.iter().zip(&surfaces))
            .map(|(&(body, _, weight), surface)| (body.pose(), Field::of(surface, grid), weight))
            .collect();
        let poses = layers.iter().map(|(body, ..)| body.pose());
        let work = Work {
            painters: (fields.iter())
                .map(|(pose, field, weight)| (Painter::new(pose, field, grid, tolerance), *weight))
                .collect(),
            mirror: Mirror::of(poses, grid),
            grid,
            slices,
        };
        Ok(if work.slices.is_empty() {
            VoxelCounters::default()
        } else {
            work.add(out)
        })
    }
}

/// Layers with their weights, and the requested slices.
struct Work<'a> {
    painters: Vec<(Painter<'a>, f64)>,
    mirror: Option<Mirror>,
    grid: &'a VoxelGrid,
    slices: Range<usize>,
}

impl Work<'_> {
    fn add<T: Sample>(&self, out: &mut [T]) -> VoxelCounters {
        let kept = self.kept();
        let [nx, ny, _] = self.blocks();
        let mut slabs = Vec::new();
        let mut rest = out;
        for z in self.slices.start / BLOCK..self.slices.end.div_ceil(BLOCK) {
            let (slab, after) =
                rest.split_at_mut(self.voxels([0, 0, z])[2].len() * self.grid.slice_len());
            slabs.push((z, slab));
            rest = after;
        }
        // Images in a mirror, if there is one, are half of the units.
        let n_units = (slabs.len() * nx * ny) << u32::from(self.mirror.is_some());
        (slabs.into_par_iter())
            .map_init(Block::default, |scratch, (z, out)| {
                let mut counters = VoxelCounters::default();
                let first_slice = self.voxels([0, 0, z])[2].start;
                for at in (0..nx * ny).map(|k| [k % nx, k / nx, z]) {
                    simd_set::unit(n_units);
                    let mirror = self.mirror.as_ref().filter(|mirror| mirror.is_image(&at));
                    // The current block and its voxels.
                    let (seen, voxels) = match mirror {
                        None => (at, self.voxels(at)),
                        Some(mirror) => (mirror.image(&at), mirror.image(&self.voxels(at))),
                    };
                    let block = match kept.get(self.number(seen)) {
                        Some(Some(block)) => {
                            if mirror.is_none() {
                                counters = counters + block.counters;
                            } else if !block.is_empty() {
                                counters.mirrored +=
                                    voxels.iter().map(Range::len).product::<usize>() as u64;
                            }
                            block
                        }
                        _ => {
                            self.paint(&voxels, scratch);
                            counters = counters + scratch.counters;
                            &*scratch
                        }
                    };
                    block.add_to(mirror, self.grid, first_slice, out);
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b)
    }

    /// Indices of the blocks with requested images.
    fn kept<T: Sample>(&self) -> Vec<Option<Block<T>>> {
        let Some(mirror) = &self.mirror else {
            return Vec::new();
        };
        let [nx, ny, nz] = self.blocks();
        // About a thousand jobs at most: after a stop each unwinds its thread.
        (0..nx * ny * nz)
            .into_par_iter()
            .with_min_len(nx * ny * nz / 1024)
            .map(|k| {
                simd_set::unit(2 * nx * ny * nz);
                let at = [k % nx, k / nx % ny, k / (nx * ny)];
                let image = mirror.image(&at);
                let voxels = self.voxels(at);
                let wanted = mirror.is_image(&image) && mirror.image(&voxels) == self.voxels(image);
                (wanted && !voxels[2].is_empty()).then(|| {
                    let mut block = Block::default();
                    self.paint(&voxels, &mut block);
                    block
                })
            })
            .collect()
    }

    fn paint<T: Sample>(&self, voxels: &[Range<usize>; 3], block: &mut Block<T>) {
        block.start(voxels);
        for (painter, weight) in &self.painters {
            painter.paint(voxels, *weight, block);
        }
    }

    fn blocks(&self) -> [usize; 3] {
        self.grid.shape().map(|n| n.div_ceil(BLOCK))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.blocks();
        (z * ny + y) * nx + x
    }

    /// The voxels of a block that lie in the slices.
    fn voxels(&self, at: [usize; 3]) -> [Range<usize>; 3] {
        let shape = self.grid.shape();
        let [x, y, z] = [0, 1, 2].map(|a| at[a] * BLOCK..shape[a].min((at[a] + 1) * BLOCK));
        let start = z.start.max(self.slices.start);
        [x, y, start..z.end.min(self.slices.end).max(start)]
    }
}
