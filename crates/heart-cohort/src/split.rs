//! The split into training, validation and test subsets.

use serde::{Deserialize, Serialize};

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

/// A subset of a cohort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subset {
    /// Training.
    Train,
    /// Validation (model selection).
    Validation,
    /// Test.
    Test,
}

impl Subset {
    /// Returns its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

impl Split {
    /// Returns the subset of a coordinate in [0, 1).
    pub(crate) fn subset(&self, u: f64) -> Subset {
        if u < self.train {
            Subset::Train
        } else if u < self.train + self.validation || self.test == 0.0 {
            Subset::Validation
        } else {
            Subset::Test
        }
    }

    /// Returns whether all fractions are non-negative and their sum is 1 to rounding.
    pub(crate) fn is_whole(&self) -> bool {
        let all = [self.train, self.validation, self.test];
        all.iter().all(|part| *part >= 0.0) && (all.iter().sum::<f64>() - 1.0).abs() < 1e-9
    }
}
