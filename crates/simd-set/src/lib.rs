//! Loops compiled for several instruction sets, selected at run time.
#![doc = include_str!("../README.md")]
#![allow(unsafe_code)]

mod stop;

pub use stop::{Part, Stopped, Watch, checkpoint, part, parts, unit, watch_with};

/// An instruction set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// The instruction set of the compilation target (SSE2 on x86-64).
    Baseline,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, DQ and BW, AVX2 and FMA.
    Avx512,
    /// AArch64 with NEON.
    Neon,
}

/// Work that is compiled for each instruction set.
///
/// `run`, and what it calls in its loops, must be `#[inline(always)]`: a function that is not inlined is compiled for the baseline.
pub trait Work {
    /// The result.
    type Out;
    /// Does the work.
    fn run(self) -> Self::Out;
}

impl Set {
    /// Returns the widest instruction set that this CPU supports.
    #[must_use]
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2, Self::Neon]
            .into_iter()
            .find(|set| set.is_available())
            .unwrap_or(Self::Baseline)
    }

    /// Returns whether this CPU supports the instruction set. Cost: a few loads; the detection is cached.
    #[inline]
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
            Self::Neon => cfg!(all(target_arch = "aarch64", target_feature = "neon")),
        }
    }

    /// Runs `work` compiled for this instruction set, or for the baseline if the CPU does not support it. Calls [`checkpoint`] first.
    #[inline]
    pub fn run<W: Work>(self, work: W) -> W::Out {
        checkpoint();
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the CPU supports the features with which the function is compiled.
            Self::Avx512 if self.is_available() => unsafe { avx512(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            Self::Avx2 if self.is_available() => unsafe { avx2(work) },
            Self::Baseline | Self::Avx2 | Self::Avx512 | Self::Neon => work.run(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
fn avx512<W: Work>(work: W) -> W::Out {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Out {
    work.run()
}
