//! Forward and adjoint: one walk through the cells of a view, with the same numbers both ways.
//!
//! ```text
//! forward   voxels -> cells, attenuated -> divided between the nodes of their depth -> blurred, node by node, into the image
//! adjoint   image -> blurred, node by node -> cells: the average of two nodes, attenuated -> voxels
//! ```
//!
//! Rows are independent: blocks of rows are processed side by side. The forward run distributes views to threads, and blocks within a view.
//! The adjoint blurs some views one by one, then adds all of them to the voxels of each block. One job computes each number, in an order
//! that does not depend on the threads.

use rayon::prelude::*;

use super::depth::{AddBlurred, Node, Work};
use super::lanes::{LANES, Lanes};
use super::plan::Plan;
use super::turned::View;
use super::walk::{Gather, Scatter, Visit, Walk};
use crate::Sample;
use crate::error::{RadonError, zeros};

/// Work arrays, which grow as needed and are kept.
#[derive(Debug, Default)]
pub(crate) struct Scratch<T> {
    blocks: Vec<Lanes<T>>,
    /// Transmission to the camera, `[block][bin]`, of the view that is added to the voxels.
    passed: Vec<Lanes<T>>,
    slots: Vec<Slot<T>>,
}

/// Work arrays of one view.
#[derive(Debug, Default)]
struct Slot<T> {
    /// The camera's image followed by the nodes, `[block][image][bin]` with margins.
    images: Vec<Lanes<T>>,
    /// Transmission to the camera, `[block][bin]`.
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
        self.reserve(views, scratch)?;
        let Scratch { blocks, slots, .. } = scratch;
        self.axial.read(volume, blocks);
        let (n, view_len) = (slots.len(), self.geometry.view_len());
        for (views, out) in views.chunks(n).zip(out.chunks_mut(n * view_len)) {
            let jobs = views.par_iter().zip(slots.par_iter_mut());
            let jobs = jobs.zip(out.par_chunks_mut(view_len)).with_max_len(1);
            jobs.for_each(|((&view, slot), out)| {
                let view = &self.views[view];
                self.gather(view, blocks, slot);
                for (j, node) in view.depths.nodes.iter().enumerate().rev() {
                    self.add_blurred(view, node, slot, [j + 1, node.parent]);
                }
                self.crop(&slot.images, view, out);
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
        self.reserve(views, scratch)?;
        let Scratch {
            blocks,
            passed,
            slots,
        } = scratch;
        blocks.fill(Lanes::default());
        let (n, view_len) = (slots.len(), self.geometry.view_len());
        let (block_len, n_bins) = (self.axial.block_len, self.frame.n_bins);
        for (views, data) in views.chunks(n).zip(data.chunks(n * view_len)) {
            let jobs = views.par_iter().zip(slots.par_iter_mut());
            let jobs = jobs.zip(data.par_chunks(view_len)).with_max_len(1);
            jobs.for_each(|((&view, slot), data)| {
                let view = &self.views[view];
                slot.images[..self.images_len(view)].fill(Lanes::default());
                self.uncrop(data, view, &mut slot.images);
                for (j, node) in view.depths.nodes.iter().enumerate() {
                    self.add_blurred(view, node, slot, [node.parent, j + 1]);
                }
            });
            let jobs = blocks.par_chunks_mut(block_len);
            let jobs = jobs.zip(passed.par_chunks_mut(n_bins)).enumerate();
            jobs.for_each(|(block, (pixels, passed))| {
                for (&view, slot) in views.iter().zip(slots.iter()) {
                    let view = &self.views[view];
                    let stride = view.n_images() * n_bins;
                    let at = (self.axial.blocks.start + block) * stride;
                    let nodes = &slot.images[at + n_bins..at + stride];
                    self.walk(view, block, passed, Scatter { pixels, nodes });
                }
            });
        }
        self.axial.write(blocks, volume);
        Ok(())
    }

    fn reserve(&self, views: &[usize], scratch: &mut Scratch<T>) -> Result<(), RadonError> {
        let (n_blocks, n_bins) = (self.axial.blocks.len(), self.frame.n_bins);
        if scratch.blocks.is_empty() {
            scratch.blocks = zeros("blocks of voxels", self.axial.block_len, n_blocks)?;
            scratch.passed = zeros("what gets through", n_blocks, n_bins)?;
        }
        // Two views per thread, so that neither waits for the other.
        let n_slots = (2 * rayon::current_num_threads()).min(views.len()).max(1);
        let lengths = views.iter().map(|&v| self.images_len(&self.views[v]));
        let images = lengths.max().unwrap_or(0);
        scratch.slots.resize_with(n_slots, Slot::default);
        for slot in &mut scratch.slots {
            if slot.images.len() < images {
                slot.images = zeros("images of a view", images, 1)?;
                slot.passed = zeros("what gets through", n_blocks, n_bins)?;
            }
        }
        Ok(())
    }

    /// Returns the length of the images of a view.
    fn images_len(&self, view: &View<T>) -> usize {
        view.n_images() * self.frame.n_blocks * self.frame.n_bins
    }

    /// Visits all cells of a view in the rows of a block.
    fn walk<V: Visit<T>>(&self, view: &View<T>, block: usize, passed: &mut [Lanes<T>], visit: V) {
        let map = self.attenuation.as_ref();
        let n = self.axial.block_len;
        self.instructions.run(Walk {
            view,
            attenuation: map.map(|a| (&a.map[block * n..][..n], &a.escape)),
            passed,
            visit,
        });
    }

    /// Projects voxels to nodes.
    fn gather(&self, view: &View<T>, blocks: &[Lanes<T>], slot: &mut Slot<T>) {
        let n_bins = self.frame.n_bins;
        let (stride, seen) = (view.n_images() * n_bins, &self.axial.blocks);
        let images = &mut slot.images[..self.images_len(view)];
        images[..seen.start * stride].fill(Lanes::default());
        images[seen.end * stride..].fill(Lanes::default());
        let images = images[seen.start * stride..seen.end * stride].par_chunks_mut(stride);
        let jobs = images.zip(slot.passed.par_chunks_mut(n_bins));
        let jobs = jobs
            .zip(blocks.par_chunks(self.axial.block_len))
            .enumerate();
        jobs.for_each(|(block, ((images, passed), pixels))| {
            images.fill(Lanes::default());
            let nodes = &mut images[n_bins..];
            self.walk(view, block, passed, Gather { pixels, nodes });
        });
    }

    /// Adds a blurred image of a node to its target.
    fn add_blurred(
        &self,
        view: &View<T>,
        node: &Node<T>,
        slot: &mut Slot<T>,
        [from, to]: [usize; 2],
    ) {
        self.instructions.run(AddBlurred {
            frame: self.frame,
            kernels: &node.kernels,
            images: &mut slot.images,
            n_images: view.n_images(),
            from,
            to,
            work: &mut slot.work,
        });
    }

    /// Extracts the detector's rows and bins `[row][bin]` from the camera's image.
    fn crop(&self, images: &[Lanes<T>], view: &View<T>, out: &mut [T]) {
        let n_bins = self.geometry.views().n_bins();
        for (row, out) in out.chunks_exact_mut(n_bins).enumerate() {
            let (start, lane) = self.first_bin(view, row);
            for (x, lanes) in out.iter_mut().zip(&images[start..]) {
                *x = lanes.0[lane];
            }
        }
    }

    /// The adjoint of [`crop`](Self::crop), into zeros.
    fn uncrop(&self, data: &[T], view: &View<T>, images: &mut [Lanes<T>]) {
        let n_bins = self.geometry.views().n_bins();
        for (row, data) in data.chunks_exact(n_bins).enumerate() {
            let (start, lane) = self.first_bin(view, row);
            for (&x, lanes) in data.iter().zip(&mut images[start..]) {
                lanes.0[lane] = x;
            }
        }
    }

    /// Returns the first bin of a row of the detector in the camera's image.
    fn first_bin(&self, view: &View<T>, row: usize) -> (usize, usize) {
        let [bins, rows] = self.margin;
        let (block, lane) = ((rows + row) / LANES, (rows + row) % LANES);
        (block * view.n_images() * self.frame.n_bins + bins, lane)
    }
}
