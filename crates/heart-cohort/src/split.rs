//! Train, validation and test: which members are for what.

use crate::cohort::Cohort;
use rand_chacha::rand_core::Rng;
use serde::{Deserialize, Serialize};

/// The stream of the split; members have the streams of their indices.
const STREAM: u64 = u64::MAX - 1;
/// Words of the stream that a member takes.
const WORDS: u128 = 2;

/// Fractions of the members.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Split {
    pub(crate) train: f64,
    #[serde(default)]
    pub(crate) validation: f64,
    #[serde(default)]
    pub(crate) test: f64,
}

/// A part of a cohort, for training a network, for its selection, or for the last test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subset {
    /// For training.
    Train,
    /// For selecting a model.
    Validation,
    /// For the last test.
    Test,
}

impl Subset {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

impl Split {
    /// Whether the fractions are none below 0 and together 1, to rounding.
    pub(crate) fn is_whole(&self) -> bool {
        let all = [self.train, self.validation, self.test];
        all.iter().all(|part| *part >= 0.0) && (all.iter().sum::<f64>() - 1.0).abs() < 1e-9
    }
}

impl Cohort {
    /// The subset of a member, drawn from its place in a stream of its own: it depends on the seed, the fractions and the index, not on
    /// what else was drawn nor on shards.
    pub(crate) fn subset(&self, index: u64) -> Option<Subset> {
        let split = self.split?;
        let mut stream = self.stream(STREAM);
        stream.set_word_pos(WORDS * u128::from(index));
        let u = (stream.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        Some(if u < split.train {
            Subset::Train
        } else if u < split.train + split.validation || split.test == 0.0 {
            Subset::Validation
        } else {
            Subset::Test
        })
    }
}
