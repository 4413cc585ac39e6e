//! Which slices are worked on together.

use std::ops::Range;

use super::ProjectorReport;
use crate::Sample;
use crate::simd::{InstructionSet, first_block, lanes_for};

/// Slices whose pixels lie side by side in memory, one to a lane of the kernels.
#[derive(Debug)]
pub(super) struct Block<'a> {
    pub(super) slices: &'a [usize],
    pub(super) lanes: usize,
    /// Lanes of the blocks before it in its group.
    pub(super) before: usize,
}

impl Block<'_> {
    /// Zeros for the lanes without a slice, and with them for all.
    pub(super) fn clear_unused<T: Sample>(&self, memory: &mut [T]) {
        if self.slices.len() < self.lanes {
            memory.fill(T::ZERO);
        }
    }

    /// The given samples of the rows of the block's slices, out of a row of every slice.
    pub(super) fn pick<'a, T>(
        &self,
        row: &'a mut [&mut [T]],
        samples: Range<usize>,
    ) -> Vec<&'a mut [T]> {
        let first = self.slices.first().copied().unwrap_or(0);
        let mut wanted = self.slices.iter().map(|slice| slice - first).peekable();
        let rows = row[first..].iter_mut().enumerate();
        rows.filter(|&(slice, _)| wanted.next_if_eq(&slice).is_some())
            .map(|(_, row)| &mut row[samples.clone()])
            .take(self.slices.len())
            .collect()
    }
}

/// Blocks that share the pairs of each ray.
#[derive(Debug)]
pub(super) struct Group<'a> {
    pub(super) blocks: Vec<Block<'a>>,
    /// Lanes of all blocks.
    pub(super) lanes: usize,
}

impl<'s> Group<'s> {
    /// Memory divided among the blocks by their lanes.
    pub(super) fn parts<'m, T>(&self, mut memory: &'m mut [T]) -> Vec<(&Block<'s>, &'m mut [T])> {
        let per_lane = memory.len() / self.lanes;
        let mut parts = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let (part, rest) = memory.split_at_mut(per_lane * block.lanes);
            parts.push((block, part));
            memory = rest;
        }
        parts
    }
}

/// Blocks of a group: enough to make the pairs cheap, few enough for a tile of all of them to stay in the second cache.
const BLOCKS: usize = 4;
/// Most memory for a group's projections, as long as a group has more lanes than a register.
const GROUP_BYTES: usize = 48 << 20;

/// The slices of a run that hold signal.
#[derive(Debug)]
pub(super) struct Slices {
    active: Vec<usize>,
    n_slices: usize,
}

impl Slices {
    pub(super) fn new(with_signal: Vec<bool>) -> Self {
        Self {
            active: (0..with_signal.len())
                .filter(|&slice| with_signal[slice])
                .collect(),
            n_slices: with_signal.len(),
        }
    }

    /// Zeros for the slices without signal.
    pub(super) fn clear_empty<T: Sample>(&self, rows: &mut [Vec<&mut [T]>]) {
        for row in rows {
            for (slice, samples) in row.iter_mut().enumerate() {
                if self.active.binary_search(&slice).is_err() {
                    samples.fill(T::ZERO);
                }
            }
        }
    }

    /// The slices with signal that are better projected in blocks, and those of `f32` that are better projected one by one.
    pub(super) fn blocks_and_alone<T>(&self, set: InstructionSet) -> (&[usize], &[usize]) {
        // As many as are projected one by one in the time of the first block, most of which goes into the pairs of its rays.
        let few = match set {
            InstructionSet::Avx512 => 24,
            InstructionSet::Avx2 => 8,
            _ => 4,
        };
        if self.active.len() <= few {
            return (&[], &self.active);
        }
        let mut n = 0;
        while first_block::<T>(set, self.active.len() - n) > 1 {
            n += first_block::<T>(set, self.active.len() - n);
            n = n.min(self.active.len());
        }
        self.active.split_at(n)
    }

    /// The slices with signal, if they are so few that the adjoint of all, one by one, costs less than that of a block.
    pub(super) fn few_for_adjoint<T>(&self, set: InstructionSet) -> Option<&[usize]> {
        let few = match (set, size_of::<T>()) {
            (InstructionSet::Avx512, 4) => 14,
            (InstructionSet::Avx2, 4) => 4,
            _ => 0,
        };
        (self.active.len() <= few).then_some(&self.active)
    }

    /// The slices with signal.
    pub(super) fn active(&self) -> &[usize] {
        &self.active
    }

    pub(super) fn report(&self) -> ProjectorReport {
        ProjectorReport {
            slices_projected: self.active.len(),
            slices_skipped: self.n_slices - self.active.len(),
        }
    }
}

/// Slices in groups of blocks; a slice of projections has `sinogram_len` samples.
pub(super) fn groups<T: Sample>(
    slices: &[usize],
    set: InstructionSet,
    sinogram_len: usize,
    forward: bool,
) -> Vec<Group<'_>> {
    let most = GROUP_BYTES / (sinogram_len * size_of::<T>());
    let register = lanes_for::<T>(set, 2);
    let mut lanes = lanes_for::<T>(set, 4 * register);
    // Two sums a lane of eight registers leave half of those of AVX-512 to the rest; others have no more than that.
    if forward && set == InstructionSet::Avx512 {
        lanes *= 2;
    }
    while lanes > register && lanes > most {
        lanes /= 2;
    }
    let n_blocks = (most / lanes).clamp(1, BLOCKS);
    let group = |slices| {
        let mut group = Group {
            blocks: Vec::new(),
            lanes: 0,
        };
        let mut rest: &[usize] = slices;
        while !rest.is_empty() {
            let narrow = lanes_for::<T>(set, rest.len().min(lanes));
            // No more than a quarter of a block is left empty.
            let lanes = if 4 * rest.len() > 3 * lanes {
                lanes
            } else {
                narrow
            };
            let (slices, others) = rest.split_at(rest.len().min(lanes));
            rest = others;
            let before = group.lanes;
            group.blocks.push(Block {
                slices,
                lanes,
                before,
            });
            group.lanes += lanes;
        }
        group
    };
    slices.chunks(lanes * n_blocks).map(group).collect()
}
