//! Loops compiled for several instruction sets, selected at run time.
#![doc = include_str!("../README.md")]
#![allow(unsafe_code)]

mod stop;

pub use stop::{Stopped, checkpoint, stop_when};

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

#[cfg(test)]
mod tests {
    use super::{Set, Work};

    struct Dot<'a>(&'a [f64], &'a [f64]);

    impl Work for Dot<'_> {
        type Out = f64;
        #[inline(always)]
        fn run(self) -> f64 {
            let mut sums = [0.0; 8];
            for (i, (a, b)) in self.0.iter().zip(self.1).enumerate() {
                sums[i % 8] += a * b;
            }
            sums.iter().sum()
        }
    }

    #[test]
    fn every_set_is_bitwise_identical_and_a_missing_one_is_the_baseline() {
        let at = |k: f64| (0..1001).map(|i| (k * f64::from(i)).sin()).collect();
        let (a, b): (Vec<f64>, Vec<f64>) = (at(0.7), at(1.3));
        let expected = Set::Baseline.run(Dot(&a, &b));
        for set in [Set::Avx2, Set::Avx512, Set::Neon, Set::detect()] {
            assert_eq!(
                set.run(Dot(&a, &b)).to_bits(),
                expected.to_bits(),
                "{set:?}"
            );
        }
        assert!(Set::Baseline.is_available() && Set::detect().is_available());
    }
}
