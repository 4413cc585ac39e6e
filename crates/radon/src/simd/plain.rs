//! Plain loops, compiled once for each instruction set: for those that the compiler makes vectors of by itself.

use super::InstructionSet;

/// Work without intrinsics. Nothing in it fuses a multiplication with an addition, so that all sets give the same bits.
pub(crate) trait Plain {
    /// Does it; must be `#[inline(always)]`, as all that it calls in its loops, to be compiled for the set.
    fn run(self);
}

impl InstructionSet {
    /// Does the work by this set, which the machine must have.
    pub(crate) fn run(self, work: impl Plain) {
        debug_assert!(self.is_available());
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a plan holds a set only after `is_available`.
            Self::Avx512 => unsafe { avx512(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            Self::Avx2 => unsafe { avx2(work) },
            // What the target guarantees has NEON on AArch64.
            _ => work.run(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
fn avx512(work: impl Plain) {
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(work: impl Plain) {
    work.run();
}
