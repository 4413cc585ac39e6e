//! Work counters: what a batch call did and what it skipped.

use std::ops::Add;

/// Work done by a batch of rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RayCounters {
    /// Rays inside the silhouette's bounding interval, for which the surface was searched.
    pub cast: u64,
    /// Rays outside it, never looked at.
    pub skipped: u64,
    /// Rays with a chord of positive length.
    pub hit: u64,
}

/// Work done by a voxelisation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct VoxelCounters {
    /// Voxels whose coverage had to be computed because a surface may cut them.
    pub cut: u64,
    /// Voxels filled with one value without looking at each of them.
    pub filled: u64,
    /// Voxels that have the values of their mirror images, which alone were looked at.
    pub mirrored: u64,
    /// Evaluations of the surface (signed distances or point tests).
    pub evaluations: u64,
}

impl Add for RayCounters {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            cast: self.cast + o.cast,
            skipped: self.skipped + o.skipped,
            hit: self.hit + o.hit,
        }
    }
}

impl Add for VoxelCounters {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            cut: self.cut + o.cut,
            filled: self.filled + o.filled,
            mirrored: self.mirrored + o.mirrored,
            evaluations: self.evaluations + o.evaluations,
        }
    }
}
