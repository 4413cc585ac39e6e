//! Forward and adjoint: one walk through the cells of a view, with the same numbers both ways.
//!
//! ```text
//! forward   voxels -> cells, attenuated -> divided between the nodes of their depth -> blurred and summed -> the detector
//! adjoint   detector -> blurred for each node -> cells: the average of two nodes, attenuated -> voxels
//! ```
//!
//! Rows are processed in blocks. Some views at a time: the steps that blur bins and, forward, those from voxels to nodes are jobs of one view
//! and block; those that blur rows are jobs of one view; the adjoint adds all of these views to the voxels of a block in one job. The voxels
//! of a block stay in the second-level cache for all of these views. One job computes each number, in an order that does not depend on the
//! threads.

use super::blur::{FromDetector, ToDetector, Work};
use super::plan::Plan;
use super::turned::View;
use super::walk::{Gather, Scatter, Visit, Walk};
use crate::error::{RadonError, zeros};
use crate::pool::{Pool, grown};
use crate::simd::Lanes;
use crate::{InstructionSet, Sample, parallel};

/// Views per thread that are computed at a time: many for each reading of a block's voxels.
const EACH: usize = 8;

/// Work arrays, which grow as needed and are kept.
#[derive(Debug, Default)]
pub(crate) struct Scratch<T> {
    blocks: Vec<Lanes<T>>,
    /// Sums over nodes, forward `[block][view][distance][bin]`, adjoint `[view][block][distance][bin]`.
    sums: Vec<Lanes<T>>,
    /// Nodes of the adjoint, `[view][block][node][bin]`.
    nodes: Vec<Lanes<T>>,
    /// A volume in rows of the detector.
    rows: Vec<T>,
    jobs: Pool<Job<T>>,
}

/// Work arrays of a job.
#[derive(Debug, Default)]
struct Job<T> {
    nodes: Vec<Lanes<T>>,
    /// Transmission to the camera for each bin.
    passed: Vec<Lanes<T>>,
    work: Work<T>,
}

impl<T: Sample> Plan<T> {
    /// Projects the views with these indices.
    pub(crate) fn forward(
        &self,
        views: &[usize],
        volume: &[T],
        out: &mut [T],
        scratch: &mut Scratch<T>,
    ) -> Result<(), RadonError> {
        if self.frame.axial.rows.n_blocks == 0 {
            out.fill(T::ZERO);
            return Ok(());
        }
        let n = self.reserve(views, scratch)?;
        let Scratch {
            blocks, sums, jobs, ..
        } = scratch;
        self.frame
            .axial
            .read(self.frame.instructions, volume, blocks);
        let (view_len, block_len) = (self.frame.geometry.view_len(), self.frame.axial.block_len);
        let (len, n_blocks) = (self.frame.blur.sums_len(), self.frame.axial.rows.n_blocks);
        let parts = views.chunks(n).zip(out.chunks_mut(n * view_len));
        for (_part, (views, out)) in simd_set::parts(parts) {
            let n_views = views.len();
            let sums = &mut sums[..n_views * n_blocks * len];
            parallel::tasks(sums, len, &|k, sums| {
                let (view, block) = (&self.views[views[k % n_views]], k / n_views);
                jobs.with(Job::default, |job| {
                    let nodes = grown(&mut job.nodes, view.used.len() * self.frame.blur.wide());
                    nodes.fill(Lanes::default());
                    let pixels = &blocks[block * block_len..][..block_len];
                    self.walk(view, block, &mut job.passed, Gather { pixels, nodes });
                    let work = &mut job.work;
                    self.frame.blur.sum_nodes(
                        self.frame.instructions,
                        &view.used,
                        nodes,
                        sums,
                        work,
                    );
                });
            });
            parallel::tasks(out, view_len, &|k, view| {
                jobs.with(Job::default, |Job { work, .. }| {
                    self.frame.instructions.run(ToDetector {
                        blur: &self.frame.blur,
                        rows: self.frame.axial.rows,
                        sums: &sums[k * len..],
                        stride: n_views * len,
                        view,
                        work,
                    });
                });
            });
        }
        Ok(())
    }

