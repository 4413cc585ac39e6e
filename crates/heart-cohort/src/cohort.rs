//! A cohort as data: what its text says, checked.

use crate::correlation::{Copula, Correlation};
use crate::distribution::Distribution;
use crate::expression::Constraint;
use crate::field;
use crate::split::Split;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Most members: points of Sobol have 32 bits, and some are needed for draws that are rejected.
pub(crate) const MOST_MEMBERS: u64 = 1 << 26;

/// Members of a study: a scene, and what varies in it. Member `i` depends on the text and on `i`, on nothing else.
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
    /// All fields that any case varies: dimensions of the unit cube.
    pub(crate) varied: BTreeSet<String>,
    /// Those that are whole numbers.
    pub(crate) whole: BTreeSet<String>,
    pub(crate) digest: String,
}

/// How the members fill the space of their fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Sampling {
    /// Each member by itself, from its own stream of ChaCha8.
    #[default]
    Plain,
    /// Points of Sobol (direction numbers of Joe and Kuo, 2008), shifted by the seed: the first 2^k members fill the space of the
    /// fields evenly for each k. A draw that constraints reject is replaced by a point of a later block.
    Sobol,
}

/// Compression of the arrays in a shard, each by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Compression {
    /// `KEY.truth.npy`.
    #[default]
    None,
    /// `KEY.truth.npy.gz`, by gzip at its fastest level and without a time: the same bytes for the same version of the program.
    Gzip,
}

/// Precision of the samples in a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Precision {
    /// Four bytes a sample.
    #[default]
    Float32,
    /// Two bytes: relative error at most 2^-11 from 6.1e-5 on, absolute error at most 2^-25 below. A member with a sample beyond 65 504
    /// is refused.
    Float16,
}

/// One of `[[cases]]`: a part of the members that differs from the others by more than a number. A cohort without any has one.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) weight: f64,
    /// The whole scene, defaults filled in.
    pub(crate) scene: Value,
    pub(crate) vary: BTreeMap<String, Distribution>,
}

impl Cohort {
    /// A cohort to start from, as text, with a comment on every line.
    pub const TEMPLATE: &str = include_str!("template.toml");

    /// Number of members.
    pub fn members(&self) -> u64 {
        self.members
    }

    /// The fields that vary, by their dotted paths.
    pub fn varied(&self) -> impl Iterator<Item = &str> {
        self.varied.iter().map(String::as_str)
    }

    /// Names of the cases; one without a name if the text has none.
    pub fn cases(&self) -> impl Iterator<Item = &str> {
        self.cases.iter().map(|case| case.name.as_str())
    }

    /// BLAKE3 of what the text means, in hexadecimal: of two that differ in comments or layout only it is the same.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The digest of everything else in it.
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

    /// The number that a field has in the scene of a case, before anything varies.
    pub(crate) fn number_of_case(&self, case: usize, path: &str) -> Option<f64> {
        field::get(&self.cases[case].scene, path)?.as_f64()
    }
}
