//! Division of slices into blocks.

use std::ops::Range;

use crate::Sample;
use crate::simd::{InstructionSet, first_block, lanes_for};

/// Slices whose pixels are adjacent in memory, one per lane of the kernels.
#[derive(Debug)]
pub(super) struct Block<'a> {
    pub(super) slices: &'a [usize],
    pub(super) lanes: usize,
    /// Lanes of the earlier blocks of its group.
    pub(super) before: usize,
}

impl Block<'_> {
    /// Clears the lanes without a slice.
    pub(super) fn clear_unused<T: Sample>(&self, memory: &mut [T]) {
        if self.slices.len() < self.lanes {
            memory.fill(T::ZERO);
        }
    }

    /// Selects the given samples of the rows of the block's slices from a row of every slice.
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

/// Blocks that use the same weights of each ray.
#[derive(Debug)]
pub(super) struct Group<'a> {
    pub(super) blocks: Vec<Block<'a>>,
    /// Lanes of all blocks.
    pub(super) lanes: usize,
}

impl<'s> Group<'s> {
    /// Divides memory among the blocks by their lanes.
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

/// Blocks of a group: enough to amortise the weights, few enough for a tile of all blocks to fit in the second-level cache.
const BLOCKS: usize = 4;
/// Largest memory of a group's projections, if a group has more lanes than a register.
const GROUP_BYTES: usize = 48 << 20;

/// The slices of a run that contain signal.
#[derive(Debug)]
pub(super) struct Slices {
    active: Vec<usize>,
}

impl Slices {
    pub(super) fn new(with_signal: Vec<bool>) -> Self {
        Self {
            active: (0..with_signal.len())
                .filter(|&slice| with_signal[slice])
                .collect(),
        }
    }

    /// Clears the slices without signal.
    pub(super) fn clear_empty<T: Sample>(&self, rows: &mut [Vec<&mut [T]>]) {
        for row in rows {
            for (slice, samples) in row.iter_mut().enumerate() {
                if self.active.binary_search(&slice).is_err() {
                    samples.fill(T::ZERO);
                }
            }
        }
    }

    /// Divides the slices with signal into those projected in blocks, and those of `f32` projected one by one.
    pub(super) fn blocks_and_alone<T>(&self, set: InstructionSet) -> (&[usize], &[usize]) {
        // As many as are projected one by one in the time of the first block, which mostly computes the weights.
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

    /// Returns the slices with signal if they are so few that one by one is faster for the adjoint.
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
}

/// Divides slices into groups of blocks; a slice of projections has `sinogram_len` samples.
pub(super) fn groups<T: Sample>(
    slices: &[usize],
    set: InstructionSet,
    sinogram_len: usize,
    forward: bool,
) -> Vec<Group<'_>> {
    let most = GROUP_BYTES / (sinogram_len * size_of::<T>());
    let register = lanes_for::<T>(set, 2);
    let mut lanes = lanes_for::<T>(set, 4 * register);
    // With AVX-512, two sums per lane of eight registers leave half of the registers; other sets have no more.
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
            // At most a quarter of a block remains empty.
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
