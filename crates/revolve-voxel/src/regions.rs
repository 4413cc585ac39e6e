//! Every region's coverage and a label volume, in one pass.

use std::ops::Range;

use rayon::prelude::*;

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
        let mut counters = VoxelCounters::default();
        let mut coverage: Vec<Vec<T>> = Vec::with_capacity(n);
        for layer in 0..n {
            // Activity 1 up to this layer: its indicator alone.
            let activity: Vec<f64> = (0..n).map(|k| f64::from(u8::from(k <= layer))).collect();
            let mut out = vec![T::default(); grid.slice_len() * slices.len()];
            counters = counters
                + self.voxelize_add(grid, slices.clone(), sampling, &activity, 1.0, &mut out)?;
            coverage.push(out);
        }
        // From whole layers to what each holds beyond the one within, the outermost first.
        for layer in (1..n).rev() {
            let (within, own) = coverage.split_at_mut(layer);
            own[0]
                .par_iter_mut()
                .zip(&within[layer - 1])
                .for_each(|(v, inner)| {
                    *v = T::from_f64(v.to_f64() - inner.to_f64());
                });
        }
        let labels = (0..coverage[0].len())
            .into_par_iter()
            .map(|i| {
                let total: f64 = coverage.iter().map(|c| c[i].to_f64()).sum();
                let mut best = (1.0 - total, 0);
                for (k, c) in coverage.iter().enumerate().rev() {
                    let share = c[i].to_f64();
                    if share > best.0 {
                        best = (share, k as u8 + 1);
                    }
                }
                best.1
            })
            .collect();
        Ok(RegionVolumes {
            coverage,
            labels,
            counters,
        })
    }
}
