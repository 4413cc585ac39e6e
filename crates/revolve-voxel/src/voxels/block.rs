//! Blocks of voxels: position in the body frame, subdivision into eighths, and contributions of layers.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::voxels::mirror::Mirror;
use crate::{Pose, Sample, VoxelCounters, VoxelGrid};

/// Slices per block: blocks of 8 x 8 x 8 voxels far from surfaces are filled at once.
pub(crate) const BLOCK: usize = 8;

/// The voxels of a grid in the frame of a body.
#[derive(Debug)]
pub(crate) struct Placed<'a> {
    pub(crate) grid: &'a VoxelGrid,
    /// Centre of the first voxel.
    origin: Point3<f64>,
    /// Axes of the lab.
    pub(crate) steps: [Vector3<f64>; 3],
}

impl<'a> Placed<'a> {
    pub(crate) fn new(pose: &Pose, grid: &'a VoxelGrid) -> Self {
        Self {
            grid,
            origin: pose.to_body(&grid.centre(0, 0, 0)),
            steps: [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| pose.vector_to_body(&e)),
        }
    }

    /// Returns the centre of a block.
    pub(crate) fn centre(&self, block: &[Range<usize>; 3]) -> Point3<f64> {
        let spacing = self.grid.spacing();
        let mut centre = self.origin;
        for a in 0..3 {
            let middle = 0.5 * (block[a].start + block[a].end - 1) as f64;
            centre += self.steps[a] * (middle * spacing[a]);
        }
        centre
    }
}

/// Returns the non-empty eighths of a block, x fastest.
pub(crate) fn eighths(block: &[Range<usize>; 3]) -> impl Iterator<Item = [Range<usize>; 3]> {
    let [x, y, z] = block.each_ref().map(|range| {
        let middle = range.start + range.len().div_ceil(2);
        [range.start..middle, middle..range.end]
    });
    (0..8)
        .map(move |k| [&x[k & 1], &y[k >> 1 & 1], &z[k >> 2]].map(Range::clone))
        .filter(|part| part.iter().all(|range| !range.is_empty()))
}

/// Divides volumes into slabs of `len` voxels; groups corresponding slabs.
pub(crate) fn slabs<T>(volumes: &mut [Vec<T>], len: usize) -> Vec<Vec<&mut [T]>> {
    let n_slabs = volumes
        .first()
        .map_or(0, |volume| volume.len().div_ceil(len));
    let mut slabs: Vec<Vec<&mut [T]>> = Vec::new();
    slabs.resize_with(n_slabs, || Vec::with_capacity(volumes.len()));
    for volume in volumes {
        for (slab, chunk) in slabs.iter_mut().zip(volume.chunks_mut(len)) {
            slab.push(chunk);
        }
    }
    slabs
}

/// Contributions of layers to the voxels of a block.
#[derive(Debug, Clone, Default)]
pub(crate) struct Block<T> {
    /// First voxel and number of voxels per axis.
    first: [usize; 3],
    shape: [usize; 3],
    /// One value for all voxels, or one per voxel, `[z][y][x]`.
    same: T,
    each: Vec<T>,
    pub(crate) counters: VoxelCounters,
}

impl<T: Sample> Block<T> {
    /// Zero contributions to these voxels.
    pub(crate) fn start(&mut self, block: &[Range<usize>; 3]) {
        self.first = block.each_ref().map(|range| range.start);
        self.shape = block.each_ref().map(Range::len);
        self.same = T::default();
        self.each.clear();
        self.counters = VoxelCounters::default();
    }

    /// Adds a value to the voxels of a part.
    pub(crate) fn fill(&mut self, part: &[Range<usize>; 3], value: T) {
        let [nx, ny, nz] = self.shape;
        if self.each.is_empty() {
            if part.each_ref().map(Range::len) == self.shape {
                self.same += value;
                return;
            }
            self.each.resize(nx * ny * nz, self.same);
        }
        let [x, y, z] = [0, 1, 2].map(|a| part[a].start - self.first[a]);
        for z in z..z + part[2].len() {
            for y in y..y + part[1].len() {
                let row = (z * ny + y) * nx + x;
                for v in &mut self.each[row..row + part[0].len()] {
                    *v += value;
                }
            }
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.each.is_empty() && self.same.to_f64() == 0.0
    }

    /// Adds to some slices of a volume, from `first_slice`; mirrored on request.
    pub(crate) fn add_to(
        &self,
        mirror: Option<&Mirror>,
        grid: &VoxelGrid,
        first_slice: usize,
        out: &mut [T],
    ) {
        if self.is_empty() {
            return;
        }
        let [nx, ny, _] = self.shape;
        let (mut first, mut shape, mut steps) = (self.first, self.shape, [1, nx, nx * ny]);
        if let Some(mirror) = mirror {
            [first, shape, steps] = [first, shape, steps].map(|each| mirror.image(&each));
        }
        for z in 0..shape[2] {
            for y in 0..shape[1] {
                let row = ((first[2] - first_slice + z) * grid.shape()[1] + first[1] + y)
                    * grid.shape()[0]
                    + first[0];
                let row = &mut out[row..row + shape[0]];
                if self.each.is_empty() {
                    row.iter_mut().for_each(|v| *v += self.same);
                } else {
                    let from = &self.each[z * steps[2] + y * steps[1]..];
                    let values = from.iter().step_by(steps[0]);
                    row.iter_mut().zip(values).for_each(|(v, add)| *v += *add);
                }
            }
        }
    }
}