    /// The adjoint of [`forward`](Self::forward).
    pub(crate) fn adjoint(
        &self,
        views: &[usize],
        data: &[T],
        volume: &mut [T],
        scratch: &mut Scratch<T>,
    ) -> Result<(), RadonError> {
        if self.frame.axial.rows.n_blocks == 0 {
            volume.fill(T::ZERO);
            return Ok(());
        }
        let n = self.reserve(views, scratch)?;
        let Scratch {
            blocks,
            sums,
            nodes,
            rows,
            jobs,
        } = scratch;
        blocks.fill(Lanes::default());
        let (view_len, block_len) = (self.frame.geometry.view_len(), self.frame.axial.block_len);
        let (len, n_blocks) = (self.frame.blur.sums_len(), self.frame.axial.rows.n_blocks);
        let most = self.nodes_len(views);
        if nodes.len() < n * n_blocks * most {
            *nodes = zeros("nodes of the views", n * n_blocks, most)?;
        }
        let parts = views.chunks(n).zip(data.chunks(n * view_len));
        for (_part, (views, data)) in simd_set::parts(parts) {
            let sums = &mut sums[..views.len() * n_blocks * len];
            parallel::tasks(sums, n_blocks * len, &|k, sums| {
                let view = &data[k * view_len..][..view_len];
                jobs.with(Job::default, |Job { work, .. }| {
                    let (blur, rows) = (&self.frame.blur, self.frame.axial.rows);
                    self.frame.instructions.run(FromDetector {
                        blur,
                        rows,
                        view,
                        sums,
                        work,
                    });
                });
            });
            let all = &mut nodes[..views.len() * n_blocks * most];
            parallel::tasks(all, most, &|k, nodes| {
                let sums = &sums[k * len..][..len];
                let used = &self.views[views[k / n_blocks]].used;
                let nodes = &mut nodes[..used.len() * self.frame.blur.wide()];
                jobs.with(Job::default, |Job { work, .. }| {
                    self.frame
                        .blur
                        .fill_nodes(self.frame.instructions, used, sums, nodes, work);
                });
            });
            parallel::tasks(blocks, block_len, &|block, pixels| {
                jobs.with(Job::default, |job| {
                    for (k, &view) in views.iter().enumerate() {
                        let nodes = &nodes[(k * n_blocks + block) * most..];
                        let view = &self.views[view];
                        self.walk(view, block, &mut job.passed, Scatter { pixels, nodes });
                    }
                });
            });
        }
        self.frame
            .axial
            .write(self.frame.instructions, blocks, rows, volume);
        Ok(())
    }

    /// Prepares work arrays; returns the number of views that are processed at a time.
    fn reserve(&self, views: &[usize], scratch: &mut Scratch<T>) -> Result<usize, RadonError> {
        let (n_blocks, len) = (self.frame.axial.rows.n_blocks, self.frame.blur.sums_len());
        let n = (EACH * rayon::current_num_threads())
            .min(views.len())
            .max(1);
        if scratch.blocks.is_empty() {
            scratch.blocks = zeros("blocks of voxels", self.frame.axial.block_len, n_blocks)?;
        }
        if scratch.sums.len() < n * n_blocks * len {
            scratch.sums = zeros("sums of the views", n * n_blocks, len)?;
        }
        Ok(n)
    }

    /// Returns the largest length of the nodes of a block.
    fn nodes_len(&self, views: &[usize]) -> usize {
        let most = views.iter().map(|&view| self.views[view].used.len()).max();
        most.unwrap_or(0) * self.frame.blur.wide()
    }

    /// Visits all cells of a view in the rows of a block.
    fn walk<V: Visit<T>>(
        &self,
        view: &View<T>,
        block: usize,
        passed: &mut Vec<Lanes<T>>,
        visit: V,
    ) {
        match self.frame.instructions {
            InstructionSet::Avx512 | InstructionSet::Avx2 | InstructionSet::Neon => {
                self.walk_rounded::<V, true>(view, block, passed, visit);
            }
            InstructionSet::Baseline => {
                self.walk_rounded::<V, false>(view, block, passed, visit);
            }
        }
    }

    fn walk_rounded<V: Visit<T>, const FUSED: bool>(
        &self,
        view: &View<T>,
        block: usize,
        passed: &mut Vec<Lanes<T>>,
        visit: V,
    ) {
        let map = self.attenuation.as_ref();
        let n = self.frame.axial.block_len;
        self.frame.instructions.run(Walk::<_, _, FUSED> {
            view,
            attenuation: map.map(|a| (&a.map[block * n..][..n], &a.escape)),
            passed: grown(passed, self.frame.blur.wide()),
            visit,
        });
    }
}
