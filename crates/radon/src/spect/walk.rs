//! The walk through the cells of a view, shared by both directions.

use super::attenuation::Escape;
use super::turned::{Run, View};
use crate::Sample;
use crate::simd::Lanes;

/// A walk through the cells of a view for the rows of a block, nearest cells first; multiply-adds are fused if `FUSED`.
pub(super) struct Walk<'a, T, V, const FUSED: bool> {
    pub(super) view: &'a View<T>,
    /// The attenuation map of the block.
    pub(super) attenuation: Option<(&'a [Lanes<T>], &'a Escape<T>)>,
    /// Work array: transmission from the current plane to the camera, for each bin.
    pub(super) passed: &'a mut [Lanes<T>],
    pub(super) visit: V,
}

/// The operation of a walk.
pub(super) trait Visit<T> {
    /// Processes a cell with its pixels and the fraction of its emission that reaches the camera.
    fn cell<const FUSED: bool>(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>);
}

/// Position of a cell among the nodes: index of the bin's node in front, of the node behind, and the fraction of the latter.
#[derive(Clone, Copy)]
pub(super) struct Place<T> {
    near: usize,
    far: usize,
    behind: T,
}

impl<T: Sample, V: Visit<T>, const FUSED: bool> simd_set::Work for Walk<'_, T, V, FUSED> {
    type Out = ();

    #[inline(always)]
    fn run(mut self) {
        self.passed.fill(Lanes::splat(T::ONE));
        let (mut bins, mut entries) = (&*self.view.bins, &*self.view.entries);
        for run in &self.view.runs {
            let (n, n_cells) = (run.n_pixels as usize, run.n_cells as usize);
            let (own, others) = bins.split_at(n_cells);
            let (pixels, rest) = entries.split_at(n_cells * n);
            (bins, entries) = (others, rest);
            // Loops of known length are unrolled.
            match n {
                1 => self.cells(run, own, pixels, 1),
                2 => self.cells(run, own, pixels, 2),
                3 => self.cells(run, own, pixels, 3),
                4 => self.cells(run, own, pixels, 4),
                5 => self.cells(run, own, pixels, 5),
                6 => self.cells(run, own, pixels, 6),
                _ => self.cells(run, own, pixels, n),
            }
        }
    }
}

impl<T: Sample, V: Visit<T>, const FUSED: bool> Walk<'_, T, V, FUSED> {
    /// Visits the cells of a run, each of which has `n` pixels.
    #[inline(always)]
    fn cells(&mut self, run: &Run, bins: &[u32], pixels: &[(u32, T)], n: usize) {
        let n_bins = self.passed.len();
        let (node, behind) = self.view.planes[run.plane as usize];
        // The last node is the farthest.
        let next = if behind > T::ZERO { n_bins } else { 0 };
        let attenuation = self.attenuation.filter(|_| run.attenuates);
        for (&bin, pixels) in bins.iter().zip(pixels.chunks_exact(n)) {
            let passed = &mut self.passed[bin as usize];
            let seen = match attenuation {
                Some((map, escape)) => escape.step::<FUSED>(&sum::<_, FUSED>(map, pixels), passed),
                None => *passed,
            };
            let near = node * n_bins + bin as usize;
            self.visit.cell::<FUSED>(
                Place {
                    near,
                    far: near + next,
                    behind,
                },
                pixels,
                &seen,
            );
        }
    }
}

/// Returns the weighted sum of some pixels.
#[inline(always)]
fn sum<T: Sample, const FUSED: bool>(pixels: &[Lanes<T>], entries: &[(u32, T)]) -> Lanes<T> {
    let mut sum = Lanes::default();
    for &(pixel, length) in entries {
        sum.add::<FUSED>(length, &pixels[pixel as usize]);
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
    fn cell<const FUSED: bool>(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>) {
        let Place { near, far, behind } = place;
        let emitted = sum::<_, FUSED>(self.pixels, pixels).times(seen);
        self.nodes[near].add::<FUSED>(T::ONE - behind, &emitted);
        self.nodes[far].add::<FUSED>(behind, &emitted);
    }
}

/// Adds nodes `[node][bin]` to voxels.
pub(super) struct Scatter<'a, T> {
    pub(super) pixels: &'a mut [Lanes<T>],
    pub(super) nodes: &'a [Lanes<T>],
}

impl<T: Sample> Visit<T> for Scatter<'_, T> {
    #[inline(always)]
    fn cell<const FUSED: bool>(&mut self, place: Place<T>, pixels: &[(u32, T)], seen: &Lanes<T>) {
        let Place { near, far, behind } = place;
        let mut arriving = Lanes::default();
        arriving.add::<FUSED>(T::ONE - behind, &self.nodes[near]);
        arriving.add::<FUSED>(behind, &self.nodes[far]);
        let arriving = arriving.times(seen);
        for &(pixel, length) in pixels {
            self.pixels[pixel as usize].add::<FUSED>(length, &arriving);
        }
    }
}
