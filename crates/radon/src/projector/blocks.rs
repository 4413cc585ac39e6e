//! Which slices are worked on together.

use super::ProjectorReport;
use crate::Sample;
use crate::simd::InstructionSet;

/// Slices whose pixels lie side by side in memory, one to a lane of the kernels.
#[derive(Debug)]
pub(super) struct Block<'a> {
    pub(super) slices: &'a [usize],
    pub(super) lanes: usize,
    /// Lanes of the blocks before it in its group.
    pub(super) before: usize,
}

/// Blocks that share the taps of each ray.
#[derive(Debug)]
pub(super) struct Group<'a> {
    pub(super) blocks: Vec<Block<'a>>,
    /// Lanes of all blocks.
    pub(super) lanes: usize,
}

/// Blocks of a group: enough to make the taps cheap, few enough for a tile of all of them to stay in the second cache.
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

    /// The slices with signal in groups of blocks; a slice of projections has `sinogram_len` samples.
    pub(super) fn groups<T: Sample>(
        &self,
        set: InstructionSet,
        sinogram_len: usize,
    ) -> Vec<Group<'_>> {
        let most = GROUP_BYTES / (sinogram_len * size_of::<T>());
        let register = set.lanes_for::<T>(2);
        // `lanes_for` knows blocks of 1, 2 and 4 registers.
        let mut lanes = set.lanes_for::<T>(usize::MAX);
        while lanes > register && lanes > most {
            lanes /= 2;
        }
        let n_blocks = (most / lanes).clamp(1, BLOCKS);
        let group = |slices| {
            let mut group = Group {
                blocks: Vec::new(),
                lanes: 0,
            };
            for slices in <[usize]>::chunks(slices, lanes) {
                let lanes = set.lanes_for::<T>(slices.len());
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
        self.active.chunks(lanes * n_blocks).map(group).collect()
    }

    pub(super) fn report(&self) -> ProjectorReport {
        ProjectorReport {
            slices_projected: self.active.len(),
            slices_skipped: self.n_slices - self.active.len(),
        }
    }
}
