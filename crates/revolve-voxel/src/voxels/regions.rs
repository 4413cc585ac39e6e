//! Coverage of every region, and a volume of labels.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{at_most, length, zeros};
use crate::voxels::block::{BLOCK, slabs};
use crate::voxels::coverage::check;
use crate::{Body, RevolveError, Sample, Sector, VoxelCounters, VoxelGrid};

/// Labels are bytes.
const MOST_LABELS: usize = 254;

/// Coverage of each region and labels, `[z][y][x]` over the requested slices.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RegionVolumes<T> {
    /// For each region, the covered fraction of every voxel.
    pub coverage: Vec<Vec<T>>,
    /// For each voxel, 0 for background or 1 + the region with the largest coverage (the outer one of equals); then the pieces of
    /// [`RegionVolumes::label_pieces`].
    pub labels: Vec<u8>,
    /// Work done.
    pub counters: VoxelCounters,
}

impl Body {
    /// Returns coverage of every region and labels for some slices of a grid.
    ///
    /// # Errors
    /// As [`Body::voxelize_add`]; [`RevolveError::WrongLength`] for more than 254 layers (labels are bytes).
    pub fn regions<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        tolerance: f64,
    ) -> Result<RegionVolumes<T>, RevolveError> {
        let n = self.layers().len();
        at_most("layers (at most)", n, MOST_LABELS)?;
        check(grid, &slices, tolerance)?;
        let len = grid.slice_len() * slices.len();
        let mut labels = zeros::<u8>("voxels", len)?;
        let (mut coverage, mut counters) = (Vec::new(), VoxelCounters::default());
        for k in 0..n {
            let _layer = simd_set::part(k..k + 1, n);
            let activity: Vec<f64> = (0..n)
                .map(|region| f64::from(u8::from(region <= k)))
                .collect();
            let mut own: Vec<T> = zeros("voxels", len)?;
            let layer = (self, &activity[..]);
            let done = Self::voxelize_add(&[layer], grid, slices.clone(), tolerance, &mut own)?;
            counters = counters + done;
            coverage.push(own);
        }
        // Differences of layers, and the largest region.
        let slab = grid.slice_len() * BLOCK;
        let slabs = slabs(&mut coverage, slab).into_par_iter();
        slabs
            .zip(labels.par_chunks_mut(slab))
            .for_each(|(mut layers, labels)| {
                simd_set::checkpoint();
                for (i, label) in labels.iter_mut().enumerate() {
                    *label = separate(&mut layers, i);
                }
            });
        Ok(RegionVolumes {
            coverage,
            labels,
            counters,
        })
    }
}

impl<T: Sample> RegionVolumes<T> {
    /// Labels pieces of a region, each of disjoint parts: with n regions, a voxel of the region takes the label n + 1 + k of piece
    /// k if that piece covers most of it.
    ///
    /// Other voxels of the region keep its label. A piece has priority over an equal remainder, and the first piece over the
    /// second. Voxels of other regions do not change.
    ///
    /// The grid, slices and tolerance are those of [`Body::regions`]; coverages do not change.
    ///
    /// # Errors
    /// As [`Sector::voxelize_add`]; [`RevolveError::WrongLength`] for an invalid region, or more than 254 regions and pieces.
    pub fn label_pieces(
        &mut self,
        region: usize,
        pieces: &[Vec<&Sector>],
        grid: &VoxelGrid,
        slices: Range<usize>,
        tolerance: f64,
    ) -> Result<(), RevolveError> {
        let n = self.coverage.len();
        length("regions (at least)", region.saturating_add(1).max(n), n)?;
        at_most(
            "regions and pieces (at most)",
            n + pieces.len(),
            MOST_LABELS,
        )?;
        let len = self.labels.len();
        // Coverage of each voxel by all pieces, and the piece with the largest coverage.
        let mut all: Vec<T> = zeros("voxels", len)?;
        let mut most: Vec<(T, u8)> = zeros("voxels", len)?;
        for (k, piece) in pieces.iter().enumerate() {
            let _piece = simd_set::part(k + 1..k + 2, pieces.len() + 1);
            let mut own: Vec<T> = zeros("voxels", len)?;
            for part in piece {
                let done = part.voxelize_add(grid, slices.clone(), tolerance, 1.0, &mut own)?;
                self.counters = self.counters + done;
            }
            let best = all.par_iter_mut().zip(&mut most).zip(&own);
            best.for_each(|((all, most), own)| {
                *all += *own;
                if own.to_f64() > most.0.to_f64() {
                    *most = (*own, (n + 1 + k) as u8);
                }
            });
        }
        let voxels = self.labels.par_iter_mut().zip(&self.coverage[region]);
        voxels.zip(all.par_iter().zip(&most)).for_each(
            |((label, whole), (all, (share, piece)))| {
                let left = whole.to_f64() - all.to_f64();
                if usize::from(*label) == region + 1 && *piece > 0 && share.to_f64() >= left {
                    *label = *piece;
                }
            },
        );
        Ok(())
    }
}

/// Converts the coverage of a voxel by layers to that by regions; returns the label.
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
