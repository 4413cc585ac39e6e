//! Work counters of batch calls.

use std::ops::Add;

/// Work done by a batch of rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RayCounters {
    /// Rays inside the bounding interval of the silhouette, for which the surface was searched.
    pub cast: u64,
    /// Rays outside it, which were skipped.
    pub skipped: u64,
    /// Chords of positive length. [`Body::project`](crate::Body::project) counts one for each layer of non-zero weight and each slab, so up to
    /// that many for a ray; an [`Assembly`](crate::Assembly) and a [`View`](crate::View) count rays that meet any content.
    pub hit: u64,
}

/// Work done by a voxelisation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct VoxelCounters {
    /// Voxels whose coverage had to be computed because a surface may cut them.
    pub cut: u64,
    /// Voxels filled in blocks without individual computation.
    pub filled: u64,
    /// Voxels copied from their mirror images.
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
