//! Every region's coverage and a label volume, in one pass.

use std::ops::Range;

use rayon::prelude::*;

use crate::coverage::{BLOCK, Painter, check};
use crate::error::zeros;
use crate::field::Field;
use crate::{Body, Error, Sample, Sampling, VoxelCounters, VoxelGrid};

/// Coverage of each region and labels, `[z][y][x]` over the slices asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionVolumes<T> {
    /// For each region, the covered fraction of every voxel.
    pub coverage: Vec<Vec<T>>,
    /// For each voxel, 0 for background or 1 + the region that covers most of it (the outer one of equals).
    pub labels: Vec<u8>,
    /// Work done.
    pub counters: VoxelCounters,
}

impl Body {
    /// Coverage of every region and labels for some slices of a grid.
    ///
    /// # Errors
    /// As [`Body::voxelize_add`]; [`Error::Length`] for more than 254 layers, which labels cannot number.
    pub fn regions<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        sampling: Sampling,
    ) -> Result<RegionVolumes<T>, Error> {
        let n = self.layers().len();
        if n > 254 {
            return Err(Error::Length {
                what: "layers (at most)",
                expected: 254,
                given: n,
            });
        }
        check(grid, &slices, sampling)?;
        let len = grid.slice_len() * slices.len();
        let fields: Vec<Field> = (0..n).map(|k| self.field(k, grid)).collect();
        let mut coverage: Vec<Vec<T>> = (0..n)
            .map(|_| zeros("voxels", len))
            .collect::<Result<_, _>>()?;
        let mut labels = zeros::<u8>("voxels", len)?;
        // Slab by slab: every layer's voxels, then what each layer holds beyond the one within and who holds most.
        let slab = grid.slice_len() * BLOCK;
        let mut slabs: Vec<Vec<&mut [T]>> = Vec::new();
        slabs.resize_with(len.div_ceil(slab), || Vec::with_capacity(n));
        for volume in &mut coverage {
            for (layers, chunk) in slabs.iter_mut().zip(volume.chunks_mut(slab)) {
                layers.push(chunk);
            }
        }
        let counters = (slabs.into_par_iter())
            .zip(labels.par_chunks_mut(slab))
            .enumerate()
            .map(|(index, (mut layers, labels))| {
                let start = slices.start + index * BLOCK;
                let z = start..(start + BLOCK).min(slices.end);
                let mut counters = VoxelCounters::default();
                for (field, out) in fields.iter().zip(&mut layers) {
                    let painter = Painter::new(self, field, grid, sampling);
                    painter.paint(z.clone(), 1.0, out, &mut counters);
                }
                for (i, label) in labels.iter_mut().enumerate() {
                    *label = separate(&mut layers, i);
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b);
        Ok(RegionVolumes {
            coverage,
            labels,
            counters,
        })
    }
}

/// Turns the layers' coverage of a voxel into the regions'; the voxel's label.
fn separate<T: Sample>(layers: &mut [&mut [T]], voxel: usize) -> u8 {
    let (mut within, mut best, mut label) = (0.0, 0.0, 0);
    for (k, layer) in layers.iter_mut().enumerate() {
        let whole = layer[voxel].to_f64();
        let own = whole - within;
        layer[voxel] = T::from_f64(own);
        within = whole;
        // The outer one of equals.
        if own > 0.0 && own >= best {
            (best, label) = (own, k as u8 + 1);
        }
    }
    if 1.0 - within >= best { 0 } else { label }
}
