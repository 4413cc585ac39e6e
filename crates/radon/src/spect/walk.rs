//! The walk through the cells of a view, shared by both directions.

use super::attenuation::Escape;
use super::lanes::Lanes;
use super::turned::View;
use crate::Sample;
use crate::simd::prefetch;

/// A walk through the cells of a view for the rows of a block, nearest cells first.
pub(super) struct Walk<'a, T, V> {
    pub(super) view: &'a View<T>,
    /// The attenuation map of the block.
    pub(super) attenuation: Option<(&'a [Lanes<T>], &'a Escape<T>)>,
    /// Work array: transmission from the current plane to the camera, for each bin.
    pub(super) passed: &'a mut [Lanes<T>],
    pub(super) visit: V,
}

/// Number of entries by which pixels are prefetched.
const AHEAD: usize = 24;

/// The operation of a walk.
pub(super) trait Visit<T> {
    /// Processes a cell with its pixels and the fraction of its emission that reaches the camera.
    fn cell(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>);

    /// Announces that a pixel is needed soon.
    fn prefetch(&self, pixel: usize);
}

/// Position of a cell among the nodes: index of the bin's node in front, of the node behind, and the fraction of the latter.
#[derive(Clone, Copy)]
pub(super) struct Place<T> {
    near: usize,
    far: usize,
    behind: T,
}

impl<T: Sample, V: Visit<T>> simd_set::Work for Walk<'_, T, V> {
    type Out = ();

    #[inline(always)]
    fn run(mut self) {
        self.passed.fill(Lanes::splat(T::ONE));
        let n_bins = self.passed.len();
        let (mut start, n_entries) = (0, self.view.entries.len());
        for cell in &self.view.cells {
            let (bin, end) = (cell.bin as usize, cell.end as usize);
            let pixels = &self.view.entries[start..end];
            let ahead = (start + AHEAD).min(n_entries)..(end + AHEAD).min(n_entries);
            for &(pixel, _) in &self.view.entries[ahead] {
                if let Some((map, _)) = self.attenuation {
                    prefetch(&map[pixel as usize].0);
                }
                self.visit.prefetch(pixel as usize);
            }
            start = end;
            let seen = match self.attenuation {
                Some((map, escape)) => escape.step(&sum(map, pixels), &mut self.passed[bin]),
                None => Lanes::splat(T::ONE),
            };
            let (node, behind) = self.view.depths.planes[cell.plane as usize];
            let near = node * n_bins + bin;
            // The last node is the farthest.
            let far = if behind > T::ZERO {
                near + n_bins
            } else {
                near
            };
            self.visit.cell(Place { near, far, behind }, pixels, &seen);
        }
    }
}

/// Returns the weighted sum of some pixels.
#[inline(always)]
fn sum<T: Sample>(pixels: &[Lanes<T>], entries: &[(u32, T)]) -> Lanes<T> {
    let mut sum = Lanes::default();
    for &(pixel, length) in entries {
        sum.add(length, &pixels[pixel as usize]);
    }
    sum
}

/// Adds voxels to nodes `[node][bin]`.
pub(super) struct Gather<'a, T> {
    pub(super) pixels: &'a [Lanes<T>],
    pub(super) nodes: &'a mut [Lanes<T>],
}

impl<T: Sample> Visit<T> for Gather<'_, T> {
    #[inline(always)]
    fn cell(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>) {
        let Place { near, far, behind } = place;
        let emitted = sum(self.pixels, pixels).times(seen);
        self.nodes[near].add(T::ONE - behind, &emitted);
        self.nodes[far].add(behind, &emitted);
    }

    #[inline(always)]
    fn prefetch(&self, pixel: usize) {
        prefetch(&self.pixels[pixel].0);
    }
}

/// Adds nodes `[node][bin]` to voxels.
pub(super) struct Scatter<'a, T> {
    pub(super) pixels: &'a mut [Lanes<T>],
    pub(super) nodes: &'a [Lanes<T>],
}

impl<T: Sample> Visit<T> for Scatter<'_, T> {
    #[inline(always)]
    fn cell(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>) {
        let Place { near, far, behind } = place;
        let mut arriving = Lanes::default();
        arriving.add(T::ONE - behind, &self.nodes[near]);
        arriving.add(behind, &self.nodes[far]);
        let arriving = arriving.times(seen);
        for &(pixel, length) in pixels {
            self.pixels[pixel as usize].add(length, &arriving);
        }
    }

    #[inline(always)]
    fn prefetch(&self, pixel: usize) {
        prefetch(&self.pixels[pixel].0);
    }
}
