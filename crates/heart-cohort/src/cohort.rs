//! A validated cohort.

use crate::correlation::{Copula, Correlation};
use crate::distribution::Distribution;
use crate::expression::Constraint;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of members: Sobol points have 32 bits, and rejected draws need some of them.
pub(crate) const MOST_MEMBERS: u64 = 1 << 26;

/// A set of studies: a scene and distributions of its fields. Member `i` is a function of the text and `i`.
///
/// Keys of the text, which [`Cohort::TEMPLATE`] shows in use:
///
/// | key | default | meaning |
/// | --- | --- | --- |
/// | `members` | | number of members, 1 to 2^26 |
/// | `seed` | 1 | seed of the random numbers |
/// | `sampling` | `"plain"` | `"plain"`: independent members, each from its own stream of ChaCha8; `"sobol"`: Sobol points (direction numbers of Joe and Kuo, 2008), shifted by the seed: for each k the first 2^k members cover the space of the fields evenly; a draw that violates a constraint is replaced by a plain draw |
/// | `attempts` | 1000 | largest number of draws per member to meet the constraints, 1 to 10^6; with `"sobol"` at most 2^32 / `members` (rounded up to a power of two): 64 for 2^26 members |
/// | `compression` | `"none"` | of each array: `"none"` (`KEY.truth.npy`) or `"gzip"` (`KEY.truth.npy.gz`, fastest level without a time stamp, bitwise reproducible for one version of the program) |
/// | `precision` | `"float32"` | of the samples: `"float32"` or `"float16"` (relative error at most 2^-11 above 6.1e-5, absolute error at most 2^-25 below; a member with a sample beyond 65 504 is rejected; projections that are counts have four bytes per sample) |
/// | `split` | none | fractions of the members: `{ train = 0.8, validation = 0.1, test = 0.1 }` |
/// | `base` | [`Scene::default`](heart_phantom::Scene) | file of the base scene, relative to that of the cohort |
/// | `constraints` | none | comparisons that each draw must meet (a quotient by zero meets none): `["heart.outer.radius > heart.inner.radius + 0.8"]` |
/// | `correlations` | none | coefficients of the normal scores of two fields: `[{ fields = ["pose.shift.1", "pose.shift.2"], coefficient = 0.4 }]` |
/// | `[scene]` | empty | fields of all members that differ from the base scene; with `output.write = []` members have no arrays |
/// | `[vary]` | empty | distributions of fields by their paths; without them members of a case differ only in the seed of the noise |
/// | `[[cases]]` | one case | classes: `name`, `weight` (default 1, relative to the sum), `scene` and `vary` (replace those of all members) |
///
/// | distribution | value |
/// | --- | --- |
/// | `{ uniform = [low, high] }` | uniform; all integers of an integer field, both ends included, have the same probability |
/// | `{ normal = { mean, sd, bounds } }` | normal with this mean and standard deviation, truncated to the optional `bounds = [low, high]` |
/// | `{ log-normal = { median, factor, bounds } }` | log-normal, truncated; `factor` is `exp` of the standard deviation of the logarithm, above 1: two thirds of the values are between `median / factor` and `median * factor` |
/// | `{ choice = [...] }` | one of several values with equal probability: numbers, names, or tables of a scene |
///
/// A value is the quantile of a coordinate of the unit cube, so evenly distributed points give evenly distributed fields. Integer
/// fields are rounded.
///
/// ```
/// use heart_cohort::Cohort;
/// let cohort = Cohort::from_toml(r#"
/// members = 100
/// seed = 7
/// constraints = ["heart.outer.radius > heart.inner.radius + 0.8"]
/// [vary]
/// heart.inner.radius = { uniform = [1.5, 2.0] }
/// heart.outer.radius = { normal = { mean = 2.75, sd = 0.3, bounds = [2.2, 3.3] } }
/// "#)?;
/// let member = cohort.member(17)?;
/// let [inner, outer] = ["inner", "outer"].map(|which| member.number(&format!("heart.{which}.radius")));
/// assert!(outer.unwrap() > inner.unwrap() + 0.8);
/// assert_eq!(cohort.member(17)?, member);
/// # Ok::<(), heart_cohort::CohortError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Cohort {
    pub(crate) members: u64,
    pub(crate) seed: u64,
    pub(crate) sampling: Sampling,
    pub(crate) attempts: u32,
    pub(crate) compression: Compression,
    pub(crate) precision: Precision,
    pub(crate) split: Option<Split>,
    /// At least one.
    pub(crate) cases: Vec<Case>,
    pub(crate) correlations: Vec<Correlation>,
    pub(crate) copula: Copula,
    pub(crate) constraints: Vec<Constraint>,
    /// All varied fields of all cases: dimensions of the unit cube.
    pub(crate) varied: BTreeSet<String>,
    /// The integer fields.
    pub(crate) whole: BTreeSet<String>,
    pub(crate) digest: String,
}

/// The sampling of the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Sampling {
    #[default]
    Plain,
    Sobol,
}

/// Compression of each array in a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Compression {
    #[default]
    None,
    Gzip,
}

/// Precision of the samples in a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Precision {
    #[default]
    Float32,
    Float16,
}

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
    pub(crate) fn name(self) -> &'static str {
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

/// One of `[[cases]]`: a part of the members with its own scene. A cohort without cases has one.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) weight: f64,
    /// The complete scene, including defaults.
    pub(crate) scene: Value,
    pub(crate) vary: BTreeMap<String, Distribution>,
}

impl Cohort {
    /// A cohort text with a comment on every line:
    ///
    /// ```toml
    #[doc = include_str!("template.toml")]
    /// ```
    pub const TEMPLATE: &str = include_str!("template.toml");

    /// A cohort text of clinical studies: chest, collimator, 16 gates, averages over bins, noise, hearts with and without a defect.
    pub const CLINICAL: &str = include_str!("clinical.toml");

    /// Number of members.
    #[must_use]
    pub fn members(&self) -> u64 {
        self.members
    }

    /// Dotted paths of the varied fields.
    pub fn varied(&self) -> impl Iterator<Item = &str> {
        self.varied.iter().map(String::as_str)
    }

    /// Names of the cases; one empty name if the text has no cases.
    pub fn cases(&self) -> impl Iterator<Item = &str> {
        self.cases.iter().map(|case| case.name.as_str())
    }

    /// BLAKE3 hash of the parsed text, in hexadecimal; comments and layout do not change it.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The digest of the remaining text.
    pub(crate) fn with_digest(mut self) -> Self {
        let constraints: Vec<&str> = self.constraints.iter().map(Constraint::text).collect();
        let meaning = serde_json::json!({
            "members": self.members, "seed": self.seed, "sampling": self.sampling, "attempts": self.attempts,
            "cases": self.cases, "constraints": constraints, "correlations": self.correlations, "split": self.split,
            "compression": self.compression, "precision": self.precision,
        });
        self.digest = blake3::hash(meaning.to_string().as_bytes()).to_string();
        self
    }
}
